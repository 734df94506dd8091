"""`unconstrain rollout`: where a policy leads, free or under a constraint."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from unconstrain.cli import outputs, reporting
from unconstrain.cli.command import command
from unconstrain.cli.declared import Number, Numbers
from unconstrain.errors import DataError
from unconstrain.progress import working
from unconstrain.recordings.columns import START

if TYPE_CHECKING:
    import numpy as np

    from unconstrain.policies.base import Policy
    from unconstrain.policies.unsure import Unsure


@command(
    short_help="Follow a saved policy from a start.",
    epilog='For example:\n\n\b\nunconstrain rollout wipe.skops --start="0.1,0.2,0.3" --block="0,0,1"',
)
@click.argument("policy", type=click.Path(path_type=Path))
@click.option(
    "--start", type=Numbers(), required=True, help='Where to start, one number a state: --start="0.1,-0.2".'
)
@click.option(
    "--steps",
    type=click.IntRange(min=1),
    metavar="NUMBER",
    default=500,
    show_default=True,
    help="How many steps.",
)
@click.option("--dt", type=Number(), default=0.02, show_default=True, help="Seconds a step.")
@click.option(
    "--block",
    type=Numbers(),
    multiple=True,
    help='A row of the constraint A, A u = 0: --block="1,0,0". May be given several times.',
)
@click.option(
    "--goal",
    type=Numbers(),
    help="Where the goal is, for a policy learnt with --relative-to goal; for one that is relative to columns, what "
    "those would hold.",
)
@click.option(
    "--stop-when-unsure",
    type=Number(),
    help="End where the policy's standard deviation exceeds this share of its speed: 0.5, say.",
)
@outputs.out("rollout.csv", "Where the movement is written (CSV).")
@outputs.figure("Where it is drawn", "rollout.png")
@outputs.overwrite
def rollout(
    policy: Path,
    start: list[float],
    steps: int,
    dt: float,
    block: tuple[list[float], ...],
    goal: list[float] | None,
    stop_when_unsure: float | None,
    out: Path,
    figure: Path,
    overwrite: bool,
) -> None:
    """Integrate a saved policy from a start, free or under a constraint.

    POLICY was saved by `unconstrain fit`.
    """
    outputs.check_outputs([policy], {"out": out, "figure": figure}, overwrite=overwrite)
    from unconstrain import plot
    from unconstrain.policies import load_policy
    from unconstrain.policies.unsure import Unsure
    from unconstrain.recordings.text import write_csv
    from unconstrain.simulation import rollout as integrate

    learnt = load_policy(policy)
    _check_length(start, "start=", learnt.n_features_in_, "states")
    for row in block:
        _check_length(row, "block=", learnt.n_actions_, "actions")
    origin = _find_origin(learnt, start, goal)
    unsure = None if stop_when_unsure is None else Unsure(learnt, stop_when_unsure)
    with working("rolling out"):
        inside = [at - zero for at, zero in zip(start, origin, strict=True)]
        movement = integrate(learnt, inside, steps, dt, list(block) or None, stop_when=unsure)
    taken = len(movement) - 1
    if unsure is not None and taken == 0:
        raise DataError(
            f"at the start already {_unsure_at(unsure, movement.states[0])}: start nearer to the recordings, or give a "
            "larger share to stop_when_unsure="
        )
    last = movement.states[-1]  # as the policy has it
    movement = replace(movement, states=movement.states + origin)
    write_csv(movement, out)
    plot.save(plot.rollout_figure(movement), figure)
    end = zip(movement.state_names, movement.states[-1], movement.states.std(axis=0), strict=True)
    reached = ", ".join(f"{name} {reporting.shown_number(value, scale)}" for name, value, scale in end)
    reporting.say(f"after {taken * dt:g} s: {reached}")
    if unsure is not None and taken < steps:
        reporting.say(f"stopped after {taken} of {steps} steps: {_unsure_at(unsure, last)}")
    reporting.say(f"movement: {out}\nfigure: {figure}")


def _find_origin(learnt: "Policy", start: list[float], goal: list[float] | None) -> list[float]:
    """Return what the states of the policy are relative to, as states (n,): zeros where they are not."""
    recording = getattr(learnt, "recording_", None)
    columns, preparation = recording if recording is not None else (None, None)
    to = None if columns is None else columns.relative_to
    if goal is not None:
        if to is None or to == START:
            raise DataError("goal= is for a policy learnt relative to a goal or to columns; leave it out")
        _check_length(goal, "goal=", learnt.n_features_in_, "states")
        return goal
    if to == START:
        return start
    if to is not None:
        raise DataError(
            "the policy was learnt relative to a goal or to columns: say where that is with goal=, one number a state"
        )
    if preparation is not None and preparation.moving_centre is not None:
        reporting.say("note: start and movement are relative to the moving centre")
    return [0.0] * len(start)


def _check_length(numbers: list[float], option: str, wanted: int, of: str) -> None:
    if len(numbers) != wanted:
        raise DataError(f"{option} must have {wanted} numbers, as the policy has {of}, got {len(numbers)}")


def _unsure_at(unsure: "Unsure", state: "np.ndarray") -> str:
    deviation, speed = unsure.measure(state[None])
    return (
        f"the policy is known to within ±{deviation[0]:.3g} only, more than {unsure.share:g} of its speed, "
        f"{speed[0]:.3g}"
    )
