"""Grasping a ball through a gap in a barrier, over 50 data sets."""

import os
from collections.abc import Iterable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console

from reproduction.adaptive_column import ADAPTIVE, run_adaptive
from reproduction.grasp import figures, trial
from reproduction.grasp import video as films
from reproduction.grasp.tables import list_findings, write_table
from reproduction.outcome import Outcome, write_results
from reproduction.plants.barrier import CLEARANCE
from reproduction.plants.grasping import ALPHA, DURATION, RATE, SIGMA_SQUARED, Demonstrator
from reproduction.plants.robot_choice import RobotChoice
from reproduction.trials import run_trials

TRIALS, ADAPTIVE_TRIALS = 50, 10
"""Data sets, and how many of them are learnt by risk "adaptive" as well."""


def reproduce(
    out: Path,
    *,
    trials: int | None = None,
    jobs: int = 1,
    console: Console,
    model: str = "local",
    robot: str | os.PathLike[str] | None = None,
    lock: str | Iterable[str] = (),
    hands: str | Iterable[str] = (),
    feet: str | Iterable[str] = (),
    video: str | os.PathLike[str] | None = None,
    adaptive: int | None = None,
) -> Outcome:
    """Run the trials, and write Table II, Figs. 5 and 6, and the JSON of all trials into `out`.

    Parameters
    ----------
    out : Path
        The folder to write into. Finished trials are kept there.
    trials : int, optional
        Number of data sets; by default 50, as published.
    jobs : int
        Processes.
    console : Console
        Where progress is shown.
    model : str
        "local", "potential" or "auto", see `make_model`.
    robot, lock, hands, feet : str, or iterable of str
        Another robot, as for `Humanoid.load`.
    video : str or path, optional
        An .mp4 file to write as well.
    adaptive : int, optional
        Data sets that are learnt by risk "adaptive" as well; by default 10.

    Returns
    -------
    Outcome
        Without OpenGL the pictures of the robot are left out, and that is said.

    Raises
    ------
    UnconstrainError
        If the robot, the model or the video cannot be used; at once, before the first trial.
    """
    choice = RobotChoice.parse(robot, lock, hands, feet)
    demonstrator = trial.make_demonstrator(choice)
    trial.make_model("inconsistency", model)
    if video is not None:
        films.check_video(video)
    settings = {"experiment": "grasp", "model": model, "robot": asdict(choice), "rate": RATE, "version": 2}
    count = trials or TRIALS
    results = run_trials(
        partial(trial.run_trial, choice=choice, name=model),
        count,
        out / "trials.jsonl",
        settings=settings,
        jobs=jobs,
        console=console,
        label="grasp",
    )
    inferred = run_adaptive(
        partial(trial.run_trial, choice=choice, name=model, risks=(ADAPTIVE,)),
        adaptive,
        ADAPTIVE_TRIALS,
        count,
        out,
        settings=settings,
        jobs=jobs,
        console=console,
        label="grasp",
    )
    table = write_table(results, inferred)
    written = write_results(out, {"settings": settings, "trials": results, ADAPTIVE: inferred}, table)

    console.print("drawing data set 0")
    recording, obstacle = trial.record_training(demonstrator, 0)
    policies: dict[str, Any] = {"expert": demonstrator.policy}
    policies["inconsistency"], _ = trial.learn(recording.demonstrations, "inconsistency", model)
    policies["direct"], _ = trial.learn(recording.demonstrations, "direct")
    pictures = figures.write_pictures(out, demonstrator, recording, obstacle, policies)
    files = [*written, *pictures.files]
    if video is not None:
        console.print(f"filming into {video}")
        files.append(films.write_video(video, demonstrator, policies))
    for sentence in pictures.left_out:
        console.print(sentence)
    return Outcome(
        title="Grasping a ball through a gap (Table II, Figs. 5 and 6)",
        table=table,
        figures=pictures.shown,
        choices=_list_choices(demonstrator),
        findings=(*list_findings(results, inferred), *pictures.left_out),
        files=tuple(files),
    )


def _list_choices(demonstrator: Demonstrator) -> tuple[str, ...]:
    scene = demonstrator.scene
    feet = "the feet stay on the floor" if demonstrator.humanoid.feet else "the base stands still"
    return (
        f"π = -{RATE:g} ∇φ with α = {ALPHA:g}, σ² = {SIGMA_SQUARED:g}: the sign is that of an attractor, and the rate "
        f"brings the hands to the ball in {DURATION:g} s.",
        f"A hand is blocked when nearer than {CLEARANCE:g} m to the barrier and led nearer still; the normal is the "
        "direction from the barrier's nearest point, so that a hand can slide around an edge.",
        f"From the middle between the hands at home: the ball {scene.ball[0]:g} m ahead and {-scene.ball[2]:g} m "
        f"lower, the table's edge {scene.table_edge:g} m and the barrier {scene.barrier_x:g} m ahead. The barrier is "
        f"{scene.thickness:g} m thick, {scene.span:g} m wide and {scene.height:g} m high; the unseen one, in the "
        f"middle and without a gap, {scene.central_width:g} m wide. A hand grasps {scene.palm:g} m beside the ball.",
        f"Starts have both hands in front of any barrier's reach by {scene.margin:g} m, above the table, and each on "
        f"its own side. {feet.capitalize()}: a random posture is brought to stand as near to it as that allows.",
        f"Widths of gaps below zero mean no gap. {trial.HELD_OUT:.0%} as many movements as learnt from are held out "
        "for each test.",
        "Recorded velocity is J q̇ of the joint velocities that mink found, at the recorded position.",
        f"Local models: {trial.N_MODELS} centres by k-means, σ 1.5 times their mean spacing; λ among 25 values by "
        "inconsistency held out in five folds of movements (for the direct approach by its own risk).",
        f"Potential: a polynomial of degree {trial.POTENTIAL_DEGREE} (--model potential; a candidate of --model auto).",
    )
