"""Table II as Markdown, and what is to be said about it."""

from collections import Counter
from typing import Any

import numpy as np

from reproduction import markdown, published
from reproduction.adaptive_column import ADAPTIVE, name_data_sets
from reproduction.grasp.trial import COLUMNS, collect


def write_table(results: list[dict[str, Any]], adaptive: list[dict[str, Any]]) -> str:
    """Write the errors of both approaches: published | ours.

    Parameters
    ----------
    results, adaptive : list of dict
        What the paper's risks measured on each data set, and what risk "adaptive" did, if anything.

    Returns
    -------
    str
        Markdown.
    """
    rows = []
    for column in results[0]["direct"]:
        cells = [column]
        for risk in ("direct", "inconsistency"):
            known = published.GRASP.get(column, {}).get(risk)
            cells += [
                f"{known[0]:.4f} ± {known[1]:.4f}" if known else "",
                _measured(collect(results, risk, column)),
            ]
        cells.append(_compare_direct(results, column))
        if adaptive:
            cells.append(_measured(collect(adaptive, ADAPTIVE, column)))
        rows.append(cells)
    columns = [f"{risk} {whose}" for risk in ("direct", "inconsistency") for whose in ("published", "ours")]
    header = ["test", *columns, "direct / ours", *([ADAPTIVE] if adaptive else [])]
    below = f"Mean ± standard deviation over {name_data_sets(results)}"
    below += f", of {ADAPTIVE} over the first {name_data_sets(adaptive)}" if adaptive else ""
    return (
        f"{markdown.table(header, rows)}\n\n{below}. The first three rows are errors at the states of held-out "
        "movements, under the projections named; those that end in “moving” are errors along movements the expert "
        "makes under that constraint.\n"
    )


def _compare_direct(results: list[dict[str, Any]], column: str) -> str:
    """Write how many times the error of the inconsistency direct regression has."""
    ratio = collect(results, "direct", column).mean() / collect(results, "inconsistency", column).mean()
    return f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.2g}"


def _measured(values: np.ndarray) -> str:
    return markdown.mean_and_deviation(values, ".2g" if values.mean() < 1e-4 else ".4f")


def list_findings(results: list[dict[str, Any]], adaptive: list[dict[str, Any]]) -> tuple[str, ...]:
    """Compare our means with the published ones and with risk "adaptive", and say what happened in the data sets."""
    met, share, unseen, tracking = (
        np.array([result[fact] for result in results])
        for fact in (
            "movements that meet the barrier",
            "samples the barrier blocks",
            "movements that meet the unseen barrier",
            "tracking error",
        )
    )
    chosen = Counter(result["inconsistency model"] for result in results)
    compared = (
        f"On the same {name_data_sets(adaptive)}, by {ADAPTIVE} and in brackets by inconsistency: "
        + ", ".join(
            f"{column} {collect(adaptive, ADAPTIVE, column).mean():.2g} "
            f"({collect(results[: len(adaptive)], 'inconsistency', column).mean():.2g})"
            for column in COLUMNS
        )
        + "."
        for _ in adaptive[:1]
    )
    return (
        *(
            f"{column}: mean {collect(results, 'inconsistency', column).mean():.2g}, median "
            f"{np.median(collect(results, 'inconsistency', column)):.2g} (published mean "
            f"{published.GRASP[column]['inconsistency'][0]:g}); direct has {_compare_direct(results, column)} "
            "times that mean."
            for column in COLUMNS
        ),
        *compared,
        f"Model: {', '.join(f'{name} ({count} of {len(results)})' for name, count in chosen.items())}.",
        f"{100 * met.mean():.0f} % of the movements meet the barrier (at least {100 * met.min():.0f} % in every data "
        f"set); it blocks a hand at {100 * share.mean():.0f} % of the samples. The unseen barrier is met by "
        f"{100 * unseen.mean():.0f} %.",
        f"Whole-body control: the hands' realised velocity differs from the commanded by {tracking.mean():.1e} of it "
        f"(root mean square), {tracking.max():.1e} at most.",
    )
