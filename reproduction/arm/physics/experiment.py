"""Both scenarios of the arm in physics, over 50 data sets."""

from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console

from reproduction.arm.physics.figures import plot_errors, render_frames
from reproduction.arm.physics.tables import list_findings, write_table
from reproduction.arm.physics.trial import EPISODES, GAIN, NEW_EPISODES, POWER, SETTINGS, run_trial
from reproduction.outcome import Outcome, write_figures, write_json
from reproduction.plants import arm_dynamics
from reproduction.plants.arm_stage import SCENARIOS, SERVO_GAIN
from reproduction.plants.rendering import NoOpenGL
from reproduction.trials import run_trials
from unconstrain import plot
from unconstrain.robots import import_mujoco

TRIALS = 50

CHOICES = (
    f"p = {POWER}; a step of the paper lasts 0.1 s, so π = -{GAIN} ∇Φ in rad/s.",
    f"{EPISODES} trajectories of 4 s at 50 Hz to learn from, and {NEW_EPISODES} from new starts to test on.",
    f"Servo gain {SERVO_GAIN:g} N m s/rad in all joints; gravity compensated, as the arm's own "
    "controller does; the table without friction.",
    f"Encoder noise {arm_dynamics.ENCODER_NOISE:g} rad; velocities by Savitzky-Golay over {arm_dynamics.WINDOW:g} s.",
    "The arm hangs over the table, so that its policy leads the hand down to it; the table's depth is uniform in "
    f"{arm_dynamics.DEPTH[0]:g} to {arm_dynamics.DEPTH[1]:g} m below the base, its tilt up to "
    f"{np.degrees(arm_dynamics.TILT):.0f}°, both drawn for each trajectory.",
)


def reproduce(out: Path, *, trials: int | None = None, jobs: int = 1, console: Console) -> Outcome:
    """Run the trials, and write tables, figures and the JSON of all trials into `out`.

    Raises `UnconstrainError` without the extra `sim`. Without OpenGL the frames are left out, and that is said.
    """
    import_mujoco()
    kept = out / "physics.jsonl"
    results = run_trials(
        partial(run_trial, SCENARIOS),
        trials or TRIALS,
        kept,
        settings=SETTINGS,
        jobs=jobs,
        console=console,
        label="arm, physics",
    )
    caption = f"nUPE in physics: {len(results)} data sets of each scenario."
    shown, drawn = write_figures(out, {"physics": (plot_errors(results), caption)})
    findings = list_findings(results)
    try:
        frames = plot.save(render_frames(), out / "frames.png")
        shown[frames] = "Frames of the first movement: the hand gripped, and sliding on a table."
    except NoOpenGL as error:
        findings = (*findings, f"No frames: {error}.")
    return Outcome(
        title="The arm in physics",
        table=write_table(results),
        figures=shown,
        choices=CHOICES,
        findings=findings,
        files=(write_json(out / "physics.json", {"settings": SETTINGS, "trials": results}), kept, *drawn),
    )
