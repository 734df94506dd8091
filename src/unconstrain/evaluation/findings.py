"""What is found out of a policy, for a verdict."""

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np

from unconstrain.demonstrations import Demonstrations
from unconstrain.evaluation.alternatives import Alternative, choose_missing, find_turn, try_alternatives
from unconstrain.evaluation.fixed import find_fixed
from unconstrain.evaluation.following import Following, follow
from unconstrain.evaluation.scores import Score
from unconstrain.judging import Judge
from unconstrain.policies.base import Policy
from unconstrain.policies.inferred import is_in_doubt

WELL = 0.9
"""Share explained of what was held out from which on nothing seems to be missing."""


@dataclass(frozen=True)
class Findings:
    """What a verdict is based on.

    Parameters
    ----------
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
    is_regression : bool
        Whether the policy is ordinary regression, by its risk or since no constraint was found.
    in_doubt : bool
        Whether constraints are likely that the model is too coarse to tell.
    fixed : tuple of str
        Equations that all motion obeys.
    tried : tuple of Alternative
        What was tried in place of the position alone.
    missing : Alternative or None
        The one that explains the motion better by far.
    determined : float or None
        Share of the policy that the recordings determine; None where it was not looked at.
    following : Following or None
        Where it leads from recorded starts.
    is_stabilized : bool
        Whether the policy is one that ends at its goal.
    repeats : bool
        Whether the movement repeats itself, and has no goal.
    """

    explained: float
    regression: float
    held_out: str
    typical: float = math.nan
    free: float | None = None
    known: float = 0.0
    is_regression: bool = False
    in_doubt: bool = False
    fixed: tuple[str, ...] = ()
    tried: tuple[Alternative, ...] = ()
    missing: Alternative | None = None
    determined: float | None = None
    following: Following | None = None
    is_stabilized: bool = False
    repeats: bool = False


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
    return Findings(
        explained=own.shown,
        regression=rival,
        held_out=held_out,
        free=free,
        typical=typical,
        known=_share_known(judge),
        is_regression=policy.risk == "direct",
        in_doubt=is_in_doubt(policy),
        fixed=find_fixed(demos),
        tried=tuple(tried),
        missing=choose_missing(best, tried),
        determined=determined,
        following=follow(policy, demos),
        is_stabilized=policy.stability_ is not None,
        repeats=demos.time is not None and find_turn(demos) is not None,
    )


def _share_known(judge: Judge) -> float:
    """Return the share of samples whose projection is known."""
    if judge.projections is None:
        return 0.0
    return float(np.mean(~np.isnan(judge.projections).any(axis=(1, 2))))
