"""What was found of reports and advice as Markdown, and what is to be said about it."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr

from reproduction import markdown
from reproduction.identifiability.figures import COUNTS
from reproduction.identifiability.surfaces import Surface
from reproduction.identifiability.trial import BEST_FIRST, POWERS
from reproduction.recordings import NEEDED

Results = list[dict[str, Any]]

DEVIATIONS = ("std against error", "in the 90 % interval")
"""Columns that compare standard deviations with errors."""


def _collect(results: Results, part: str, row: str, what: str) -> NDArray[np.float64]:
    return np.array([result[part][row][what] for result in results])


def write_arm_table(results: Results) -> str:
    """Write the determined share beside the errors, by constraint."""
    rows = []
    for row in results[0]["arm"]:
        share, error, correlation, inside = (
            _collect(results, "arm", row, what) for what in ("determined", "nUPE", "correlation", "coverage")
        )
        rows.append(
            [
                f"p = {row}",
                markdown.mean_and_deviation(share, ".3f"),
                markdown.mean_and_deviation(error, ".3g", ".2g"),
                f"{correlation.mean():.2f}",
                f"{inside.mean():.0%}",
            ]
        )
    return markdown.table(["arm", "determined share", "nUPE", *DEVIATIONS], rows)


def write_calibration_table(results: Results) -> str:
    """Write how the standard deviations compare with the errors, by model and noise."""
    rows = []
    for row in results[0]["calibration"]:
        error, correlation, inside = (
            _collect(results, "calibration", row, what) for what in ("nUPE", "correlation", "coverage")
        )
        rows.append(
            [
                row,
                f"{np.median(error):.2g}",
                markdown.mean_and_deviation(correlation, ".2f"),
                markdown.mean_and_deviation(inside, ".0%"),
            ]
        )
    return markdown.table(["calibration", "nUPE (median)", *DEVIATIONS], rows)


def write_surfaces_table(found: list[Surface]) -> str:
    """Write how far the least-seen direction is off the normal of each surface."""
    rows = []
    for surface in found:
        middle, high = np.percentile(surface.angles, [50, 90])
        rows.append([surface.name, f"{middle:.1f}°, {high:.1f}°", f"{np.median(surface.shares):.1%}"])
    least = "least-seen direction off the local normal: median, 90 % below"
    return markdown.table(["surface", least, "its share of the motion"], rows)


def correlate_ranks(results: Results, p: float) -> NDArray[np.float64]:
    """Correlate the ranks of determined share and nUPE over the types of constraint, trial by trial; -1 is perfect."""
    rows = [f"{p} {rows}" for rows in BEST_FIRST]
    return np.array(
        [
            spearmanr(
                [r["arm"][row]["determined"] for row in rows], [r["arm"][row]["nUPE"] for row in rows]
            ).statistic
            for r in results
        ]
    )


def count_demonstrations(results: Results, part: str) -> tuple[int, int, float]:
    """Count how many random and how many advised demonstrations reach the least median error of random ones.

    Returns
    -------
    at_random, as_advised : int
        Numbers of demonstrations.
    error : float
        The error that is reached.
    """
    random, advised = (np.median([r[part][way] for r in results], axis=0) for way in ("random", "advised"))
    first, step = COUNTS[part]
    best = np.minimum.accumulate(random)
    at_random, as_advised = int(np.argmax(best <= best[-1])), advised <= best[-1]
    reached = int(np.argmax(as_advised)) if as_advised.any() else len(advised)
    return first + step * at_random, first + step * reached, float(best[-1])


def list_findings(results: Results, found: list[Surface]) -> tuple[str, ...]:
    """Say whether shares order the errors, what following the advice saves, and what the surfaces show."""
    sentences = []
    for p in POWERS:
        each = correlate_ranks(results, p)
        shares, errors = (
            [_collect(results, "arm", f"{p} {rows}", what).mean() for rows in BEST_FIRST]
            for what in ("determined", "nUPE")
        )
        sentences.append(
            f"Arm, p = {p}: rank correlation of determined share and nUPE {each.mean():.2f} ± {each.std():.2f} over "
            f"trials, {np.mean(each <= -0.999):.0%} of them in perfect order; of the means over trials "
            f"{spearmanr(shares, errors).statistic:.2f}."
        )
    for part in COUNTS:
        random, advised, error = count_demonstrations(results, part)
        begun = COUNTS[part][0]
        last = {
            way: np.median([result[part][way][-1] for result in results]) for way in ("random", "advised")
        }
        share = (advised - begun) / (random - begun)
        sentences.append(
            f"{part[0].upper()}{part[1:]}: a median nUPE of {error:.2g} takes {random} demonstrations at random and "
            f"{advised} as advised ({advised / random:.2f} of all; {share:.2f} of those added to the first {begun}): "
            f"half is {'reached' if share <= 0.5 else 'not reached'}. With equally many, in the end, the error as "
            f"advised is {last['advised'] / last['random']:.2f} of that at random."
        )
    for surface in found:
        sentences.append(
            f"{surface.name}: the direction least seen is off the normal of the points there by "
            f"{np.median(surface.angles):.1f}° in the median; the direction of the policy's largest deviation by "
            f"{np.median(surface.posterior_angles):.1f}°, since a model generalises between places."
        )
    if not found:
        sentences.append(f"The recorded surfaces are left out: {NEEDED}.")
    return tuple(sentences)
