"""A policy made to end at a goal, or to go round and round: which goal, and where it was learnt."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from unconstrain.arrays import check_number, check_numbers, check_states, quote
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, PolicyError
from unconstrain.spaces import Space
from unconstrain.stability import Cycle, Stability

if TYPE_CHECKING:
    from unconstrain.policies.base import Policy

END = "end"
"""What a goal may be besides a state: the mean of where episodes end."""

CYCLE = "cycle"
"""What a goal may be for movements that go round and round."""

HOLD = 0.02
"""For how many seconds an action is held where recordings do not say."""

UNCHANGED = 1e-9
"""Share of an action's length below which a change of it is rounding."""

LONGEST_HOLD = 1e6
"""Seconds."""

MEAN_PASSES = 10
"""Of the mean of states that are no plain numbers; each takes off all but the square of what is left."""


def learn_stability(
    policy: "Policy", goal: Any, demos: "Demonstrations | ArrayLike | None", hold: float | None
) -> Stability | Cycle:
    """Learn what makes a policy end at a goal.

    Parameters
    ----------
    policy : Policy
        Fitted, not stabilised.
    goal : array_like of shape (n,), "end" or "cycle"
        Where movements end.
    demos : Demonstrations, array_like of shape (N, n), or None
        The recorded region; None for the policy's own centres.
    hold : float or None
        The longest time for which an action is held, in seconds.

    Returns
    -------
    Stability or Cycle
        For this goal.

    Raises
    ------
    DataError, PolicyError
        As for `Policy.stabilized`.
    """
    space = policy.space_
    if isinstance(goal, str) and goal == CYCLE:
        return _learn_cycle(policy, demos, hold)
    X = _find_centers(policy) if demos is None else _find_states(policy, demos)
    if isinstance(goal, str):
        if goal != END:
            raise DataError(
                f'a goal is a state, "end" for the mean of where episodes end, or "cycle", not {quote(goal)}'
            )
        if not isinstance(demos, Demonstrations):
            raise DataError(
                'the goal "end" is where the episodes of demonstrations end: give these too, or a state'
            )
        at, apart = find_end(demos, space, policy.scale_)
    else:
        at, apart = _check_goal(goal, space), None
    hold = _check_hold(demos, hold)
    U = np.reshape(policy.predict(X), (len(X), -1))
    stability = Stability.learn(space, at, policy.scale_, X, U, hold)
    notes = [_describe_change(stability, X, U, "lead towards the goal")]
    if apart is not None and isinstance(demos, Demonstrations):
        notes.insert(0, _describe_end(demos.n_episodes, apart, stability.extent))
    return replace(stability, notes=tuple(notes))


def _learn_cycle(policy: "Policy", demos: Any, hold: float | None) -> Cycle:
    """Learn what makes a policy go round and round."""
    if not isinstance(demos, Demonstrations) or demos.time is None:
        raise DataError(
            "a cycle is found in demonstrations with their times, so a policy is put on one where it is fitted: "
            '`unconstrain fit --stable-at cycle --time ...`, in Python policy.stabilized("cycle", demos)'
        )
    X = _find_states(policy, demos)
    hold = _check_hold(demos, hold)
    cycle = Cycle.learn(policy.space_, policy.scale_, X, demos.episodes, demos.time, hold)
    U = np.reshape(policy.predict(X), (len(X), -1))
    return replace(cycle, notes=(*cycle.notes, _describe_change(cycle, X, U, "keep to the cycle")))


def _check_hold(demos: Any, hold: float | None) -> float:
    if hold is None:
        hold = _find_step(demos) if isinstance(demos, Demonstrations) else HOLD
    hold = check_number(hold, "hold", positive=True)
    if hold > LONGEST_HOLD:
        raise PolicyError(f"hold must be at most {LONGEST_HOLD:g} seconds, got {hold:g}")
    return hold


def _describe_end(episodes: int, apart: float, extent: float) -> str:
    if episodes == 1:
        return "the goal is where the one episode ends"
    return (
        f"the goal is the mean of where the {episodes} episodes end; the farthest of them ends {apart:.3g} from it, "
        f"{apart / extent:.1%} of the extent of the recorded states"
    )


