"""The function `identifiability`: check recordings, sum them up under a policy's features, and return a report."""

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils.validation import check_is_fitted

from unconstrain.arrays import (
    check_actions,
    check_groups,
    check_lets_through,
    check_number,
    check_projections,
    check_squarable,
    check_states,
    check_weights,
)
from unconstrain.demonstrations import Demonstrations
from unconstrain.diagnostics.information import Information
from unconstrain.diagnostics.report import Identifiability
from unconstrain.diagnostics.spectrum import THRESHOLD
from unconstrain.errors import DataError, PolicyError
from unconstrain.fitting.observation import informative
from unconstrain.motion import moving
from unconstrain.policies.base import Policy
from unconstrain.policies.inputs import unpack_demonstrations
from unconstrain.policies.linear import LinearPolicy
from unconstrain.samples import Samples
from unconstrain.waiting import stage

BOTH_OR_NEITHER = "give states and actions both, or neither: identifiability(policy, X, U)"


@stage("finding what is determined")
def identifiability(
    policy: LinearPolicy,
    X: ArrayLike | Demonstrations | None = None,
    U: ArrayLike | None = None,
    *,
    groups: ArrayLike | None = None,
    sample_weight: ArrayLike | None = None,
    projections: ArrayLike | None = None,
    threshold: float = THRESHOLD,
) -> Identifiability:
    """Report how far recordings determine a policy, where they do not, and what to record next.

    Parameters
    ----------
    policy : LinearPolicy
        Fitted. Its features, centres and parameters are used, its λ is not.
    X : array_like of shape (N, n), or Demonstrations, optional
        Recorded states, usually those that the policy was fitted to. Demonstrations bring their actions, their episodes
        (where there are several) and the projections they know. By default the report is about all that the policy was
        fitted to, by its moments alone (streams, clusters); methods that need the states then raise an error.
    U : array_like of shape (N, d), optional
        Recorded actions.
    groups : array_like of shape (N,), optional
        Episode labels, for `contributions()`.
    sample_weight : array_like of shape (N,), optional
        Weight of each sample, 1 by default.
    projections : array_like of shape (N, d, d), optional
        Nullspace projection of each sample, all NaN where it is not known.
    threshold : float
        A direction of the policy counts as undetermined where a smaller share of it was observed.

    Returns
    -------
    Identifiability
        The report.

    Raises
    ------
    DataError
        The arrays do not fit together or do not fit the policy, or nothing moves.
    PolicyError
        `policy` is not a policy, or its moments alone do not suffice.

    Examples
    --------
    >>> import numpy as np, unconstrain as uc
    >>> X = np.random.default_rng(0).normal(size=(100, 2))
    >>> U = -X * [1.0, 0.0]                                          # never moves along the second axis
    >>> report = uc.identifiability(uc.ParametricPolicy(risk="inconsistency").fit(X, U), X, U)
    >>> report.determined_share
    0.5
    >>> report.unseen_directions(X[:1]).directions[0, 0].round(6).tolist()
    [0.0, 1.0]
    """
    if not isinstance(policy, Policy):
        raise PolicyError(f"identifiability is about a policy of unconstrain, got {type(policy).__name__}")
    if not isinstance(policy, LinearPolicy):
        raise PolicyError(
            "identifiability is about a policy that is linear in its parameters, a ParametricPolicy or a "
            f"LocallyLinearPolicy, got a {type(policy).__name__}: fit one of these to the same recordings"
        )
    check_is_fitted(policy)
    threshold = check_number(threshold, "threshold", positive=True)
    if X is None and U is None:
        return Identifiability(policy, Information.from_fit(policy), threshold)
    if X is None:
        raise DataError(BOTH_OR_NEITHER)
    names = (X.state_names, X.action_names) if isinstance(X, Demonstrations) else (None, None)
    if isinstance(X, Demonstrations) and groups is None and X.n_episodes > 1:
        groups = [X.episode_labels[code] for code in X.episodes]
    states, actions, groups, projections = unpack_demonstrations(X, U, groups, projections)
    if actions is None:
        raise DataError(BOTH_OR_NEITHER)
    samples, n_silent = check_recordings(policy, states, actions, groups, sample_weight, projections)
    return Identifiability(
        policy, Information.from_samples(policy, samples), threshold, samples, n_silent, *names
    )


def check_recordings(
    policy: LinearPolicy,
    X: ArrayLike,
    U: ArrayLike,
    groups: ArrayLike | None = None,
    sample_weight: ArrayLike | None = None,
    projections: ArrayLike | None = None,
) -> tuple[Samples, int]:
    """Check recordings against a policy, and keep the samples that say something of it.

    Parameters
    ----------
    policy : LinearPolicy
        Fitted.
    X : array_like of shape (N, n)
        States.
    U : array_like of shape (N, d)
        Actions.
    groups : array_like of shape (N,), optional
        Episode labels.
    sample_weight : array_like of shape (N,), optional
        Weight of each sample, 1 by default.
    projections : array_like of shape (N, d, d), optional
        Nullspace projection of each sample, all NaN where it is not known.

    Returns
    -------
    samples : Samples
        Those with motion or a known projection, and a weight above zero.
    n_silent : int
        How many others there are.

    Raises
    ------
    DataError
        The arrays do not fit together or do not fit the policy, nothing moves, or a known projection does not let its
        sample's own action through.
    """
    states, actions = check_states(policy, X), check_actions(U)
    check_squarable("the actions U", actions)
    if actions.shape != (len(states), policy.n_actions_):
        raise DataError(
            f"these recordings have {len(states)} states and actions of shape {actions.shape}, and the policy has "
            f"{policy.n_actions_} actions: give one row of them for each state"
        )
    weights, episodes = check_weights(sample_weight, states), check_groups(groups, len(states))
    counted, known = moving(actions), None
    if projections is not None:
        known = check_projections(projections, *actions.shape, unknown=True)
        check_lets_through(known, actions)
        counted |= informative(known)
    counted &= weights > 0
    if not counted.any():
        raise DataError("nothing moves in these recordings, so they say nothing about a policy")
    samples = Samples(
        states[counted],
        actions[counted],
        None if episodes is None else episodes[counted],
        None if known is None else known[counted],
        weights[counted],
    )
    return samples, int(np.count_nonzero(~counted))
