"""What is found out of a policy, for a verdict."""

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np

from unconstrain.demonstrations import Demonstrations
from unconstrain.evaluation.alternatives import Alternative, choose_missing, try_alternatives
from unconstrain.evaluation.fixed import find_fixed
from unconstrain.evaluation.following import Following, find_remedy, follow
from unconstrain.evaluation.scores import Score
from unconstrain.judging import Judge
from unconstrain.policies.base import Policy
from unconstrain.policies.inferred import is_in_doubt
from unconstrain.stability import Stability

KNOWN = 0.5
"""Share of samples whose constraint is known, from which on the constraint is not one that varies."""

WELL = 0.9
"""Share explained of what was held out from which on nothing seems to be missing."""


@dataclass(frozen=True)
class Findings:
    """What a verdict is based on.

    Parameters
    ----------
    n_samples : int
        How many samples that is based on.
    explained, regression : float
        Share explained of what held-out recordings show, by the policy and by ordinary regression; NaN where nothing
        moves or it is not known.
    held_out : str
        What they are, in words: "held-out episodes", "these recordings".
    typical : float
        The same of the policy, of the middle one of the episodes; NaN where there is one alone.
    free : float or None
        Share of samples inferred to be free; None where it was not inferred.
    known : float
        Share of samples whose constraint was known, and not inferred.
    is_kinematic : bool
        Whether actions are velocities, or accelerations, of the states.
    has_time : bool
        Whether it is known when samples were taken.
    is_regression : bool
        Whether the policy's risk is "direct".
    in_doubt : bool
        Whether constraints are likely that the model is too coarse to tell.
    fixed : tuple of str
        Equations that all motion obeys.
    n_actions : int
        How many actions there are, d.
    tried : tuple of Alternative
        What was tried in place of the position alone.
    missing : Alternative or None
        The one that explains the motion better by far.
    determined : float or None
        Share of the policy that the recordings determine; None where it was not looked at.
    following : Following or None
        Where it leads from recorded starts.
    remedy : str
        What keeps the movement where it was recorded, where it leaves that.
    goal_distance : float
        How far the goal of a stabilised policy lies from what was recorded, in units of how far movements may lead.
    """

    n_samples: int
    explained: float
    regression: float
    held_out: str
    typical: float = math.nan
    free: float | None = None
    known: float = 0.0
    is_kinematic: bool = True
    has_time: bool = True
    is_regression: bool = False
    in_doubt: bool = False
    fixed: tuple[str, ...] = ()
    n_actions: int = 1
    tried: tuple[Alternative, ...] = ()
    missing: Alternative | None = None
    determined: float | None = None
    following: Following | None = None
    remedy: str = ""
    goal_distance: float = 0.0


def collect(
    policy: Policy,
    demos: Demonstrations,
    held_out: str,
    *,
    judge: Judge,
    own: Score,
    regression: Score | None,
    typical: float,
    free: float | None,
    determined: float | None = None,
    without: Collection[str] = (),
    progress: Callable[[str], None] | None = None,
) -> Findings:
    """Find out what a verdict is based on.

    Parameters
    ----------
    policy : Policy
        Fitted.
    demos : Demonstrations
        Recordings that were held out, in whatever way.
    held_out : str
        What they are, in words.
    judge : Judge
        That they were scored by.
    own, regression : Score
        Of the policy, and of ordinary regression, if that could be fitted.
    typical : float
        See `scores.find_typical`.
    free : float or None
        Share of samples inferred to be free; None where it was not inferred.
    determined : float or None
        Share of the policy that the recordings determine; None where it was not looked at.
    without : collection of str
        Options that the recordings were read with, which are not tried as what is missing.
    progress : callable, optional
        Called with what is being done.

    Returns
    -------
    Findings
        Of this policy.
    """
    rival = math.nan if regression is None else regression.shown
    best = max((each for each in (own.shown, rival) if not math.isnan(each)), default=math.nan)
    tried = []
    if best < WELL and not typical >= WELL:
        tried = try_alternatives(policy, demos, without=without, progress=progress)
    if progress is not None:
        progress("following it from recorded starts")
    known = _share_known(judge)
    # Freely, a policy that was told its constraints leads where these never let it.
    following = follow(policy, demos) if known < KNOWN else None
    return Findings(
        n_samples=len(demos),
        explained=own.shown,
        regression=rival,
        held_out=held_out,
        free=free,
        typical=typical,
        known=known,
        is_kinematic=policy.n_actions_ == policy.space_.n_actions,
        has_time=demos.time is not None,
        is_regression=policy.risk == "direct",
        in_doubt=is_in_doubt(policy),
        fixed=find_fixed(demos, policy.scale_),
        n_actions=policy.n_actions_,
        tried=tuple(tried),
        missing=choose_missing(best, tried),
        determined=determined,
        following=following,
        remedy=find_remedy(policy, demos) if following is not None and following.n_stopped else "",
        goal_distance=_measure_goal(policy),
    )


def _share_known(judge: Judge) -> float:
    """Return the share of samples whose projection is known."""
    if judge.projections is None:
        return 0.0
    return float(np.mean(~np.isnan(judge.projections).any(axis=(1, 2))))


def _measure_goal(policy: Policy) -> float:
    """Return how far the goal of a stabilised policy lies from what was recorded; 0 where it has none."""
    if not isinstance(policy.stability_, Stability):
        return 0.0
    goal = np.atleast_2d(policy.stability_.goal)
    return float(policy.distance(goal)[0]) / max(1.0, policy.usual_distance())
