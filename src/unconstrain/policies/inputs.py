"""What `fit` and its relatives accept in place of states and actions."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from unconstrain.arrays import (
    check_actions,
    check_groups,
    check_numbers,
    check_projections,
    check_samples,
    check_weights,
)
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, PolicyError
from unconstrain.samples import Samples

if TYPE_CHECKING:
    from unconstrain.policies.base import Policy


def unpack_demonstrations(
    X: ArrayLike | Demonstrations,
    U: ArrayLike | None,
    groups: ArrayLike | None,
    projections: ArrayLike | None,
) -> tuple[ArrayLike, ArrayLike | None, ArrayLike | None, ArrayLike | None]:
    """Replace Demonstrations by the arrays they hold, and leave other arguments as they are.

    Parameters
    ----------
    X : array_like of shape (N, n), or Demonstrations
        States.
    U : array_like of shape (N, d), optional
        Actions; None beside Demonstrations.
    groups : array_like of shape (N,), optional
        Episodes; by default those of the demonstrations, or five blocks of a single one, in whose order of time contact
        is inferred.
    projections : array_like of shape (N, d, d), optional
        Nullspace projections; by default those that the demonstrations know.

    Returns
    -------
    X : array_like
        States.
    U : array_like or None
        Actions.
    groups : array_like or None
        Episodes.
    projections : array_like or None
        Nullspace projections.

    Raises
    ------
    DataError
        Actions are given beside demonstrations.
    """
    if not isinstance(X, Demonstrations):
        return X, U, groups, projections
    if U is not None:
        raise DataError(
            "demonstrations bring their own actions: give the demonstrations alone, or states and actions"
        )
    if groups is None:
        groups = X.folds()
    return X.states, X.actions, groups, X.projections if projections is None else projections


def as_demonstrations(
    demos: ArrayLike | Demonstrations,
    U: ArrayLike | None,
    groups: ArrayLike | None,
    *,
    actions_needed: bool = True,
) -> Demonstrations:
    """Make demonstrations of states and actions, where they are none yet.

    Parameters
    ----------
    demos : Demonstrations, or array_like of shape (N, n)
        Recordings, or their states.
    U : array_like of shape (N, d) or (N,), optional
        Actions; None beside demonstrations.
    groups : array_like of shape (N,), optional
        Episodes, beside states.
    actions_needed : bool
        Whether states alone will not do; if they do, actions that are not given are zero.

    Returns
    -------
    Demonstrations
        Those given, or new ones.

    Raises
    ------
    DataError
        Actions or episodes are given beside demonstrations, actions are missing, or the arrays cannot be used.
    """
    if isinstance(demos, Demonstrations):
        if U is not None or groups is not None:
            raise DataError(
                "demonstrations bring their own actions and episodes: give the demonstrations alone, or states and "
                "actions"
            )
        return demos
    states = check_numbers(demos, "states")
    if U is None:
        if actions_needed:
            raise DataError("give the actions beside the states, X and U, or demonstrations in place of both")
        U = np.zeros(states.shape)
    actions = check_numbers(U, "actions")
    return Demonstrations(states, actions[:, None] if actions.ndim == 1 else actions, groups)


def check_input(
    policy: "Policy", X: Any, y: Any, groups: Any, sample_weight: Any, projections: Any, *, first: bool
) -> tuple[Samples, bool]:
    """Check what `fit` was given.

    Parameters
    ----------
    policy : Policy
        Its number of states is stored where `first`.
    X, y, groups, sample_weight, projections : as for `Policy.fit`
        As the user gives them.
    first : bool
        Whether these are the first samples; further ones have to fit them.

    Returns
    -------
    samples : Samples
        Finite, in double precision, of dimensions that go together.
    scalars : bool
        Whether the actions are of shape (N,).

    Raises
    ------
    DataError
        Arrays are not finite or do not fit together.
    PolicyError
        Projections are given for the direct risk.
    """
    policy.check_options()
    asked = projections
    X, y, groups, projections = unpack_demonstrations(X, y, groups, projections)
    if policy.risk == "direct":  # has no use for projections that come along with demonstrations
        projections = asked
    X, y = check_samples(policy, X, y, reset=first, min_samples=2 if first else 1)
    U = check_actions(y)
    if not first and U.shape[1] != policy.n_actions_:
        raise DataError(
            f"actions have {U.shape[1]} dimensions, but this policy has learnt {policy.n_actions_}"
        )
    if projections is not None:
        if policy.risk == "direct":
            raise PolicyError(
                'projections= are for the other risks, and this policy has risk="direct", which looks at the '
                "whole action"
            )
        projections = check_projections(projections, *U.shape, unknown=True)
    weights = None if sample_weight is None else check_weights(sample_weight, X)
    return Samples(X, U, check_groups(groups, len(X)), projections, weights), np.ndim(y) == 1
