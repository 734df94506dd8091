"""Constraints learnt, measured and used, over 50 data sets, and on recorded surfaces where they are given."""

from pathlib import Path
from typing import Any

from rich.console import Console

from reproduction.constraints import figures, tables
from reproduction.constraints.measured import (
    GRASP_MODELS,
    GRASPS,
    MARGIN,
    MEASURED_SETTINGS,
    PHYSICS_EPISODES,
    SENSOR_NOISE,
    THRESHOLD,
    run_measured,
)
from reproduction.constraints.settings import ARM_EPISODES, ARM_LENGTH, EPISODES, LENGTH
from reproduction.constraints.surfaces import BLOCKS, learn_surfaces
from reproduction.constraints.trial import CONDITIONS, SETTINGS, run_trial
from reproduction.outcome import Outcome, write_figures, write_results
from reproduction.recordings import NEEDED, check_surfaces
from reproduction.trials import run_trials
from unconstrain.errors import UnconstrainError
from unconstrain.robots import import_mujoco

TRIALS = 50

CHOICES = (
    f"2-D and planar arms: {EPISODES} movements of {LENGTH} samples; 7-DOF arm: {ARM_EPISODES} of {ARM_LENGTH}. Learnt "
    "from one half of the movements, tested on the other, without noise.",
    "Parabolas have rows (-2 a x1, 1) with 0.2 < |a| < 2; the features are (x, 1). Arms have their task Jacobian as "
    "features, and the number of rows is found, not given.",
    f"The chain: {CONDITIONS} random constraints, each a task whose velocity varies as much as the policy.",
    f"Measured: {PHYSICS_EPISODES} movements of the arm in physics over tables, a force sensor with noise of "
    f"{SENSOR_NOISE:g} N in each axis, contact above {THRESHOLD:g} N, {MARGIN} samples around each landing unknown; "
    f"{GRASPS} movements of the humanoid through the gap, {GRASP_MODELS} local models.",
    f"Recordings: errors on {BLOCKS} blocks of each recording, held out in five folds. Where a learnt projection "
    "blocks more of a sample's own action than it lets through, it counts as unknown (0.4 % of the samples).",
)


def reproduce(
    out: Path,
    *,
    trials: int | None = None,
    jobs: int = 1,
    console: Console,
    recordings: Path | None = None,
) -> Outcome:
    """Run the trials, and write tables, figures and the JSON of all trials into `out`.

    `recordings` is the folder of the recorded surfaces; without it they are left out, and that is said. Measured
    constraints, which need the extra `sim`, are left out likewise.
    """
    check_surfaces(recordings)
    trials = trials or TRIALS
    results = run_trials(
        run_trial,
        trials,
        out / "trials.jsonl",
        settings=SETTINGS,
        jobs=jobs,
        console=console,
        label="learnt",
    )
    kept: dict[str, Any] = {"settings": SETTINGS, "trials": results}
    parts = [tables.write_learnt_table(results), tables.write_chain_table(results)]
    findings = list(tables.list_learnt_findings(results))
    pictures = {
        "noise": (
            figures.plot_noise(results),
            "nPPE against noise on the actions; medians and quartiles.",
        ),
        "rows": (
            figures.plot_rows(results),
            "Which of the six task coordinates are found to be fixed.",
        ),
    }
    try:
        import_mujoco()
    except UnconstrainError as error:
        findings.append(f"Measured constraints are left out: {error}.")
    else:
        measured = run_trials(
            run_measured,
            trials,
            out / "measured.jsonl",
            settings=MEASURED_SETTINGS,
            jobs=jobs,
            console=console,
            label="measured",
        )
        kept["measured"] = measured
        parts.append(tables.write_measured_table(measured))
        findings += tables.list_measured_findings(measured)
        pictures["measured"] = (
            figures.plot_measured(measured),
            "nUPE of each data set, by what is known.",
        )
    if recordings is None:
        findings.append(f"The recorded surfaces are left out: {NEEDED}.")
    else:
        console.print("learning the recorded surfaces")
        surfaces = learn_surfaces(recordings)
        parts.append(tables.write_surfaces_table(surfaces))
        findings += tables.list_surfaces_findings(surfaces)
        pictures["surfaces"] = (
            figures.plot_surfaces(surfaces),
            "The recorded surfaces, with the normals learnt; the held-out error by number of RBFs.",
        )
    table = "\n\n".join(parts) + "\n"
    shown, drawn = write_figures(out, pictures)
    return Outcome(
        title="Constraints learnt, measured and used",
        table=table,
        figures=shown,
        choices=CHOICES,
        findings=tuple(findings),
        files=(*write_results(out, kept, table), *drawn),
    )
