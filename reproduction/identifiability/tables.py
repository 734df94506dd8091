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

Studies = dict[tuple[str, str], dict[str, NDArray[np.float64]]]
"""By plant and risk, and by way to choose: nUPE (S, K) of S data sets after K numbers of demonstrations."""

RESAMPLED = 2000
"""Bootstrap samples of data sets behind an interval."""

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


def count_demonstrations(random: NDArray[np.float64], other: NDArray[np.float64]) -> tuple[int, int]:
    """Count how many demonstrations reach the least median error of random ones.

    Parameters
    ----------
    random, other : ndarray of shape (S, K)
        nUPE of S data sets, chosen at random and otherwise, after each of K numbers of demonstrations.

    Returns
    -------
    at_random, otherwise : int
        Places among these numbers; K where it is not reached.
    """
    middle, best = np.median(other, axis=0), np.minimum.accumulate(np.median(random, axis=0))
    reached = middle <= best[-1]
    return int(np.argmax(best <= best[-1])), int(np.argmax(reached)) if reached.any() else len(middle)


def measure_share(random: NDArray[np.float64], other: NDArray[np.float64]) -> tuple[float, float, float]:
    """Measure which share of the demonstrations added at random is needed for the same error, with an interval.

    Parameters
    ----------
    random, other : ndarray of shape (S, K)
        As for `count_demonstrations`.

    Returns
    -------
    share, low, high : float
        The share, and the 5 and 95 percentiles of it over bootstrap samples of data sets.
    """

    def share(rows: NDArray[np.int64]) -> float:
        at_random, otherwise = count_demonstrations(random[rows], other[rows])
        return otherwise / max(at_random, 1)

    sets, rng = len(other), np.random.default_rng(0)
    drawn = [share(rng.integers(sets, size=sets)) for _ in range(RESAMPLED)]
    low, high = np.percentile(drawn, [5, 95])
    return share(np.arange(sets)), float(low), float(high)


def write_advice_table(studies: Studies) -> str:
    """Write how many demonstrations each way to choose needs for what random choice reaches in the end."""
    rows = []
    for (plant, risk), ways in studies.items():
        first, step = COUNTS[plant]
        for way, errors in ways.items():
            random = ways["random"][: len(errors)]
            at_random, needed = count_demonstrations(random, errors)
            share, low, high = measure_share(random, errors)
            last = np.median(errors[:, -1]) / np.median(random[:, -1])
            reached = needed < errors.shape[1]
            rows.append(
                [
                    f"{plant}, {risk}",
                    way,
                    str(len(errors)),
                    f"{first + step * (needed if reached else at_random)}{'' if reached else ' are too few'}",
                    "1" if way == "random" else f"{share:.2f} ({low:.2f} to {high:.2f})" if reached else "-",
                    f"{np.median(errors[:, -1]):.2g} ({last:.2g})",
                ]
            )
    return markdown.table(
        ["advice", "chosen", "data sets", "demonstrations", "share of random", "nUPE in the end (of random)"],
        rows,
    )


def list_advice(studies: Studies) -> tuple[str, ...]:
    """Say what following the advice saves, and how much an oracle would."""
    sentences = []
    for (plant, risk), ways in studies.items():
        for way, errors in ways.items():
            if way != "random":
                share, low, high = measure_share(ways["random"][: len(errors)], errors)
                sentences.append(
                    f"{plant[0].upper()}{plant[1:]}, {risk}, {way}: {share:.2f} of the demonstrations that random "
                    f"choice adds ({low:.2f} to {high:.2f}, {len(errors)} data sets): half is "
                    f"{'reached' if share <= 0.5 else 'not reached'}."
                )
    return tuple(sentences)


def list_findings(results: Results, found: list[Surface]) -> tuple[str, ...]:
    """Say whether shares order the errors, and what the surfaces show."""
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
    for surface in found:
        sentences.append(
            f"{surface.name}: the direction least seen is off the normal of the points there by "
            f"{np.median(surface.angles):.1f}° in the median; the direction of the policy's largest deviation by "
            f"{np.median(surface.posterior_angles):.1f}°, since a model generalises between places."
        )
    if not found:
        sentences.append(f"The recorded surfaces are left out: {NEEDED}.")
    return tuple(sentences)
