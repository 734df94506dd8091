"""What recordings cannot tell: is the report true, and is its advice worth following?"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from scipy.stats import spearmanr

from reproduction import identifiability_figures as drawing
from reproduction import identifiability_trials as trying
from reproduction.identifiability_surfaces import FILES, Surface, surfaces
from reproduction.outcome import Outcome, write_results
from reproduction.trials import run_trials
from unconstrain import plot

TRIALS = 20

CHOICES = (
    "Arm: the data, models and λ of Table I; shares at a threshold of 1e-3; errors on held-out samples.",
    "Correlations are rank correlations (Spearman), over states between the length of the vector of standard "
    "deviations and that of the errors; coverage is the share of true action components within ±1.645 deviations.",
    f"Advice, toy: {trying.TOY_FIRST} movements to begin with, up to {trying.TOY_MOST}; each of 40 samples with one "
    "direction free. Random start and direction, against those advised out of "
    f"{trying.TOY_POOL} random starts (A-optimal).",
    f"Advice, arm (p = 1.8): {trying.ARM_FIRST} movements to begin with, up to {trying.ARM_MOST}, "
    f"{trying.ARM_AT_ONCE} at a time, each under one of the four constraint types. Random start and type, against "
    f"the best of {trying.ARM_POOL} random starts under every type, by the gain along the path that the policy learnt "
    "so far foresees. Tested on new movements under all four types.",
)


def reproduce(out: Path, *, trials: int | None = None, jobs: int = 1, console: Console) -> Outcome:
    """Run the trials, look at the recorded surfaces where they are at hand, and write tables and figures into `out`."""
    trials = trials or TRIALS
    settings = {"experiment": "identifiability", **trying.SETTINGS}
    results = run_trials(
        trying.trial,
        trials,
        out / "trials.jsonl",
        settings=settings,
        jobs=jobs,
        console=console,
        label="identifiability",
    )
    found = surfaces() if all(path.is_file() for path in FILES) else []
    table = "\n\n".join([_arm_table(results), _calibration_table(results), *_surface_table(found)]) + "\n"
    files = write_results(out, {"settings": settings, "trials": results}, table)
    pictures = {
        "toy": (
            drawing.toy(),
            "What four movements of the limit cycle determine. Left: standard deviation of the learnt policy, and "
            "ellipses of it in both directions; right: its actual error.",
        ),
        "shares": (
            drawing.shares(results),
            "Arm: the determined share, known without the truth, and the error, under the four types of constraint.",
        ),
        "advice": (
            drawing.advice(results),
            "Error against the number of demonstrations, as advised and at random: median, quartiles shaded.",
        ),
    }
    if found:
        pictures["surfaces"] = (
            drawing.surfaces(found),
            "A finger on two surfaces: the direction least seen at a state, and the normal of the recording's own "
            "points there.",
        )
    written = {name: plot.save(figure, out / f"{name}.png") for name, (figure, _) in pictures.items()}
    return Outcome(
        title="What recordings cannot tell",
        table=table,
        figures={path: pictures[name][1] for name, path in written.items()},
        choices=CHOICES,
        findings=_findings(results, found),
        files=files,
    )


def _values(results: list[dict], part: str, row: str, what: str) -> NDArray[np.float64]:
    return np.array([result[part][row][what] for result in results])


def _arm_table(results: list[dict]) -> str:
    lines = [
        "| arm | determined share | nUPE | std against error | in the 90 % interval |",
        "| --- | --- | --- | --- | --- |",
    ]
    for row in results[0]["arm"]:
        share, error, correlation, inside = (
            _values(results, "arm", row, what) for what in ("determined", "nUPE", "correlation", "coverage")
        )
        lines.append(
            f"| p = {row} | {share.mean():.3f} ± {share.std():.3f} | {error.mean():.3g} ± {error.std():.2g} "
            f"| {correlation.mean():.2f} | {inside.mean():.0%} |"
        )
    return "\n".join(lines)


def _calibration_table(results: list[dict]) -> str:
    lines = [
        "| calibration | nUPE (median) | std against error | in the 90 % interval |",
        "| --- | --- | --- | --- |",
    ]
    for row in results[0]["calibration"]:
        error, correlation, inside = (
            _values(results, "calibration", row, what) for what in ("nUPE", "correlation", "coverage")
        )
        lines.append(
            f"| {row} | {np.median(error):.2g} | {correlation.mean():.2f} ± {correlation.std():.2f} "
            f"| {inside.mean():.0%} ± {inside.std():.0%} |"
        )
    return "\n".join(lines)


def _surface_table(found: list[Surface]) -> list[str]:
    if not found:
        return []
    lines = [
        "| surface | least-seen direction off the local normal: median, 90 % below | its share of the motion |",
        "| --- | --- | --- |",
    ]
    for surface in found:
        middle, high = np.percentile(surface.angles, [50, 90])
        lines.append(f"| {surface.name} | {middle:.1f}°, {high:.1f}° | {np.median(surface.shares):.1%} |")
    return ["\n".join(lines)]


def rank_correlations(results: list[dict], p: float) -> NDArray[np.float64]:
    """Of determined share and nUPE over the four types of constraint, one a trial; -1 orders them perfectly."""
    rows = [f"{p} {rows}" for rows in trying.BEST_FIRST]
    return np.array(
        [
            spearmanr(
                [r["arm"][row]["determined"] for row in rows], [r["arm"][row]["nUPE"] for row in rows]
            ).statistic
            for r in results
        ]
    )


def demonstrations_needed(results: list[dict], part: str) -> tuple[int, int, float]:
    """How many random and how many advised demonstrations reach the least median error of random ones, and that."""
    random, advised = (np.median([r[part][way] for r in results], axis=0) for way in ("random", "advised"))
    first, step = drawing.COUNTS[part]
    best = np.minimum.accumulate(random)
    at_random, as_advised = int(np.argmax(best <= best[-1])), advised <= best[-1]
    reached = int(np.argmax(as_advised)) if as_advised.any() else len(advised)
    return first + step * at_random, first + step * reached, float(best[-1])


def _findings(results: list[dict], found: list[Surface]) -> tuple[str, ...]:
    sentences = []
    for p in trying.POWERS:
        each = rank_correlations(results, p)
        shares, errors = (
            [_values(results, "arm", f"{p} {rows}", what).mean() for rows in trying.BEST_FIRST]
            for what in ("determined", "nUPE")
        )
        sentences.append(
            f"Arm, p = {p}: rank correlation of determined share and nUPE {each.mean():.2f} ± {each.std():.2f} over "
            f"trials, {np.mean(each <= -0.999):.0%} of them in perfect order; of the means over trials "
            f"{spearmanr(shares, errors).statistic:.2f}."
        )
    for part in drawing.COUNTS:
        random, advised, error = demonstrations_needed(results, part)
        begun = drawing.COUNTS[part][0]
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
        sentences.append(
            "The recorded surfaces are not at hand (../shared/data), so nothing is said of them."
        )
    return tuple(sentences)
