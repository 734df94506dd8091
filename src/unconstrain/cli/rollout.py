"""`unconstrain rollout`: where a policy leads, free or under a constraint."""

import math
import warnings
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from unconstrain.cli import limiting, outputs, reporting, stabilizing, trusting
from unconstrain.cli.command import command, in_words_of_program
from unconstrain.cli.declared import Number, Numbers
from unconstrain.errors import DataError
from unconstrain.progress import working
from unconstrain.recordings.columns import START

STOPPED = 3
"""The exit code where a movement had to stop: its file holds what was reached."""

ANYWHERE = "anywhere"

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from unconstrain.demonstrations import Demonstrations
    from unconstrain.policies.base import Policy
    from unconstrain.policies.unsure import Unsure
    from unconstrain.spaces import Space
    from unconstrain.spaces.frames import Frame


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
    "--constraint",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="A constraint that `unconstrain constraints` saved, under which it moves.",
)
@click.option(
    "--goal",
    type=Numbers(),
    help="Where the goal is, for a policy learnt with --relative-to goal; for one that is relative to columns, what "
    "those would hold.",
)
@stabilizing.stable_at(
    'Make the policy end there: a state, "0.1,0.2"; "end" for a policy learnt with --relative-to goal. Actions are '
    "changed as little as that takes. A policy fitted with --stable-at does so without this, or goes round its cycle."
)
@click.option(
    "--stop-when-unsure",
    type=Number(),
    help="Stop where the policy's standard deviation exceeds this share of its speed, and of the recordings' usual "
    "speed: 0.5, say.",
)
@click.option(
    "--beyond",
    type=Number(words=(ANYWHERE,)),
    help="How far from recorded states the movement may lead before it stops, in widths of receptive fields (without "
    f'these in half-spreads of the states), or "{ANYWHERE}"; by default as far as recordings lead from each other, at '
    "least 1. A stable policy may lead anywhere, since it comes back.",
)
@click.option(
    "--limits",
    type=limiting.LimitsType(),
    help='Stop before a state leaves its limits: "-1:1,0:2" for each, "x=-1:1" by name, or the file of a robot (URDF, '
    "MJCF), for its joints.",
)
@outputs.out("rollout.csv", "Where the movement is written (CSV).")
@outputs.figure("Where it is drawn", "rollout.png")
@outputs.overwrite
@trusting.trusted
def rollout(
    policy: Path,
    start: list[float],
    steps: int,
    dt: float,
    block: tuple[list[float], ...],
    constraint: Path | None,
    goal: list[float] | None,
    stable_at: list[float] | str | None,
    stop_when_unsure: float | None,
    beyond: float | str | None,
    limits: Any,
    out: Path,
    figure: Path,
    overwrite: bool,
    trusted: tuple[str, ...],
) -> None:
    """Integrate a saved policy from a start, free or under a constraint.

    POLICY was saved by `unconstrain fit`. A movement that leaves what was recorded, or its limits, or diverges, stops
    there: what was reached is written, and the exit code is 3.
    """
    read = [policy] if constraint is None else [policy, constraint]
    outputs.check_outputs(read, {"out": out, "figure": figure}, overwrite=overwrite)
    import numpy as np

    from unconstrain import plot
    from unconstrain.plot import figures
    from unconstrain.policies.unsure import Unsure
    from unconstrain.recordings.text import write_csv
    from unconstrain.simulation import rollout as integrate
    from unconstrain.stopping import Limits, MovementStopped, Stop, describe_stop

    learnt = trusting.load(policy, trusted)
    begin = _completed(start, "start=", learnt.space_)
    for row in block:
        _check_length(row, "block=", learnt.n_actions_, "actions")
    frame = _find_frame(learnt, begin, goal)
    if stable_at is not None:
        learnt = _stabilize(learnt, stable_at, frame)
    unsure = None if stop_when_unsure is None else Unsure(learnt, stop_when_unsure)
    rows = np.array(block).reshape(-1, learnt.n_actions_)
    names = getattr(learnt, "state_names_", [f"x{i + 1}" for i in range(len(begin))])
    held = None
    if limits is not None:
        held = Limits(limiting.read_limits(limits, names), names, None if frame is None else frame.out_of)
    if frame is not None:
        begin, rows = frame.into(begin[None])[0], frame.constraint_into(rows)
    barred: Any = rows if len(rows) else None
    if constraint is not None:
        barred = _constrain(learnt, constraint, rows, frame)
    if unsure is not None and unsure.starting_at(begin):
        known = _unsure_at(unsure, begin)
        reporting.say(f"note: at the start, as it was recorded, {known}; it may not become less sure")
    with working("rolling out"), warnings.catch_warnings():
        warnings.simplefilter("ignore", MovementStopped)  # which is said below
        movement = integrate(
            *(learnt, begin, steps, dt, barred),
            stop_when=unsure,
            beyond=math.inf if isinstance(beyond, str) else beyond,
            limits=held,
        )
    taken = len(movement) - 1
    stop = movement.stopped[0] if movement.stopped else None
    if unsure is not None and taken == 0 and stop is None:
        raise DataError(
            f"at the start already {_unsure_at(unsure, movement.states[0])}: start nearer to the recordings, or give a "
            "larger share to stop_when_unsure="
        )
    last = movement.states[-1]  # as the policy has it
    arrival = None if learnt.stability_ is None else stabilizing.describe_arrival(learnt, movement)
    shown = movement if frame is None else _out_of(frame, movement)
    write_csv(shown, out)
    plot.save(figures.draw_rollout(shown), figure)
    end = zip(shown.state_names, shown.states[-1], shown.states.std(axis=0), strict=True)
    reached = ", ".join(f"{name} {reporting.shown_number(value, scale)}" for name, value, scale in end)
    reporting.say(f"after {taken * dt:g} s: {reached}")
    _describe_phase(movement, dt)
    if arrival is not None:
        reporting.say(arrival)
    if stop is None and unsure is not None and taken < steps:
        stop = Stop(0, taken, taken * dt, last, _unsure_at(unsure, last))
    if stop is not None:
        sentence = describe_stop(stop, steps, shown.state_names, shown.states[-1])
        reporting.say(in_words_of_program(sentence))
    reporting.say(f"movement: {out}\nfigure: {figure}")
    if stop is not None:
        click.get_current_context().exit(STOPPED)