def _describe_change(stability: Stability | Cycle, X: np.ndarray, U: np.ndarray, how: str) -> str:
    """Say by how much actions (N, d) in the recorded region are changed."""
    changed = (stability.stabilize(X, U) - U) / stability.scale
    stays = float(
        np.mean(np.linalg.norm(changed, axis=1) <= UNCHANGED * np.linalg.norm(U / stability.scale, axis=1))
    )
    change, speed = (float(np.sqrt(np.mean(np.sum(A**2, axis=1)))) for A in (changed, U / stability.scale))
    share = f", {change / speed:.2g} of their usual length" if speed else ""
    return (
        f"in the recorded region {stays:.0%} of the actions {how} as they are; all together are "
        f"changed by {change:.3g} (root mean square){share}"
    )


def find_end(demos: Demonstrations, space: Space, scale: np.ndarray) -> tuple[np.ndarray, float]:
    """Find the mean of where episodes end.

    Parameters
    ----------
    demos : Demonstrations
        With n states.
    space : Space
        That these belong to.
    scale : ndarray of shape (d,)
        What a length of one is along each action.

    Returns
    -------
    end : ndarray of shape (n,)
        The mean.
    apart : float
        How far the farthest of them is from it, in units of the scale.
    """
    last = np.flatnonzero(np.append(demos.episodes[1:] != demos.episodes[:-1], True))
    ends = demos.states[last]
    mean = ends[:1]
    for _ in range(1 if space.is_flat else MEAN_PASSES):
        away = space.difference(np.repeat(mean, len(ends), axis=0), ends)
        mean = space.step(mean, away.mean(axis=0, keepdims=True), 1.0)
    away = space.difference(np.repeat(mean, len(ends), axis=0), ends)
    return mean[0], float(np.linalg.norm(away / scale, axis=1).max())


def _find_states(policy: "Policy", demos: "Demonstrations | ArrayLike") -> np.ndarray:
    X = check_states(policy, demos.states if isinstance(demos, Demonstrations) else demos)
    if policy.space_.faults(X).any():
        raise DataError(f"some states are none of these: {policy.space_.words}")
    return X


def _find_centers(policy: "Policy") -> np.ndarray:
    """Return the centres that a policy was learnt about, as states."""
    features = getattr(policy.model_, "features", None)
    for holder in (policy, features, getattr(features, "transformer_", None)):
        centers = getattr(holder, "centers_", None)
        if centers is not None:
            found = _from_layout(policy, np.asarray(centers, dtype=np.float64))
            if found is not None:
                return found
    raise PolicyError(
        "this policy does not hold the states that it was learnt over, which say where it has to be made stable: give "
        "the demonstrations, stabilized(goal, demos), or fit with --stable-at on the command line"
    )


def _from_layout(policy: "Policy", Z: np.ndarray) -> np.ndarray | None:
    """Return the states that a space lays out as Z (M, m); None where it lays them out otherwise than as ways there."""
    space, base = policy.space_, getattr(policy.model_, "base", None)
    if space.is_flat:
        return Z
    if base is None or np.isnan(base).any() or Z.shape[1] != space.n_actions:
        return None
    return space.step(np.tile(base, (len(Z), 1)), Z, 1.0)


def _check_goal(goal: Any, space: Space) -> np.ndarray:
    at = np.ravel(check_numbers(goal, "the goal"))
    if at.shape != (space.n_states,):
        raise DataError(
            f"the goal must have {space.n_states} numbers, as the policy has states, got {at.size}"
        )
    if not np.isfinite(at).all():
        raise DataError("the goal has NaN or infinity: give finite numbers")
    if space.faults(at[None]).any():
        raise DataError(f"the goal is none of these: {space.words}")
    return at


def _find_step(demos: Demonstrations) -> float:
    """Return the usual time between samples of an episode."""
    if demos.time is None:
        return HOLD
    steps = np.diff(demos.time)[demos.episodes[1:] == demos.episodes[:-1]]
    steps = steps[steps > 0]
    return float(np.median(steps)) if len(steps) else HOLD
