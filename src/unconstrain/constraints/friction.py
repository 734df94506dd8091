"""The part of a contact force that lies along the motion: friction, which does work, and constrains nothing."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.arrays import check_actions
from unconstrain.errors import DataError

Array = NDArray[np.float64]

SLOW = 0.1
"""Below this share of its episode's root mean square speed the direction of motion is noise; friction is left in."""


def directions_of_motion(
    actions: ArrayLike, F: Array, jacobian: Array | None, episodes: list[NDArray[np.intp]]
) -> Array:
    """Find the directions in which the point that is touched moves.

    Parameters
    ----------
    actions : array_like of shape (N, d)
        Actions.
    F : ndarray of shape (N, m)
        Forces, whose components the directions have.
    jacobian : ndarray of shape (N, m, d), or None
        From actions to the velocity of the point; None where the action is that velocity.
    episodes : list of ndarray of int
        Rows of each episode.

    Returns
    -------
    ndarray of shape (N, m)
        Unit vectors, zero where the point hardly moves.

    Raises
    ------
    DataError
        If shapes do not match.
    """
    U = check_actions(actions)
    if len(U) != len(F):
        raise DataError(f"there are {len(F)} forces and {len(U)} actions: give one force a sample")
    if jacobian is not None and U.shape[1] != jacobian.shape[2]:
        raise DataError(f"the Jacobian is over {jacobian.shape[2]} actions, but there are {U.shape[1]}")
    velocity = U if jacobian is None else np.einsum("nij,nj->ni", jacobian, U)
    if velocity.shape != F.shape:
        raise DataError(
            f"forces have {F.shape[1]} components and actions {velocity.shape[1:]} dimensions: give the components of "
            "the force along the actions, or the Jacobian that leads from one to the other"
        )
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    moves = np.empty_like(speed, dtype=bool)
    for own in episodes:
        moves[own] = speed[own] > SLOW * np.sqrt(np.mean(speed[own] ** 2))
    return np.divide(velocity, speed, out=np.zeros_like(velocity), where=moves)


def remove_along(F: Array, along: Array) -> Array:
    """Remove from forces what lies along given directions.

    Parameters
    ----------
    F : ndarray of shape (N, m)
        Forces.
    along : ndarray of shape (N, m)
        Unit vectors, or zero where nothing is to be removed.

    Returns
    -------
    ndarray of shape (N, m)
        The forces at right angles to them.
    """
    return F - np.einsum("nm,nm->n", F, along)[:, None] * along
