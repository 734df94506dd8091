"""How likely an action is where something was in the way: the sphere of Thales, blurred by noise.

For any orthogonal projection N the action `v = N π` obeys `vᵀ(π - v) = 0`: it lies on the sphere with diameter π, of
centre π/2 and radius `R = ‖π‖/2`. With v uniform on that sphere and `u = v + ε`, `ε ~ N(0, s² I)`,

    p(u) = (2πs²)^(-d/2) exp(-(ρ² + R²) / 2s²) Γ(d/2) (2/κ)^ν I_ν(κ),    ρ = ‖u - π/2‖,  κ = ρR / s²,  ν = d/2 - 1,

which for s << R is `N(δ; 0, s²) / area(R)` with the distance to the sphere `δ = ρ - R = uᵀ(u - π) / (ρ + R)`.
"""

from dataclasses import dataclass
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

MOST_IN_TABLE = 32
"""Dimensions up to which the Bessel functions are interpolated, in `bessel_table`."""

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Sphere:
    """Where actions lie beside the spheres of predictions.

    Parameters
    ----------
    from_center : ndarray of shape (N,)
        ρ.
    radius : ndarray of shape (N,)
        R.
    distance : ndarray of shape (N,)
        δ, negative inside.
    share : ndarray of shape (N,)
        `ω = (‖u‖ / (ρ + R))²`, at most 1: `‖u‖² / ‖π‖²` for an action on the sphere.
    out : ndarray of shape (N, d)
        Unit vectors from the centre to the action.
    ahead : ndarray of shape (N, d)
        Unit vectors of the predictions.
    """

    from_center: Floats
    radius: Floats
    distance: Floats
    share: Floats
    out: Floats
    ahead: Floats

    @classmethod
    def of(cls, U: Floats, P: Floats) -> "Sphere":
        """Place actions beside the spheres of predictions.

        Parameters
        ----------
        U : ndarray of shape (N, d)
            Actions.
        P : ndarray of shape (N, d)
            Predictions.

        Returns
        -------
        Sphere
            Of N samples.
        """
        aside = U - P / 2
        from_center = np.sqrt(np.einsum("nd,nd->n", aside, aside))
        length = np.sqrt(np.einsum("nd,nd->n", P, P))
        across = from_center + length / 2
        squares = np.einsum("nd,nd->n", U, U)
        safe = np.where(across > 0, across, 1.0)
        return cls(
            from_center,
            length / 2,
            (squares - np.einsum("nd,nd->n", U, P)) / safe,
            squares / safe**2,
            _unit(aside, from_center),
            _unit(P, length),
        )

    @property
    def normal(self) -> Floats:
        """The gradient of the distance δ by the prediction, `-(out + ahead) / 2`, (N, d)."""
        return -(self.out + self.ahead) / 2


@dataclass(frozen=True)
class Density:
    """The logarithm of a density, and how it changes.

    Parameters
    ----------
    log : ndarray of shape (N,)
        `log p(u)`.
    by_policy : ndarray of shape (N, d)
        Its gradient by the prediction, at a given variance.
    by_variance : ndarray of shape (N,)
        Its derivative by s².
    """

    log: Floats
    by_policy: Floats
    by_variance: Floats


def blurred(sphere: Sphere, variance: Floats) -> Density:
    """Compute the exact marginal.

    Parameters
    ----------
    sphere : Sphere
        Of N samples.
    variance : ndarray of shape (N,)
        s² of each.

    Returns
    -------
    Density
        Of the recorded actions.
    """
    d = sphere.out.shape[1]
    rho, R = sphere.from_center, sphere.radius
    kappa = rho * R / variance
    log_bessel, short = scaled_bessel(d, kappa)
    log = -0.5 * d * np.log(2 * np.pi * variance) - sphere.distance**2 / (2 * variance) + log_bessel
    pulls_out, pulls_in = sphere.distance + R * short, -sphere.distance + rho * short
    by_policy = (pulls_out[:, None] * sphere.out - pulls_in[:, None] * sphere.ahead) / (2 * variance[:, None])
    squares = sphere.distance**2 + 2 * rho * R * short
    return Density(log, by_policy, (squares / variance - d) / (2 * variance))


def limit(sphere: Sphere, variance: Floats) -> Floats:
    """Compute what the exact marginal becomes for s << R, `log N(δ; 0, s²) - log area(R)`.

    Parameters
    ----------
    sphere : Sphere
        Of N samples.
    variance : ndarray of shape (N,)
        s² of each.

    Returns
    -------
    ndarray of shape (N,)
        `log p(u)`.
    """
    from scipy.special import gammaln

    d = sphere.out.shape[1]
    area = np.log(2) + d / 2 * np.log(np.pi) - gammaln(d / 2) + (d - 1) * np.log(sphere.radius)
    return -(sphere.distance**2) / (2 * variance) - 0.5 * np.log(2 * np.pi * variance) - area


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
    from scipy.special import gammaln

    nu = d / 2 - 1
    if d == 1:  # a sphere of two points
        decayed = np.exp(-2 * kappa)
        return np.log1p(decayed) - np.log(2.0), 2 * decayed / (1 + decayed)
    log_mean, short = np.empty_like(kappa), np.empty_like(kappa)
    least = 1e-4 * np.sqrt(d)
    with np.errstate(under="ignore", divide="ignore", invalid="ignore"):
        rest = kappa <= least
        near = np.flatnonzero(~rest & (kappa <= _far(nu)))
        if d <= MOST_IN_TABLE:
            table = _table(d)
            usual = kappa[near] >= table.begin
            common, near = near[usual], near[~usual]
            log_mean[common], short[common] = table(kappa[common])
        if len(near):
            log_mean[near], short[near], good = _bessel(d, kappa[near])
            rest[near[~good]] = True
    rest |= np.isnan(kappa)
    if rest.any():
        value, slope = _series(nu, kappa[rest])
        log_mean[rest], short[rest] = value - kappa[rest], 1 - slope
    huge = kappa > _far(nu)
    if huge.any():
        k = kappa[huge]
        beyond, beyond_next = _hankel(nu, k), _hankel(nu + 1, k)
        log_mean[huge] = gammaln(d / 2) + nu * np.log(2 / k) - 0.5 * np.log(2 * np.pi * k) + np.log1p(beyond)
        short[huge] = (beyond - beyond_next) / (1 + beyond)
    return log_mean, short


def _far(nu: float) -> float:
    return FAR + max(nu, 1.0) ** 2 / 2


def _bessel(d: int, kappa: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Compute what `scaled_bessel` does by Bessel functions, and say where these do not underflow."""
    from scipy.special import gammaln, ive

    nu = d / 2 - 1
    bessel: Floats = np.asarray(ive(nu, kappa), dtype=np.float64)
    log_mean = float(gammaln(d / 2)) + nu * np.log(2 / kappa) + np.log(bessel)
    return log_mean, 1 - ive(nu + 1, kappa) / bessel, bessel > 1e-290


@cache
def _table(d: int) -> Table:
    return Table.of(lambda kappa: _bessel(d, kappa)[:2], STEP, STEP * (_far(d / 2 - 1) // STEP + 1))


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


def _unit(V: Floats, length: Floats) -> Floats:
    return V * np.divide(1.0, length, out=np.zeros_like(length), where=length > 0)[:, None]
