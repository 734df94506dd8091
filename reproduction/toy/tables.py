"""The toy's results as Markdown, and what is to be said about them."""

from functools import partial

from reproduction import published
from reproduction.adaptive_column import ADAPTIVE, name_data_sets
from reproduction.markdown import mean_and_deviation, table
from reproduction.toy.trial import WAYS, Result, collect, name_noise, name_row
from unconstrain.demo import FEW, MOVEMENTS

COMPARED_NOISE = (0.05, 0.1, 0.2)
"""Steps of the sweep over noise at which the risks are compared in words."""


def write_table(results: list[Result], adaptive: list[Result]) -> str:
    """Write the errors of every way to learn: published | ours.

    Parameters
    ----------
    results, adaptive : list of dict
        What the paper's ways to learn measured on each data set, and what risk "adaptive" did, if anything.

    Returns
    -------
    str
        Markdown.
    """
    rows = [_write_row(results, name_row(way, movements)) for way in WAYS for movements in (FEW, MOVEMENTS)]
    below = f"Mean ± standard deviation over {name_data_sets(results)}"
    if adaptive:
        rows += [_write_row(adaptive, name_row(ADAPTIVE, movements)) for movements in (FEW, MOVEMENTS)]
        below += f"; of {ADAPTIVE} over the first {name_data_sets(adaptive)}"
    header = ["", "nUPE published", "nUPE ours", "nCPE published", "nCPE ours"]
    return f"{table(header, rows)}\n\n{below}.\n"


def _write_row(results: list[Result], row: str) -> list[str]:
    cells = [row]
    for error in ("nUPE", "nCPE"):
        known = published.TOY.get(row, {}).get(error)
        cells += [
            f"{known[0]:.4f} ± {known[1]:.4f}" if known else "",
            mean_and_deviation(collect(results, row, error)),
        ]
    return cells


def list_findings(results: list[Result], adaptive: list[Result]) -> tuple[str, ...]:
    """Compare our means with the published ones, a sentence each, and risk "adaptive" with the inconsistency."""
    ours, oracle, direct, few = (
        collect(results, name_row(way, movements), "nUPE").mean()
        for way, movements in (
            ("inconsistency", MOVEMENTS),
            ("oracle", MOVEMENTS),
            ("direct", MOVEMENTS),
            ("inconsistency", FEW),
        )
    )
    cpe = collect(results, name_row("inconsistency", MOVEMENTS), "nCPE").mean()
    findings = [
        f"40 trajectories: mean nUPE {ours:.2g} (published 0.0027), mean nCPE {cpe:.2g} (published 0.0002).",
        f"4 trajectories: mean nUPE {few:.2g} (published 0.38).",
        f"The same model shown the true policy itself reaches {oracle:.2g}: ours is {ours / oracle:.2f} times that.",
        f"Ordinary regression on the same 40 trajectories: {direct:.2g}, {direct / ours:.0f} times ours.",
    ]
    if adaptive:
        findings.append(_compare_adaptive(results[: len(adaptive)], adaptive))
    return tuple(findings)


def _compare_adaptive(results: list[Result], adaptive: list[Result]) -> str:
    """Compare both risks on the same data sets."""
    labels = {f"{n} trajectories": partial(name_row, movements=n) for n in (FEW, MOVEMENTS)}
    labels |= {f"{100 * noise:g} % noise": partial(name_noise, noise=noise) for noise in COMPARED_NOISE}
    compared = (
        f"{label} {collect(adaptive, name(ADAPTIVE), 'nUPE').mean():.2g} "
        f"({collect(results, name('inconsistency'), 'nUPE').mean():.2g})"
        for label, name in labels.items()
    )
    return (
        f"Mean nUPE of {ADAPTIVE}, and in brackets of the inconsistency on the same {name_data_sets(adaptive)}: "
        f"{'; '.join(compared)}."
    )
