"""What recorded actions deviate from the policy by, and how it is estimated.

Three variances, of which a recording may show any: σ² of the actions, in every direction alike; τ² of the speed, since
people are faster one day than the next (a share of the policy, along it); and μ² of the policy itself, by which the
model misses it. So a free sample has the covariance

    S = (σ² + μ²) I + τ² p pᵀ,

and the distance δ of a constrained one from its sphere the variance

    s² = σ² + ω (μ² + τ² ‖u‖²),        ω ≈ ‖u‖² / ‖p‖²,

since a change e of the policy moves the sphere by `ûᵀe ‖u‖/‖p‖`. Every squared residual thus has an expectation linear
in the three, from which they are estimated by scoring, as a weighted regression of squares.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from unconstrain.fitting.sphere import Sphere, blurred

Floats = NDArray[np.float64]

KINDS = ("action", "speed", "misfit")
RICE = True
VARIANTS: tuple[tuple[str, ...], ...] = (("action",), ("action", "speed"))


@dataclass(frozen=True)
class Noise:
    """Variances of what actions deviate by.

    Parameters
    ----------
    action : float
        σ², in squared units of the action.
    speed : float
        τ², a squared share of the policy.
    misfit : float
        μ², in squared units of the action.
    """

    action: float
    speed: float = 0.0
    misfit: float = 0.0

    @property
    def across(self) -> float:
        """Variance of a free sample across the policy, `σ² + μ²`, in squared units of the action."""
        return self.action + self.misfit

    @property
    def variances(self) -> Floats:
        """All three, (3,)."""
        return np.array([self.action, self.speed, self.misfit])


@dataclass(frozen=True)
class Squares:
    """Normal equations of the regression of squared residuals on what the variances contribute. They add.

    Parameters
    ----------
    matrix : ndarray of shape (3, 3)
        `Σ c cᵀ / v²` for residuals of variance `v = cᵀ (σ², τ², μ²)`.
    vector : ndarray of shape (3,)
        `Σ c e² / v²`.
    total : float
        `Σ e² / v`.
    count : float
        How many residuals.
    """

    matrix: Floats
    vector: Floats
    total: float
    count: float

    def __add__(self, other: "Squares") -> "Squares":
        return Squares(
            self.matrix + other.matrix,
            self.vector + other.vector,
            self.total + other.total,
            self.count + other.count,
        )

    def estimate(self, kinds: tuple[str, ...], excess: float = 1.0) -> Noise:
        """Solve for the variances, none of them below zero.

        Parameters
        ----------
        kinds : tuple of str
            Which of them there are; the others are zero.
        excess : float
            What the squares are multiplied by beforehand.

        Returns
        -------
        Noise
            Estimated.
        """
        from scipy.optimize import nnls

        index = [KINDS.index(kind) for kind in kinds]
        matrix, vector = self.matrix[np.ix_(index, index)], excess * self.vector[index]
        scale = np.sqrt(np.maximum(np.diag(matrix), np.finfo(float).tiny))
        values, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
        root = np.sqrt(np.maximum(values, 1e-12))
        solution, _ = nnls(root[:, None] * vectors.T, (vectors.T @ (vector / scale)) / root)
        return replace(Noise(0.0), **dict(zip(kinds, (solution / scale).tolist(), strict=True)))


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

    @cached_property
    def whole(self) -> "Whole":
        """The samples taken whole."""
        return Whole.of(self)

    @cached_property
    def bent(self) -> "Bent":
        """The samples taken as constrained."""
        return Bent.of(self)


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
        v = noise.across + noise.speed * q**2
        ranks = np.maximum(views.ranks, 1.0)
        log = -0.5 * (
            across / noise.across
            + along**2 / v
            + (ranks - 1) * np.log(2 * np.pi * noise.across)
            + np.log(2 * np.pi * v)
        )
        gradient = E / noise.across
        information = 1 / v
        if noise.speed:
            # By the direction of p, `(u - (u·p̂) p̂) / q`, and by its length.
            aside = E - along[:, None] * ahead
            reach = (along + q) / noise.across - along / v
            turning = np.divide(reach, q, out=np.zeros_like(q), where=q > 0)
            slope = 2 * noise.speed * q
            lengthening = along / v + 0.5 * slope / v * (along**2 / v - 1)
            gradient = turning[:, None] * aside + lengthening[:, None] * ahead
            information = information + 0.5 * (slope / v) ** 2
        return cls(log, gradient, across, along**2, v, information, q)


@dataclass(frozen=True)
class Bent:
    """Samples taken as constrained.

    Parameters
    ----------
    log : ndarray of shape (N,)
        Log-likelihood.
    gradient : ndarray of shape (N, d)
        By the prediction.
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
    def of(cls, views: Views) -> "Bent":
        """Compute them."""
        noise, sphere = views.noise, views.sphere
        d = views.U.shape[1]
        r2 = np.einsum("nd,nd->n", views.U, views.U)
        by_share = noise.misfit + noise.speed * r2
        variance = noise.action + sphere.share * by_share
        density = blurred(sphere, variance)
        gradient = density.by_policy
        if noise.misfit or noise.speed:
            across = sphere.from_center + sphere.radius
            safe = np.where(across > 0, across, 1.0)
            change = -density.by_variance * by_share * sphere.share / safe
            gradient = gradient + change[:, None] * (sphere.ahead - sphere.out)
        if RICE:
            rho = sphere.from_center
            gradient = gradient - ((d - 1) / 2 * rho / (rho**2 + variance))[:, None] * sphere.out
        square = variance * (2 * variance * density.by_variance + 1)
        return cls(density.log, gradient, square, variance)
