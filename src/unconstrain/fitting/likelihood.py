"""How likely recorded actions are, as free ones and as constrained ones, and what either says of the policy.

A free action is the policy and noise, `N(u; p, S)`. A constrained one lies near the sphere with diameter p (`sphere`).
Both come with gradients by the prediction p. That of a constrained sample is not the one of its likelihood, though:
that asks v to be spread evenly over the sphere, and where it is not (one task, always the same constraint) pulls every
prediction towards zero, since a small sphere has a small area. What holds wherever on the sphere v lies is the
distribution of the distance ρ from the centre, a Rice distribution, `p(ρ) ∝ ρ^(d-1) p(u)`; its gradient has no bias up
to terms in s²/R².
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from unconstrain.fitting.noise import Noise
from unconstrain.fitting.sphere import Sphere, blurred

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Views:
    """Samples as seen from predictions: as free ones, as constrained ones, and behind known projections.

    Parameters
    ----------
    U, P : ndarray of shape (N, d)
        Actions and predictions.
    noise : Noise
        Variances, the actions' above zero.
    ranks : ndarray of shape (N,)
        How many numbers the sample shows if it is taken whole: d, or the rank of its known projection, behind which U
        and P are given then.
    """

    U: Floats
    P: Floats
    noise: Noise
    ranks: Floats

    @cached_property
    def sphere(self) -> Sphere:
        """Where the actions lie beside the predictions' spheres."""
        return Sphere.of(self.U, self.P)

    def under(self, noise: Noise) -> "Views":
        """Look at the same samples under another noise.

        Parameters
        ----------
        noise : Noise
            Variances, the actions' above zero.

        Returns
        -------
        Views
            Which share the spheres.
        """
        other = replace(self, noise=noise)
        other.__dict__["sphere"] = self.sphere
        return other

    @cached_property
    def whole(self) -> "Whole":
        """The samples taken whole."""
        return Whole.of(self)

    @cached_property
    def constrained(self) -> "Constrained":
        """The samples taken as constrained."""
        return Constrained.of(self)


@dataclass(frozen=True)
class Whole:
    """Samples taken whole: log-likelihood, gradient, information, and squared residuals.

    Parameters
    ----------
    log : ndarray of shape (N,)
        Log-likelihood.
    gradient : ndarray of shape (N, d)
        By the prediction.
    across, along : ndarray of shape (N,)
        Squared residuals across the prediction and along it.
    variance : ndarray of shape (N,)
        Along it.
    information : ndarray of shape (N,)
        About the policy along it; across it is 1 / across.
    length : ndarray of shape (N,)
        Of the prediction.
    """

    log: Floats
    gradient: Floats
    across: Floats
    along: Floats
    variance: Floats
    information: Floats
    length: Floats

    @classmethod
    def of(cls, views: Views) -> "Whole":
        """Compute them."""
        noise, ahead = views.noise, views.sphere.ahead
        q, E = 2 * views.sphere.radius, views.U - views.P
        along = np.einsum("nd,nd->n", E, ahead)
        squares = np.einsum("nd,nd->n", E, E)
        across = np.maximum(squares - along**2, 0.0)
        v = noise.action + noise.speed * q**2
        ranks = np.maximum(views.ranks, 1.0)
        log = -0.5 * (
            across / noise.action
            + along**2 / v
            + (ranks - 1) * np.log(2 * np.pi * noise.action)
            + np.log(2 * np.pi * v)
        )
        log[views.ranks < 0.5] = 0.0  # nothing is seen behind a projection that lets nothing through
        gradient = E / noise.action
        information = 1 / v
        if noise.speed:
            # By the direction of p, across which v is not the variance, and by its length.
            aside = E - along[:, None] * ahead
            turning = (1 + noise.speed * q * along / v) / noise.action
            slope = 2 * noise.speed * q
            lengthening = along / v + 0.5 * slope / v * (along**2 / v - 1)
            gradient = turning[:, None] * aside + lengthening[:, None] * ahead
            information = information + 0.5 * (slope / v) ** 2
        return cls(log, gradient, across, along**2, v, information, q)


@dataclass(frozen=True)
class Constrained:
    """Samples taken as constrained.

    Parameters
    ----------
    log : ndarray of shape (N,)
        Log-likelihood.
    gradient : ndarray of shape (N, d)
        Of the log-likelihood of the distance, by the prediction.
    square : ndarray of shape (N,)
        What the squared distance from the sphere comes to, given its curvature.
    variance : ndarray of shape (N,)
        Of the distance.
    """

    log: Floats
    gradient: Floats
    square: Floats
    variance: Floats

    @classmethod
    def of(cls, views: Views) -> "Constrained":
        """Compute them."""
        noise, sphere = views.noise, views.sphere
        d = views.U.shape[1]
        r2 = np.einsum("nd,nd->n", views.U, views.U)
        by_share = noise.speed * r2
        variance = noise.action + sphere.share * by_share
        density = blurred(sphere, variance)
        gradient = density.by_policy
        if noise.speed:
            across = sphere.from_center + sphere.radius
            safe = np.where(across > 0, across, 1.0)
            change = -density.by_variance * by_share * sphere.share / safe
            gradient = gradient + change[:, None] * (sphere.ahead - sphere.out)
        # From the density of the action to that of its distance; bounded where the action is at the centre.
        rho = sphere.from_center
        gradient = gradient - ((d - 1) / 2 * rho / (rho**2 + variance))[:, None] * sphere.out
        square = variance * (2 * variance * density.by_variance + 1)
        return cls(density.log, gradient, square, variance)
