"""Where a policy leads from where recordings began."""

import warnings
from dataclasses import dataclass

import numpy as np

from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import UnconstrainError
from unconstrain.evaluation.turns import find_turn
from unconstrain.policies.base import Policy
from unconstrain.stopping import MovementStopped

MOST_STARTS, MOST_STEPS = 20, 3000


@dataclass(frozen=True)
class Following:
    """Free movements from recorded starts, as long as the recordings.

    Parameters
    ----------
    n_starts : int
        How many.
    n_stopped : int
        How many of them have to stop, since they leave what was recorded, or diverge.
    first : float
        Seconds after which the first stops; NaN where none does.
    """

    n_starts: int
    n_stopped: int
    first: float


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
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MovementStopped)  # which the verdict says
        movement = policy.rollout(demos.states[firsts], steps, dt)
    stops = [each.time for each in movement.stopped if each.time <= durations[each.episode]]
    return Following(len(firsts), len(stops), min(stops, default=np.nan))


def find_remedy(policy: Policy, demos: Demonstrations) -> str:
    """Find what would keep a policy's movements where they were recorded.

    Parameters
    ----------
    policy : Policy
        Fitted.
    demos : Demonstrations
        What it is followed on.

    Returns
    -------
    str
        An option of `fit`, and what it does; empty where there is none.
    """
    if policy.stability_ is not None:
        return ""
    ways = [("end", "makes it end where episodes do")]
    if demos.time is not None and find_turn(demos) is not None:
        ways.insert(0, ("cycle", "keeps it on its cycle"))
    for to, does in ways:
        try:
            policy.stabilized(to, demos)
        except UnconstrainError:
            continue
        return f"`fit --stable-at {to}` {does}"
    return ""
