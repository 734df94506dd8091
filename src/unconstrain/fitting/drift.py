"""Where on the sphere a constrained action lies: near where the one before it lay.

A table stays a table from one sample to the next, so a constrained action moves little over its sphere. Taken one by
one, constrained samples would pay for being anywhere on the sphere again and again, and a constraint that happens to
hardly matter for a while would look like freedom. So the direction m from the sphere's centre to the action follows

    p(m_t | m_{t-1}) = (1 - j) f(m_t · m_{t-1}; κ_t) + j / area,      f ∝ exp(κ m_t · m_{t-1}),

with j how often it jumps, and `1/κ_t` the square of the drift and what noise adds to it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unconstrain.fitting.bessel import scaled_bessel
from unconstrain.fitting.sphere import Sphere

Floats = NDArray[np.float64]

LEAST, MOST = 1e-8, 1.0
"""Squares of the drift, in radians, between which it is sought."""

CAUTION = 1.5
"""How much more noise there is in the direction than would be if samples were independent: residuals of a model that
does not quite fit change slowly, and must not pass for a constraint that does."""

RARELY = 1e-12

BLURRIEST = 1e6
"""Variance of a direction, in rad², that is as good as infinite: the noise is far larger than the sphere."""


@dataclass(frozen=True)
class Drift:
    """How the position on the sphere changes from one sample to the next.

    Parameters
    ----------
    square : float
        Mean square of the drift, in radians, in each of d - 1 directions.
    jump : float
        Share of samples at which it jumps anywhere.
    """

    square: float = 0.01
    jump: float = 0.5


@dataclass(frozen=True)
class Drifts:
    """What samples say of the drift. They add.

    Parameters
    ----------
    pairs, near : float
        Expected number of constrained samples after constrained ones, and of those that did not jump.
    vector, weight : float
        `Σ e² / v²` and `Σ 1 / v²` for a squared drift e² of expectation v.
    """

    pairs: float = 0.0
    near: float = 0.0
    vector: float = 0.0
    weight: float = 0.0

    def __add__(self, other: "Drifts") -> "Drifts":
        return Drifts(
            self.pairs + other.pairs,
            self.near + other.near,
            self.vector + other.vector,
            self.weight + other.weight,
        )

    def estimate(self) -> Drift:
        """Estimate the drift.

        Returns
        -------
        Drift
            The most likely one; jumps as if one of two had been seen before.
        """
        square = self.vector / self.weight if self.weight > 0 else Drift.square
        return Drift(float(np.clip(square, LEAST, MOST)), (self.pairs - self.near + 1.0) / (self.pairs + 2.0))


@dataclass(frozen=True)
class Steps:
    """How samples lie beside those before them, were both constrained.

    Parameters
    ----------
    log_kept : ndarray of shape (N,)
        Logarithm of the density of the direction, relative to its being anywhere; 0 for the first of an episode.
    log_near : ndarray of shape (N,)
        Of that, the part that did not jump.
    excess : ndarray of shape (N,)
        Squared drift, less what noise adds to it.
    concentration : ndarray of shape (N,)
        κ.
    """

    log_kept: Floats
    log_near: Floats
    excess: Floats
    concentration: Floats

    @classmethod
    def of(cls, sphere: Sphere, variance: Floats, starts: NDArray[np.bool_], drift: Drift) -> "Steps":
        """Compare each sample with the one before it.

        Parameters
        ----------
        sphere : Sphere
            Of N samples.
        variance : ndarray of shape (N,)
            Of their distances to it.
        starts : ndarray of shape (N,), bool
            Samples that are not compared with the one before them, as the first of each episode.
        drift : Drift
            As far as it is known.

        Returns
        -------
        Steps
            Of N samples.
        """
        N, d = sphere.out.shape
        blur = variance / np.maximum(sphere.radius**2, variance / BLURRIEST)
        chord, noise = np.zeros(N), np.zeros(N)
        chord[1:] = np.sum((sphere.out[1:] - sphere.out[:-1]) ** 2, axis=1)
        noise[1:] = CAUTION * (blur[1:] + blur[:-1])
        concentration = 1.0 / (drift.square + noise)
        log_mean, _ = scaled_bessel(d, concentration)
        log_near = np.log(max(1.0 - drift.jump, RARELY)) - concentration * chord / 2 - log_mean
        log_kept = np.logaddexp(log_near, np.log(max(drift.jump, RARELY)))
        log_kept[starts] = log_near[starts] = 0.0
        return cls(log_kept, log_near, chord / max(d - 1, 1) - noise, concentration)

    def sum(self, kept: Floats) -> Drifts:
        """Sum up what the steps say.

        Parameters
        ----------
        kept : ndarray of shape (N,)
            Probability that a sample and the one before it are both constrained.

        Returns
        -------
        Drifts
            Of N samples.
        """
        near = kept * np.exp(self.log_near - self.log_kept)
        weight = near * self.concentration**2
        return Drifts(
            float(kept.sum()), float(near.sum()), float(np.sum(weight * self.excess)), float(weight.sum())
        )
