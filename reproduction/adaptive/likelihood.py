"""How likely recorded actions are under a policy, whatever it was learnt by, when constraints are not known.

Each sample is free with probability ρ, else constrained by any projection, all points of the sphere with diameter π
being alike (Thales: `v = Nπ` has `vᵀ(π - v) = 0`). People are faster one day than the next: π is scaled by `1 + τη`,
`η ~ N(0, 1)`. Noise of variance σ² is added to every component.

    p(u | free)        = N(u; π, σ²I + τ²ππᵀ)
    p(u | constrained) = mean over η of
        (2πσ²)^(-d/2) exp(-(ρ_u - R)² / 2σ²) Γ(d/2) (2/κ)^(d/2-1) e^(-κ) I_{d/2-1}(κ)

with `ρ_u = ‖u - π/2‖`, `R = ‖π‖/2`, `κ = ρ_u R / σ²`, π scaled; the mean by Gauss-Hermite quadrature.

Samples are taken one by one: how a way to learn supposes contact to switch gives it no advantage. σ, τ and ρ are those
of the largest likelihood on what was learnt from, for every way alike, and held-out samples are judged with them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import logsumexp

from unconstrain.fitting.likelihood import Views
from unconstrain.fitting.noise import Noise
from unconstrain.fitting.sphere import Sphere, blurred

Array = NDArray[np.float64]

NODES, WEIGHTS = np.polynomial.hermite_e.hermegauss(7)
"""Of the quadrature over η; seven suffice, since the sphere's points themselves are spread by its radius."""

EVERY = 3
"""Samples to one that σ, τ and ρ are found from."""


@dataclass(frozen=True)
class Spread:
    """What scatters actions about a policy.

    Attributes
    ----------
    noise : float
        σ, in units of the action.
    speed : float
        τ, a share of the speed.
    free : float
        ρ, the share of free samples.
    """

    noise: float
    speed: float
    free: float

    @classmethod
    def find(cls, U: Array, P: Array) -> "Spread":
        """Find the spread of the largest likelihood of actions U (N, d) about predictions P (N, d)."""
        U, P = U[::EVERY], P[::EVERY]
        scale = float(np.sqrt(np.mean((U - P) ** 2)))

        def surprise(x: Array) -> float:
            return -float(np.mean(log_likelihood(U, P, cls._at(x, scale))))

        # Mostly free with different speeds, or mostly constrained with one: each has a peak of its own.
        starts = ([0.0, -1.5, 2.0], [-1.5, -4.0, -2.0])
        tries = [minimize(surprise, start, method="Nelder-Mead", options={"xatol": 1e-2}) for start in starts]
        return cls._at(min(tries, key=lambda tried: tried.fun).x, scale)

    @classmethod
    def _at(cls, x: Array, scale: float) -> "Spread":
        noise, speed, free = np.clip(x, [-7.0, -7.0, -7.0], [2.0, 1.0, 7.0])
        return cls(scale * float(np.exp(noise)), float(np.exp(speed)), float(1 / (1 + np.exp(-free))))


def log_likelihood(U: Array, P: Array, spread: Spread) -> Array:
    """Compute `log p(u)` of every sample, (N,), for actions U and a policy's actions P, both (N, d)."""
    return np.logaddexp(
        np.log(spread.free) + log_free(U, P, spread), np.log1p(-spread.free) + log_constrained(U, P, spread)
    )


def log_free(U: Array, P: Array, spread: Spread) -> Array:
    """Compute `log p(u | free)`, (N,)."""
    noise = Noise(spread.noise**2, spread.speed**2)
    return Views(U, P, noise, np.full(len(U), float(U.shape[1]))).whole.log


def log_constrained(U: Array, P: Array, spread: Spread) -> Array:
    """Compute `log p(u | constrained)`, (N,)."""
    return logsumexp(
        [log_sphere(U, (1 + spread.speed * eta) * P, spread.noise) for eta in NODES],
        axis=0,
        b=(WEIGHTS / WEIGHTS.sum())[:, None],
    )


def log_sphere(U: Array, P: Array, noise: float) -> Array:
    """Compute the log density (N,) of points uniform on the sphere with diameter P (N, d), with noise."""
    return blurred(Sphere.of(U, P), np.full(len(U), noise**2)).log
