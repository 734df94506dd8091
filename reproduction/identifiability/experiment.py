"""Reports and advice over 20 trials, and on recorded surfaces where they are given."""

from pathlib import Path

from rich.console import Console

from reproduction.identifiability import advice, figures, tables
from reproduction.identifiability.surfaces import examine_surfaces
from reproduction.identifiability.trial import SETTINGS, run_trial
from reproduction.outcome import Outcome, write_figures, write_results
from reproduction.recordings import check_surfaces
from reproduction.trials import run_trials

TRIALS = 20

CHOICES = (
    "Arm: the data and models of Table I; λ by the library's rule, on samples held out one by one; shares at a "
    "threshold of 1e-3; errors on held-out samples. All policies are learnt by inconsistency.",
    "Correlations are rank correlations (Spearman), over states between the length of the vector of standard "
    "deviations and that of the errors; coverage is the share of true action components within ±1.645 deviations.",
    f"Advice, toy: {advice.TOY_FIRST} movements to begin with, up to {advice.TOY_MOST}; each of 40 samples with one "
    "direction free. Random start and direction, against those advised out of "
    f"{advice.TOY_POOL} random starts (A-optimal).",
    f"Advice, arm (p = 1.8): {advice.ARM_FIRST} movements to begin with, up to {advice.ARM_MOST}, "
    f"{advice.ARM_AT_ONCE} at a time, each under one of the four constraint types. Random start and type, against "
    f"the best of {advice.ARM_POOL} random starts under every type, by the gain along the path that the policy learnt "
    "so far foresees. Tested on new movements under all four types.",
)


def reproduce(
    out: Path,
    *,
    trials: int | None = None,
    jobs: int = 1,
    console: Console,
    recordings: Path | None = None,
) -> Outcome:
    """Run the trials, and write tables and figures into `out`.

    `recordings` is the folder of the recorded surfaces; without it they are left out, and that is said.
    """
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
        "advice": (
            figures.plot_advice(results),
            "Error against the number of demonstrations, as advised and at random: median, quartiles shaded.",
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
    table = "\n\n".join(parts) + "\n"
    shown, drawn = write_figures(out, pictures)
    return Outcome(
        title="What recordings cannot tell",
        table=table,
        figures=shown,
        choices=CHOICES,
        findings=tables.list_findings(results, surfaces),
        files=(*write_results(out, {"settings": settings, "trials": results}, table), *drawn),
    )