def _constrain(
    learnt: "Policy", path: Path, rows: "np.ndarray", frame: "Frame | None"
) -> "Callable[[np.ndarray], np.ndarray]":
    """Make a function of states of the rows of a constraint in a file, and of those that hold everywhere."""
    import numpy as np

    from unconstrain.constraints.learnt import load_constraint

    known = load_constraint(path)
    n, d = known.n_features_in_, known.n_actions_
    if (n, d) != (learnt.n_features_in_, learnt.n_actions_):
        raise DataError(
            f"the constraint is over {n} states and {d} actions, and the policy over {learnt.n_features_in_} and "
            f"{learnt.n_actions_}: learn it from the same columns"
        )
    if frame is not None and not frame.space.is_flat:
        raise DataError(
            "constraint= is for states of which none is a rotation, or a policy that is relative to nothing"
        )

    def rows_at(X: np.ndarray) -> np.ndarray:
        own = known.rows(X if frame is None else frame.out_of(X))
        return np.concatenate([own, np.broadcast_to(rows, (len(X), *rows.shape))], axis=1)

    return rows_at


def _stabilize(learnt: "Policy", goal: list[float] | str, frame: "Frame | None") -> "Policy":
    """Make the policy end at a goal that is given as starts are."""
    import numpy as np

    if not isinstance(goal, str) and frame is not None and len(goal) == learnt.space_.n_states:
        goal = frame.into(np.array([goal]))[0].tolist()
    recording = getattr(learnt, "recording_", None)
    stable = stabilizing.stabilize(learnt, goal, None if recording is None else recording[0])
    stabilizing.describe(stable)
    return stable


def _find_frame(learnt: "Policy", start: "np.ndarray", goal: list[float] | None) -> "Frame | None":
    """Return what the states of the policy are relative to; None where they are not."""
    from unconstrain.spaces.frames import Frame, takes_frame

    space = learnt.space_
    recording = getattr(learnt, "recording_", None)
    columns, preparation = recording if recording is not None else (None, None)
    to = None if columns is None else columns.relative_to
    if goal is not None:
        if to is None or to == START:
            raise DataError("goal= is for a policy learnt relative to a goal or to columns; leave it out")
        return Frame(
            space, tuple(goal if takes_frame(space, len(goal)) else _completed(goal, "goal=", space))
        )
    if to == START:
        return Frame(space, tuple(space.at_rest(start)))
    if to is not None:
        raise DataError(
            "the policy was learnt relative to a goal or to columns: say where that is with goal=, one number a state"
        )
    if preparation is not None and preparation.moving_centre is not None:
        reporting.say("note: start and movement are relative to the moving centre")
    return None


def _out_of(frame: "Frame", movement: "Demonstrations") -> "Demonstrations":
    """Express a movement outside of the frame that the policy has it in."""
    wanted = movement.policy
    return replace(
        movement,
        states=frame.space.follow(frame.out_of(movement.states)),
        actions=frame.velocities_out_of(movement.actions),
        policy=None if wanted is None else frame.velocities_out_of(wanted),
        projections=None,  # which files of text do not hold
    )


def _describe_phase(movement: "Demonstrations", dt: float) -> None:
    """Say when the recorded movements would have ended, if they have a phase and the rollout goes on after that."""
    from unconstrain.spaces import Phased

    over = int((movement.states[:, -1] < 1.0).sum())
    if isinstance(movement.space, Phased) and over + 1 < len(movement):
        reporting.say(
            f"note: the recorded movements end at phase 1, here after {over * dt:g} s, and then the policy acts "
            f"as at their end; --steps {max(over, 1)} stops there"
        )


def _completed(numbers: list[float], option: str, space: "Space") -> "np.ndarray":
    """Check the numbers of a state; one without the velocity that belongs to it is at rest."""
    import numpy as np

    if len(numbers) != space.n_places:
        _check_length(numbers, option, space.n_states, "states")
    state = np.array(numbers) if len(numbers) == space.n_states else space.at_rest(np.array(numbers))
    if space.faults(state[None]).any():
        raise DataError(f"{option} is none of these: {space.words}")
    return state


def _check_length(numbers: list[float], option: str, wanted: int, of: str) -> None:
    if len(numbers) != wanted:
        raise DataError(f"{option} must have {wanted} numbers, as the policy has {of}, got {len(numbers)}")


def _unsure_at(unsure: "Unsure", state: "np.ndarray") -> str:
    deviation, speed = unsure.measure(state[None])
    return (
        f"the policy is known to within ±{deviation[0]:.3g} only, more than {unsure.share:g} of its speed, "
        f"{speed[0]:.3g}"
    )
