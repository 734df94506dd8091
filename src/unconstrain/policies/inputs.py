"""What `fit` and its relatives accept in place of states and actions."""

from numpy.typing import ArrayLike

from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError


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
        Episodes; by default those of the demonstrations where there are several.
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
    if groups is None and X.n_episodes > 1:
        groups = X.episodes
    return X.states, X.actions, groups, X.projections if projections is None else projections
