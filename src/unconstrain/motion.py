"""Lengths and directions of actions, and which actions move at all."""

import numpy as np

from unconstrain.arrays import SQUARABLE

NO_MOTION = 1e-12
"""Share of the longest action below which an action is at rest.

So short an action is the rounding that a projection leaves where it blocks all motion: its direction is noise, and a
policy would learn it as truth.
"""


def lengths(U: np.ndarray) -> np.ndarray:
    """Compute the lengths of actions, in double precision whatever theirs is.

    Parameters
    ----------
    U : ndarray of shape (N, d)
        Actions of any magnitude: no length overflows or underflows because a square would.

    Returns
    -------
    ndarray of shape (N,)
        `‖u‖`, in the unit of the actions.
    """
    # A square that overflows shows in the result, so that ordinary actions are looked at only once.
    with np.errstate(over="ignore", under="ignore"):
        squares = np.einsum("nd,nd->n", U, U, dtype=np.float64)
    longest = squares.max(initial=0.0)
    if SQUARABLE**-2 < longest < SQUARABLE**2:
        return np.sqrt(squares, out=squares)
    largest = np.abs(U).max(axis=1, initial=0.0).astype(np.float64)
    shares = np.divide(U, largest[:, None], out=np.zeros(U.shape), where=largest[:, None] > 0)
    return largest * np.sqrt(np.einsum("nd,nd->n", shares, shares))


def root_mean_square(U: np.ndarray) -> float:
    """Compute the root mean square length of actions.

    Parameters
    ----------
    U : ndarray of shape (N, d)
        Actions of any magnitude.

    Returns
    -------
    float
        `√(mean ‖u‖²)`, in the unit of the actions.
    """
    r = lengths(U)
    longest = float(r.max(initial=0.0))
    return longest * float(np.sqrt(np.mean((r / longest) ** 2))) if longest else 0.0


def moving(U: np.ndarray, scale: float | None = None) -> np.ndarray:
    """Tell which actions have a direction: those longer than `NO_MOTION` times `scale`.

    Parameters
    ----------
    U : ndarray of shape (N, d)
        Actions.
    scale : float, optional
        Length of the longest action, in the unit of the actions, where it is known from elsewhere. By default the
        longest of `U`.

    Returns
    -------
    ndarray of shape (N,), bool
        True where the action moves.
    """
    r = lengths(U)
    return r > NO_MOTION * (r.max(initial=0.0) if scale is None else scale)


def directions(U: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Split actions into directions and lengths.

    Parameters
    ----------
    U : ndarray of shape (N, d)
        Actions.

    Returns
    -------
    unit : ndarray of shape (N, d)
        `û`, zero where an action does not move.
    r : ndarray of shape (N,)
        `‖u‖`, zero where an action does not move.
    """
    r = lengths(U)
    longest = r.max(initial=0.0)
    r[r <= NO_MOTION * longest] = 0.0
    if 0.0 < longest < 1 / SQUARABLE:  # whose inverse may be infinite
        return directions(U / longest)[0], r
    inverse = np.divide(1.0, r, out=np.zeros_like(r), where=r > 0)
    return U * inverse[:, None], r
