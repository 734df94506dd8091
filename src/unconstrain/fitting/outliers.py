"""How likely actions are if nothing was in the way, and residuals are not Gaussian.

What a regressor misses has heavy tails: most samples lie where it fits, and some at corners and edges where it
does not. Beside a Gaussian the latter look like constrained ones. So the rival of contact is a multivariate t
distribution,

    log p(u) = log Γ((ν+d)/2) - log Γ(ν/2) - d/2 log(νπs²) - (ν+d)/2 log(1 + ‖u - p‖²/νs²),

with s² of greatest likelihood (by EM, Lange, Little, Taylor 1989) and ν the best of a few.

References
----------
Lange, Little, Taylor, Robust statistical modeling using the t distribution, J. Am. Stat. Assoc. 84, 1989.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

FREEDOMS = (1.0, 2.0, 4.0, 8.0, 30.0, 1e6)
"""ν from the heaviest tails to Gaussian ones."""

STEPS = 100


def find_heavy_tailed(squares: Floats, ranks: Floats, weights: Floats, least: float) -> float:
    """Compute the greatest mean log-likelihood of residuals under a t distribution.

    Parameters
    ----------
    squares : ndarray of shape (N,)
        `‖u - p‖²`.
    ranks : ndarray of shape (N,)
        How many numbers each residual has; those that have none are left out.
    weights : ndarray of shape (N,)
        Of the samples.
    least : float
        Variance that s² is not below.

    Returns
    -------
    float
        Of a sample.
    """
    shown = ranks > 0.5
    r2, d, omega = squares[shown], ranks[shown], weights[shown]
    if not omega.sum() > 0:
        return 0.0
    found = [_fit(r2, d, omega, freedom, least) for freedom in FREEDOMS]
    return max(found) / float(weights.sum())


def _fit(r2: Floats, d: Floats, omega: Floats, freedom: float, least: float) -> float:
    from scipy.special import gammaln

    variance = max(float(omega @ r2 / (omega @ d)), least)
    for _ in range(STEPS):
        trust = (freedom + d) / (freedom + r2 / variance)
        new = max(float(omega @ (trust * r2) / (omega @ d)), least)
        if abs(new - variance) <= 1e-6 * variance:
            break
        variance = new
    log = gammaln((freedom + d) / 2) - gammaln(freedom / 2) - d / 2 * np.log(freedom * np.pi * variance)
    return float(omega @ (log - (freedom + d) / 2 * np.log1p(r2 / (freedom * variance))))
