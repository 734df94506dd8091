"""How the mean of an exponential over a sphere grows: modified Bessel functions, without their scale.

They are exact from a series, from SciPy's, or from an expansion, by how large κ is. SciPy's take half a microsecond,
and are interpolated instead (`bessel_table`).

References
----------
Amos, Computation of modified Bessel functions and their ratios, Mathematics of Computation 28, 1974.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from unconstrain.fitting.bessel_table import STEP, Table

SERIES_TERMS = 1000
"""More than the power series takes wherever the Bessel function itself underflows."""

FAR = 40.0
"""From κ = FAR + max(ν, 1)² / 2 on the expansion for large κ is exact in double precision, and faster."""

TERMS = 20
"""Of that expansion; fewer where κ is larger."""

NEGLIGIBLE = 1e-18

MOST_DIMENSIONS = 64
"""Up to which values are interpolated: in hundreds, they are only exact to 1e-10 themselves."""

Floats = NDArray[np.float64]


def scaled_bessel(d: int, kappa: Floats) -> tuple[Floats, Floats]:
    """Compute the mean of `exp(κ m₁ - κ)` over the unit sphere, and by how much it changes.

    Parameters
    ----------
    d : int
        Dimension of the space that the sphere lies in.
    kappa : ndarray of shape (N,)
        κ >= 0.

    Returns
    -------
    log_mean : ndarray of shape (N,)
        `log(Γ(d/2) (2/κ)^ν I_ν(κ)) - κ`, 0 at κ = 0.
    short : ndarray of shape (N,)
        By how much the mean of m₁, where its density is proportional to `exp(κ m₁)`, falls short of 1:
        `1 - I_{ν+1}(κ) / I_ν(κ)`, 0 to 1. It is the derivative of `log_mean` with the sign turned, and it is returned
        rather than the mean since it falls as 1/κ, and from a mean near 1 its digits could not be recovered.
    """
    if d == 1:  # a sphere of two points
        decayed = np.exp(-2 * kappa)
        return np.log1p(decayed) - np.log(2.0), 2 * decayed / (1 + decayed)
    if d > MOST_DIMENSIONS:
        return compute_scaled_bessel(d, kappa)
    table = _table(d)
    inside = (kappa >= table.begin) & (kappa < table.end)
    if inside.all():
        log_mean, short = table(kappa)
        return log_mean, short
    log_mean, short = np.empty_like(kappa), np.empty_like(kappa)
    log_mean[inside], short[inside] = table(kappa[inside])
    log_mean[~inside], short[~inside] = compute_scaled_bessel(d, kappa[~inside])
    return log_mean, short


def compute_scaled_bessel(d: int, kappa: Floats) -> tuple[Floats, Floats]:
    """Compute what `scaled_bessel` interpolates.

    Parameters
    ----------
    d : int
        Dimension of the space that the sphere lies in, at least two.
    kappa : ndarray of shape (N,)
        κ >= 0.

    Returns
    -------
    log_mean, short : ndarray of shape (N,)
        As there.
    """
    from scipy.special import gammaln, ive

    nu = d / 2 - 1
    log_mean, short = np.empty_like(kappa), np.empty_like(kappa)
    least = 1e-4 * np.sqrt(d)
    with np.errstate(under="ignore", divide="ignore", invalid="ignore"):
        huge = kappa > FAR + max(nu, 1.0) ** 2 / 2
        near = np.flatnonzero(~huge & (kappa > least))
        bessel = ive(nu, kappa[near])
        usual = bessel > 1e-290
        near, bessel = near[usual], bessel[usual]
        log_mean[near] = gammaln(d / 2) + nu * np.log(2 / kappa[near]) + np.log(bessel)
        short[near] = 1 - ive(nu + 1, kappa[near]) / bessel
    rest = ~huge
    rest[near] = False
    if rest.any():
        value, slope = _series(nu, kappa[rest])
        log_mean[rest], short[rest] = value - kappa[rest], 1 - slope
    if huge.any():
        k = kappa[huge]
        beyond, beyond_next = _hankel(nu, k), _hankel(nu + 1, k)
        log_mean[huge] = gammaln(d / 2) + nu * np.log(2 / k) - 0.5 * np.log(2 * np.pi * k) + np.log1p(beyond)
        short[huge] = (beyond - beyond_next) / (1 + beyond)
    return log_mean, short


@cache
def _table(d: int) -> Table:
    far = FAR + max(d / 2 - 1, 1.0) ** 2 / 2
    return Table.of(lambda kappa: compute_scaled_bessel(d, kappa), STEP, STEP * (far // STEP + 1))


def _series(nu: float, kappa: Floats) -> tuple[Floats, Floats]:
    """Sum `log 0F1(; ν+1; κ²/4)`, and κ / 2(ν+1) times the quotient of two of them, by powers."""
    quarter = kappa**2 / 4

    def log_sum(order: float) -> Floats:
        log_term, log_total = np.zeros_like(quarter), np.zeros_like(quarter)
        with np.errstate(divide="ignore"):
            log_quarter = np.log(quarter)
        for k in range(1, SERIES_TERMS):
            log_term = log_term + log_quarter - np.log(k * (order + k))
            log_total = np.logaddexp(log_total, log_term)
            if np.all(log_term < log_total - 40):
                break
        return log_total

    total = log_sum(nu)
    return total, kappa / (2 * (nu + 1)) * np.exp(log_sum(nu + 1) - total)


def _hankel(nu: float, kappa: Floats) -> Floats:
    """Expand `sqrt(2πκ) exp(-κ) I_ν(κ) - 1` in powers of 1/κ."""
    total, term = np.zeros_like(kappa), np.ones_like(kappa)
    inverse = 1 / kappa
    for k in range(1, TERMS + 1):
        term *= inverse
        term *= -(4 * nu**2 - (2 * k - 1) ** 2) / (8 * k)
        total += term
        if not np.abs(term).max(initial=0.0) > NEGLIGIBLE:
            break
    return total
