"""Rows of a state and a direction, `(x, q)`, as kernels take them."""

import numpy as np

from unconstrain.errors import PolicyError

Array = np.ndarray


def split(rows: Array, n_actions: int | None) -> tuple[Array, Array]:
    """Split rows into states and directions.

    Parameters
    ----------
    rows : ndarray of shape (N, n + d)
        Pairs (x, q).
    n_actions : int or None
        Their number d; None for as many as states.

    Returns
    -------
    x, q : ndarray of shape (N, n) and (N, d)
        States and directions.

    Raises
    ------
    PolicyError
        The columns are not as many for states as for actions, though they have to be.
    """
    columns = rows.shape[1]
    if n_actions is None:
        if columns % 2:
            raise PolicyError(
                f"rows of {columns} columns are no states with as many actions: give Separable(kernel, n_actions=...)"
            )
        n_actions = columns // 2
    return rows[:, :-n_actions], rows[:, -n_actions:]


def pair(states: Array, directions: Array) -> Array:
    """Write states and directions side by side, as kernels take them.

    Parameters
    ----------
    states : ndarray of shape (N, n)
        States x.
    directions : ndarray of shape (N, d)
        Directions q.

    Returns
    -------
    ndarray of shape (N, n + d)
        Rows (x, q).
    """
    return np.concatenate([states, directions], axis=1)


def every_direction(states: Array, d: int) -> Array:
    """Write each state beside each axis of the actions.

    Parameters
    ----------
    states : ndarray of shape (N, n)
        States x.
    d : int
        Number of actions.

    Returns
    -------
    ndarray of shape (N d, n + d)
        Rows; those of a state follow each other.
    """
    return pair(np.repeat(states, d, axis=0), np.tile(np.eye(d), (len(states), 1)))
