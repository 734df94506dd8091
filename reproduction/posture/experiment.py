"""The posture over 100 data sets."""

import os
from collections.abc import Iterable
from dataclasses import asdict
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console

from reproduction.adaptive_column import ADAPTIVE, run_adaptive
from reproduction.outcome import Outcome, write_figures, write_results
from reproduction.plants.barrier import CLEARANCE
from reproduction.plants.posture import FARTHEST, NEAREST, TILT, WEIGHT
from reproduction.plants.robot_choice import RobotChoice
from reproduction.posture.figures import plot_errors
from reproduction.posture.tables import list_findings, write_table
from reproduction.posture.trial import HELD_OUT, run_trial
from reproduction.trials import run_trials

TRIALS, ADAPTIVE_TRIALS = 100, 10
"""Data sets, and how many of them are learnt by risk "adaptive" as well."""

CHOICES = (
    f"W = {WEIGHT:g} I, so that π = -∇φ = -{2 * WEIGHT:g} (x - x_c); the step is one, x ← x + u.",
    "Starts are N(q0, 0.1 I), clipped to the joint limits and free of self-collision.",
    f"The wall stands at {NEAREST:g} to {FARTHEST:g} of the way from the hands at home to the hands outstretched, "
    f"turned and tilted by up to {np.degrees(TILT):.0f}°, all uniformly; drawn anew while a hand would start in it.",
    f"A hand is blocked when nearer than {CLEARANCE:g} m to the wall and led nearer still: nᵀ J u = 0. A joint whose "
    "next step would leave its limits is held.",
    "The pelvis stands still: joint space is seen from there, and the wall is met by the arms and the waist.",
    f"Errors are taken on {HELD_OUT:.0%} as many other movements; λ is chosen among 25 values by the held-out risk of "
    "five folds of movements.",
)


def reproduce(
    out: Path,
    *,
    trials: int | None = None,
    jobs: int = 1,
    console: Console,
    robot: str | os.PathLike[str] | None = None,
    lock: str | Iterable[str] = (),
    hands: str | Iterable[str] = (),
    adaptive: int | None = None,
) -> Outcome:
    """Run the trials, and write the table and the JSON of all trials into `out`.

    `robot`, `lock` and `hands` name another robot, as for `Humanoid.load`; `adaptive` is the number of data sets that
    are learnt by risk "adaptive" as well, by default 10.
    """
    choice = RobotChoice.parse(robot, lock, hands)
    n = choice.load().n  # a robot that cannot be used is told at once
    settings = {"experiment": "posture", "robot": asdict(choice), "weight": WEIGHT, "version": 1}
    count = trials or TRIALS
    results = run_trials(
        partial(run_trial, choice=choice),
        count,
        out / "trials.jsonl",
        settings=settings,
        jobs=jobs,
        console=console,
        label="posture",
    )
    inferred = run_adaptive(
        partial(run_trial, choice=choice, risks=(ADAPTIVE,)),
        adaptive,
        ADAPTIVE_TRIALS,
        count,
        out,
        settings=settings,
        jobs=jobs,
        console=console,
        label="posture",
    )
    table = write_table(results, inferred)
    caption = "Normalised errors of every data set, and the published means (dashed)."
    shown, drawn = write_figures(out, {"errors": (plot_errors(results, inferred), caption)})
    return Outcome(
        title=f"A posture in {n} dimensions, a wall in the hands' way (Sec. IV-D)",
        table=table,
        figures=shown,
        choices=CHOICES,
        findings=list_findings(results, n),
        files=(
            *write_results(out, {"settings": settings, "trials": results, ADAPTIVE: inferred}, table),
            *drawn,
        ),
    )
