"""Where a policy leads from where recordings began."""

from dataclasses import dataclass

import numpy as np

from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import UnconstrainError
from unconstrain.policies.base import Policy

MOST_STARTS, MOST_STEPS = 20, 3000

ROOM = 0.5
"""How far beyond the recorded states a movement may go, in widths of what was recorded, before it has left them."""

FAR = 10.0
"""The same from which on it is said to diverge."""


@dataclass(frozen=True)
class Following:
    """Free movements from recorded starts, as long as the recordings.

    Parameters
    ----------
    n_starts : int
        How many.
    n_left : int
        How many of them leave what was recorded.
    n_diverged : int
        How many of these go far beyond.
    first_left : float
        Seconds after which the first leaves; NaN where none does.
    """

    n_starts: int
    n_left: int
    n_diverged: int
    first_left: float


def follow(policy: Policy, demos: Demonstrations) -> Following | None:
    """Roll a policy out from the first state of episodes, each as long as it was recorded.

    Parameters
    ----------
    policy : Policy
        Fitted.
    demos : Demonstrations
        Recordings, of which the first 20 episodes are followed.

    Returns
    -------
    Following or None
        None where recordings have no time, or actions are not velocities of the states.
    """
    if demos.time is None or policy.n_actions_ != policy.space_.n_actions or len(demos) < 2:
        return None
    firsts = np.flatnonzero(np.diff(demos.episodes, prepend=-1))[:MOST_STARTS]
    lasts = np.append(np.flatnonzero(np.diff(demos.episodes)), len(demos) - 1)[: len(firsts)]
    durations = demos.time[lasts] - demos.time[firsts]
    within = np.diff(demos.time)[np.diff(demos.episodes) == 0]
    if not (len(within) and durations.max() > 0):
        return None
    dt = max(float(np.median(within)), float(durations.max()) / MOST_STEPS)
    steps = max(1, round(float(durations.max()) / dt))
    space = policy.space_
    base = None if space.is_flat else space.find_base(demos.states)

    def lay_out(X: np.ndarray) -> np.ndarray:
        return X if space.is_flat else space.embed(X, base)

    recorded = lay_out(demos.states)
    low, high = recorded.min(axis=0), recorded.max(axis=0)
    size = np.where(high > low, high - low, 1.0)

    def measure(X: np.ndarray) -> np.ndarray:
        Z = lay_out(X)
        return np.max(np.maximum(low - Z, Z - high) / size, axis=1)

    left, diverged, first = 0, 0, np.inf
    for start, duration in zip(demos.states[firsts], durations, strict=True):
        try:
            movement = policy.rollout(start, steps, dt, stop_when=lambda X: bool(np.any(measure(X) > FAR)))
            beyond = measure(movement.states[: 2 + round(float(duration) / dt)])
        except UnconstrainError:  # beyond all numbers
            beyond = np.array([np.inf])
        if beyond.max() > ROOM:
            left += 1
            diverged += int(beyond.max() > FAR)
            first = min(first, dt * float(np.argmax(beyond > ROOM)))
    return Following(len(firsts), left, diverged, first if left else np.nan)
