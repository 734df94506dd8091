"""Preconditioned conjugate gradients for `(H + λ) w = g`, several systems side by side.

The iterates minimise the energy `(w - w*)ᵀ(H + λ)(w - w*)`, which is no less than the squared error of the
predictions at the samples. What is left of it is estimated by what the last steps took away: `Σ α_j r_jᵀz_j` over some
steps is what they lowered it by, a bound from below of what it was before them.

References
----------
Hestenes, Stiefel, Methods of conjugate gradients for solving linear systems, Journal of Research of the National Bureau
of Standards 49, 1952. Strakoš, Tichý, On error estimation in the conjugate gradient method and why it works in finite
precision computations, Electronic Transactions on Numerical Analysis 13, 2002.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

DELAY = 10
"""Steps whose gain is taken for the energy that was left before them."""

REFRESHED = 50
"""Steps after which residuals are computed anew, rather than updated."""


@dataclass(frozen=True)
class Solved:
    """What conjugate gradients have reached.

    Parameters
    ----------
    W : ndarray of shape (M, L, d)
        Parameters.
    error : ndarray of shape (L,)
        Estimate of the energy that is left, as a share of the whole.
    n_steps : int
        Steps made.
    is_solved : bool
        Whether every system is solved as well as was asked for.
    """

    W: np.ndarray
    error: np.ndarray
    n_steps: int
    is_solved: bool


def solve(
    apply: Callable[[np.ndarray, np.ndarray], np.ndarray],
    g: np.ndarray,
    squares: np.ndarray,
    precondition: Callable[[np.ndarray], np.ndarray],
    start: np.ndarray,
    *,
    precision: float,
    most_steps: int,
) -> Solved:
    """Solve systems.

    Parameters
    ----------
    apply : callable
        Multiplies some systems' arrays (M, K, d) by their `H + λ`, given which systems they are, (K,).
    g : ndarray of shape (M, L, d)
        Right-hand sides.
    squares : ndarray of shape (L,)
        s of each, the risk of `w = 0`.
    precondition : callable
        Multiplies arrays (M, K, d) by something near the inverse of `H + λ`.
    start : ndarray of shape (M, L, d)
        Where to begin.
    precision : float
        Of predictions at the samples, as a share of the root mean square action.
    most_steps : int
        At most.

    Returns
    -------
    Solved
        Of each system.
    """
    W, L = start.copy(), g.shape[1]
    R = g - apply(W, np.arange(L)) if W.any() else g.copy()
    gains: list[np.ndarray] = []
    error = np.full(L, np.inf)
    going = np.arange(L)
    Z = precondition(R)
    D, rho = Z.copy(), _dots(R, Z)
    tiny = np.finfo(np.float64).tiny
    for step in range(1, most_steps + 1):
        HD = apply(D[:, going], going)
        curvature = _dots(D[:, going], HD)
        # Where rounding has used up what there was to gain, another step would be by chance.
        sound = (curvature > 0) & (rho[going] > 0)
        alpha = np.where(sound, rho[going] / np.where(sound, curvature, 1.0), 0.0)
        W[:, going] += alpha[:, None] * D[:, going]
        gain = np.zeros(L)
        gain[going] = alpha * rho[going]
        gains.append(gain)
        if step % REFRESHED:
            R[:, going] -= alpha[:, None] * HD
        else:
            R[:, going] = g[:, going] - apply(W[:, going], going)
        recent = np.sum(gains[-DELAY:], axis=0)
        enough = precision**2 * squares
        error[going] = (recent / np.maximum(squares, tiny))[going]
        done = np.zeros(len(going), dtype=bool) if step < DELAY else (recent <= enough)[going]
        going = going[~(done | ~sound)]
        if not len(going):
            return Solved(W, error, step, True)
        Z = precondition(R[:, going])
        ahead = _dots(R[:, going], Z)
        beta = ahead / rho[going]
        rho[going] = ahead
        D[:, going] = Z + beta[:, None] * D[:, going]
    return Solved(W, error, most_steps, False)


def _dots(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Multiply the arrays (M, L, d) of each system: (L,)."""
    return np.einsum("mld,mld->l", A, B)
