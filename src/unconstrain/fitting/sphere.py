"""How likely an action is where something was in the way: the sphere of Thales, blurred by noise.

For any orthogonal projection N the action `v = N π` obeys `vᵀ(π - v) = 0`: it lies on the sphere with diameter π, of
centre π/2 and radius `R = ‖π‖/2`. With v uniform on that sphere and `u = v + ε`, `ε ~ N(0, s² I)`,

    p(u) = (2πs²)^(-d/2) exp(-(ρ² + R²) / 2s²) Γ(d/2) (2/κ)^ν I_ν(κ),    ρ = ‖u - π/2‖,  κ = ρR / s²,  ν = d/2 - 1,

which for s << R is `N(δ; 0, s²) / area(R)` with the distance to the sphere `δ = ρ - R = uᵀ(u - π) / (ρ + R)`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unconstrain.fitting.bessel import scaled_bessel

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


def _unit(V: Floats, length: Floats) -> Floats:
    return V * np.divide(1.0, length, out=np.zeros_like(length), where=length > 0)[:, None]
