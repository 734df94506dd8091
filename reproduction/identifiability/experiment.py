"""Reports and advice over 20 trials, and on recorded surfaces where they are given."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from reproduction.identifiability import advice, figures, tables
from reproduction.identifiability.surfaces import examine_surfaces
from reproduction.identifiability.trial import SETTINGS, run_trial
from reproduction.outcome import Outcome, write_figures, write_results
from reproduction.recordings import check_surfaces
from reproduction.trials import run_trials
from unconstrain.errors import UnconstrainError

TRIALS = 20

PARTS = ("report", "advice")

STUDIES = {
    ("limit cycle", "inconsistency"): {"random": 20, "advised": 20, "oracle": 20},
    ("limit cycle", "adaptive"): {"random": 20, "advised": 20},
    ("arm", "inconsistency"): {"random": 20, "advised": 20, "oracle": 10},
    ("arm", "adaptive"): {"random": 5, "advised": 5},
}
"""Data sets by plant and risk, and by way to choose. The oracle learns so often that the adaptive risk is too slow."""

ADVICE_CAPTION = "Error against the number of demonstrations: median over data sets, quartiles shaded."

CHOICES = (
    "Arm: the data and models of Table I; λ by the library's rule, on samples held out one by one; shares at a "
    "threshold of 1e-3; errors on held-out samples. All policies are learnt by inconsistency.",
    "Correlations are rank correlations (Spearman), over states between the length of the vector of standard "
    "deviations and that of the errors; coverage is the share of true action components within ±1.645 deviations.",
    f"Advice, limit cycle: {advice.TOY_FIRST} movements to begin with, up to {advice.TOY_MOST}; each of 40 samples "
    "with one direction free, without noise. Random start and direction, against those advised out of "
    f"{advice.TOY_POOL} random starts (A-optimal), against the best of {advice.TOY_TRIED} random ones by the true "
    "error.",
    f"Advice, arm (p = 1.8): {advice.ARM_FIRST} movements to begin with, up to {advice.ARM_MOST}, "
    f"{advice.ARM_AT_ONCE} at a time, each under one of the four constraint types. Random start and type, against "
    f"the best of {advice.ARM_POOL} random starts under every type, by the gain along the path that the policy learnt "
    f"so far foresees, against the best of {advice.ARM_TRIED} random ones by the true error, one after the other. "
    "Tested on new movements under all four types. The rules were set on data sets 100 to 109.",
    "Share of random: of the demonstrations added to the first ones, for the least median error that random choice "
    "reaches; in brackets the 5 and 95 percentiles over bootstrap samples of data sets.",
)


def reproduce(
    out: Path,
    *,
    trials: int | None = None,
    jobs: int = 1,
    console: Console,
    recordings: Path | None = None,
    part: str | None = None,
) -> Outcome:
    """Run the trials, and write tables and figures into `out`.

    `recordings` is the folder of the recorded surfaces; without it they are left out, and that is said. `part` is one
    of `PARTS`, by default all.
    """
    if part is not None and part not in PARTS:
        raise UnconstrainError(f"there is no part {part!r}: choose one of {', '.join(PARTS)}")
    if part == "advice":
        return _follow_advice(out, trials, jobs, console)
    check_surfaces(recordings)
    settings = {"experiment": "identifiability", **SETTINGS}
    results = run_trials(
        run_trial,
        trials or TRIALS,
        out / "trials.jsonl",
        settings=settings,
        jobs=jobs,
        console=console,
        label="identifiability",
    )
    parts = [tables.write_arm_table(results), tables.write_calibration_table(results)]
    pictures = {
        "toy": (
            figures.plot_toy(),
            "What four movements of the limit cycle determine. Left: standard deviation of the learnt policy, and "
            "ellipses of it in both directions; right: its actual error.",
        ),
        "shares": (
            figures.plot_shares(results),
            "Arm: the determined share, known without the truth, and the error, under the four types of constraint.",
        ),
    }
    surfaces = []
    if recordings is not None:
        console.print("examining the recorded surfaces")
        surfaces = examine_surfaces(recordings)
        parts.append(tables.write_surfaces_table(surfaces))
        pictures["surfaces"] = (
            figures.plot_surfaces(surfaces),
            "A finger on two surfaces: the direction least seen at a state, and the normal of the recording's own "
            "points there.",
        )
    findings = tables.list_findings(results, surfaces)
    kept: dict[str, Any] = {"settings": settings, "trials": results}
    if part is None:
        studies = _run_studies(out, trials, jobs, console)
        parts.append(tables.write_advice_table(studies))
        pictures["advice"] = figures.plot_advice(studies), ADVICE_CAPTION
        findings += tables.list_advice(studies)
        kept["advice"] = _list_studies(studies)
    table = "\n\n".join(parts) + "\n"
    shown, drawn = write_figures(out, pictures)
    return Outcome(
        title="What recordings cannot tell",
        table=table,
        figures=shown,
        choices=CHOICES,
        findings=findings,
        files=(*write_results(out, kept, table), *drawn),
    )


def _follow_advice(out: Path, trials: int | None, jobs: int, console: Console) -> Outcome:
    """Run the part "advice" alone."""
    studies = _run_studies(out, trials, jobs, console)
    table = tables.write_advice_table(studies) + "\n"
    shown, drawn = write_figures(out, {"advice": (figures.plot_advice(studies), ADVICE_CAPTION)})
    return Outcome(
        title="What to record next",
        table=table,
        figures=shown,
        choices=CHOICES[2:],
        findings=tables.list_advice(studies),
        files=(*write_results(out, {"advice": _list_studies(studies)}, table), *drawn),
    )


def _run_studies(out: Path, trials: int | None, jobs: int, console: Console) -> tables.Studies:
    studies: tables.Studies = {}
    for (plant, risk), ways in STUDIES.items():
        studies[plant, risk] = {}
        for way, most in ways.items():
            name = f"{plant}, {risk}, {way}"
            results = run_trials(
                partial(advice.follow, plant, risk, way),
                min(trials or most, most),
                out / f"advice-{plant}-{risk}-{way}.jsonl".replace(" ", "-"),
                settings={
                    "experiment": "advice",
                    "plant": plant,
                    "risk": risk,
                    "way": way,
                    "settings": advice.PLANTS[plant],
                    "version": 1,
                },
                jobs=jobs,
                console=console,
                label=name,
            )
            studies[plant, risk][way] = np.array([result["nUPE"] for result in results])
    return studies


def _list_studies(studies: tables.Studies) -> dict[str, Any]:
    return {
        f"{plant}, {risk}": {way: errors.tolist() for way, errors in ways.items()}
        for (plant, risk), ways in studies.items()
    }
