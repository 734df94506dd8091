"""How the mean of an exponential over a sphere grows: modified Bessel functions, without their scale.

They are exact from a series, from SciPy's, or from an expansion, by how large κ is. SciPy's take half a microsecond,
and are interpolated instead: by polynomials of the fifth degree in log κ that share value, slope and curvature with
them at a thousand places, which is as exact.

References
----------
Amos, Computation of modified Bessel functions and their ratios, Mathematics of Computation 28, 1974.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

SERIES_TERMS = 1000
"""More than the power series takes wherever the Bessel function itself underflows."""

FAR = 40.0
"""From κ = FAR + max(ν, 1)² / 2 on the expansion for large κ is exact in double precision, and faster."""

TERMS = 20
"""Of that expansion; fewer where κ is larger."""

NEGLIGIBLE = 1e-18

PIECES = 1024
"""Of the interpolation, a hundredth of κ each."""

MOST_DIMENSIONS = 64
"""Up to which values are interpolated: in hundreds, they are only exact to 1e-10 themselves."""

Floats = NDArray[np.float64]


class _Table(NamedTuple):
    """Polynomials (6, 2, PIECES) of both functions, by the place of log κ within a piece, from `least` to `most`."""

    polynomials: Floats
    least: float
    most: float
    begin: float
    step: float


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
    inside = (kappa > table.least) & (kappa < table.most)
    found = np.empty((2, len(kappa)))
    place = (np.log(kappa[inside]) - table.begin) / table.step
    piece = np.clip(place.astype(np.intp), 0, PIECES - 1)
    place -= piece
    value = table.polynomials[-1][:, piece]
    for coefficients in table.polynomials[-2::-1]:
        value *= place
        value += coefficients[:, piece]
    found[:, inside] = value
    if not inside.all():
        found[:, ~inside] = compute_scaled_bessel(d, kappa[~inside])
    return found[0], found[1]


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
def _table(d: int) -> _Table:
    """Interpolate between exact values; derivatives follow from `A' = 1 - A² - (d - 1) A / κ` for A = 1 - short."""
    least, most = 1e-4 * np.sqrt(d), FAR + max(d / 2 - 1, 1.0) ** 2 / 2
    begin, end = np.log(least), np.log(most)
    kappa, h = np.exp(np.linspace(begin, end, PIECES + 1)), (end - begin) / PIECES
    log_mean, short = compute_scaled_bessel(d, kappa)
    A = 1 - short
    slope = 1 - A**2 - (d - 1) * A / kappa
    bend = -2 * A * slope - (d - 1) * (slope / kappa - A / kappa**2)
    values = np.stack([log_mean, short])
    slopes = h * kappa * np.stack([-short, -slope])  # by the place within a piece, as all below
    bends = h * slopes + (h * kappa) ** 2 * np.stack([slope, -bend])
    half = bends / 2
    rise = np.diff(values) - slopes[:, :-1] - half[:, :-1]
    turn = np.diff(slopes) - bends[:, :-1]
    curl = np.diff(half)
    polynomials = [
        values[:, :-1],
        slopes[:, :-1],
        half[:, :-1],
        10 * rise - 4 * turn + curl,
        -15 * rise + 7 * turn - 2 * curl,
        6 * rise - 3 * turn + curl,
    ]
    return _Table(np.stack(polynomials), float(least), float(most), float(begin), float(h))


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
