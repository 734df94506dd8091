"""Which actions move, and in which direction."""

import numpy as np

# An action this much shorter than the longest one is rounding left by a projection that blocked all motion:
# its direction is noise, and would be taught as truth.
NO_MOTION = 1e-12


def lengths(U: np.ndarray) -> np.ndarray:
    """Lengths of actions, in double precision whatever theirs is.

    Parameters
    ----------
    U : array (N, d)

    Returns
    -------
    array (N,)
        `‖u‖`.
    """
    squares = np.einsum("nd,nd->n", U, U, dtype=np.float64)
    return np.sqrt(squares, out=squares)


def moving(U: np.ndarray, scale: float | None = None) -> np.ndarray:
    """Which actions have a direction: those longer than `NO_MOTION` times `scale`.

    Parameters
    ----------
    U : array (N, d)
    scale : float, optional
        Length of the longest action, in the action's unit, where it is known from elsewhere. By default that of U.

    Returns
    -------
    array (N,) of bool
    """
    r = lengths(U)
    return r > NO_MOTION * (r.max(initial=0.0) if scale is None else scale)


def directions(U: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions and lengths of actions.

    Parameters
    ----------
    U : array (N, d)

    Returns
    -------
    unit : array (N, d)
        `û`, zero where an action does not move.
    r : array (N,)
        `‖u‖`, zero where an action does not move.
    """
    r = lengths(U)
    r[r <= NO_MOTION * r.max(initial=0.0)] = 0.0
    inverse = np.divide(1.0, r, out=np.zeros_like(r), where=r > 0)
    return U * inverse[:, None], r
