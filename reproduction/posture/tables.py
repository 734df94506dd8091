"""The posture's results as Markdown, and what is to be said about them."""

from typing import Any

import numpy as np

from reproduction import markdown, published
from reproduction.adaptive_column import ADAPTIVE, name_data_sets
from reproduction.posture.trial import RISKS, collect


def write_table(results: list[dict[str, Any]], adaptive: list[dict[str, Any]]) -> str:
    """Write the errors by risk: published | ours.

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
    for risk in (*RISKS, *([ADAPTIVE] if adaptive else [])):
        known = published.POSTURE_NUPE.get(risk)
        of_risk = adaptive if risk == ADAPTIVE else results
        ours = [markdown.mean_and_deviation(collect(of_risk, risk, error)) for error in ("nUPE", "nCPE")]
        rows.append([risk, f"{known[0]:.5f} ± {known[1]:.5f}" if known else "", *ours])
    table = markdown.table(["risk", "nUPE published", "nUPE ours", "nCPE ours"], rows)
    below = f"Mean ± standard deviation over {name_data_sets(results)}"
    below += f"; of {ADAPTIVE} over the first {name_data_sets(adaptive)}" if adaptive else ""
    return f"{table}\n\n{below}.\n"


def list_findings(results: list[dict[str, Any]], n: int) -> tuple[str, ...]:
    """Compare the errors over n joints with the published ones, and say how often the wall was met."""
    ours, direct = (collect(results, risk, "nUPE").mean() for risk in RISKS)
    met, share = (
        100 * np.mean([result[fact] for result in results])
        for fact in ("movements that meet the wall", "samples the wall blocks")
    )
    return (
        f"Mean nUPE {ours:.2g} with {n * (n + 1)} parameters (published "
        f"{published.POSTURE_NUPE['inconsistency'][0]:g}); direct regression {direct:.2g}, "
        f"{direct / ours:.0f} times that.",
        f"{met:.0f} % of the movements meet the wall; it blocks a hand at {share:.0f} % of the samples.",
    )
