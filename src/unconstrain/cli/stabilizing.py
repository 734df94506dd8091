"""Policies made to end at a goal: the option for it, and what is said of it."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from unconstrain.cli import reporting
from unconstrain.cli.declared import Numbers, option
from unconstrain.errors import DataError
from unconstrain.recordings.columns import GOAL

if TYPE_CHECKING:
    from unconstrain.demonstrations import Demonstrations
    from unconstrain.policies.base import Policy
    from unconstrain.recordings.columns import Columns
    from unconstrain.stability import Cycle

END, CYCLE = "end", "cycle"

LITTLE_FREEDOM = 0.1
"""Share of the steepest way down below which a constraint is what keeps a movement from the goal."""


def stable_at(help: str, section: str = "Options") -> Callable[[Callable], Callable]:
    """Make the option for the goal that a policy is made to end at."""
    return option("--stable-at", type=Numbers(words=(END, CYCLE)), metavar="GOAL", help=help, section=section)


def stabilize(
    policy: "Policy",
    goal: "list[float] | str",
    columns: "Columns | None",
    demos: "Demonstrations | None" = None,
) -> "Policy":
    """Make a policy end at a goal.

    Parameters
    ----------
    policy : Policy
        Fitted.
    goal : list of float, "end" or "cycle"
        In the states that the policy is over.
    columns : Columns or None
        That it was learnt from.
    demos : Demonstrations, optional
        What it was learnt from.

    Returns
    -------
    Policy
        That ends there.

    Raises
    ------
    DataError
        There are no demonstrations to say where they end, or the goal is no state.
    PolicyError
        As for `Policy.stabilized`.
    """
    if goal == CYCLE:
        return policy.stabilized(goal, demos)
    if goal != END:
        if len(goal) != policy.space_.n_states:
            raise DataError(
                f"stable_at= must have {policy.space_.n_states} numbers, as the policy has states, got {len(goal)}"
            )
        return policy.stabilized(goal, demos)
    if columns is not None and columns.relative_to == GOAL:
        return policy.stabilized(policy.space_.origin, demos)
    if demos is None:
        raise DataError(
            "where the recordings end is not saved with the policy: give the goal in numbers, or fit with "
            "--stable-at end"
        )
    return policy.stabilized(goal, demos)


def describe(stable: "Policy") -> None:
    """Print where a policy is stable, and how far that has changed it."""
    from unconstrain.stability import Cycle

    assert stable.stability_ is not None
    about = "on a cycle about" if isinstance(stable.stability_, Cycle) else "at"
    reporting.say(f"stable {about}: {_describe_goal(stable)}")
    for note in stable.stability_.notes:
        reporting.say(f"note: {note}")


def describe_arrival(stable: "Policy", movement: "Demonstrations") -> str:
    """Say whether a movement, as the policy has it, has reached the goal or how it went round, and if not why.

    Parameters
    ----------
    stable : Policy
        Stabilised.
    movement : Demonstrations
        From one start, with projections where it was constrained.

    Returns
    -------
    str
        A sentence.
    """
    from unconstrain.stability import Cycle
    from unconstrain.stability.stabilizing import ARRIVED

    stability = stable.stability_
    assert stability is not None
    assert movement.time is not None
    if isinstance(stability, Cycle):
        return _describe_turns(stability, movement)
    away = stability.distance(movement.states)
    left = f"{away[-1]:.3g} of the extent of the recorded states"
    if away[-1] <= ARRIVED:
        first = movement.time[len(away) - (away[::-1] > ARRIVED).argmax()] if (away > ARRIVED).any() else 0.0
        return f"the goal is reached after {first:g} s, to within {ARRIVED:g} of the extent of the recorded states"
    if movement.projections is not None:
        freedom = float(stability.freedom(movement.states[-1:], movement.projections[-1:])[0])
        if freedom < LITTLE_FREEDOM:
            return (
                f"the goal cannot be reached under this constraint, which leaves {freedom:.0%} of the way there: the "
                f"movement ends as near as it leads, {left} away"
            )
    return f"the goal is not reached yet, {left} away: give more --steps"


def _describe_turns(cycle: "Cycle", movement: "Demonstrations") -> str:
    import numpy as np

    assert movement.time is not None
    phases = np.unwrap(cycle.phase(movement.states))
    turns = float(phases[-1] - phases[0]) / (2 * np.pi)
    away = float(cycle.distance(movement.states[-1:])[0])
    told = f"the movement goes round {turns:.3g} times"
    if turns >= 1:
        taken = float(movement.time[-1]) / turns
        told += f", once in {taken:.3g} s ({taken / cycle.period:.1%} of the recorded period)"
    return f"{told}, and ends {away:.3g} of the extent of the recorded states from the cycle"


def _describe_goal(stable: "Policy") -> str:
    """Return the goal of a stabilised policy in words."""
    assert stable.stability_ is not None
    goal = stable.stability_.goal
    recording = getattr(stable, "recording_", None)
    if recording is not None and recording[0].relative_to == GOAL and (goal == stable.space_.origin).all():
        return "the goal that states are relative to"
    names = getattr(stable, "state_names_", None)
    if names is None or len(names) != len(goal):
        names = [f"x{i + 1}" for i in range(len(goal))]
    return ", ".join(f"{name} {value:.4g}" for name, value in zip(names, goal, strict=True))
