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

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

KINDS = ("action", "speed", "misfit")


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

    @classmethod
    def sum(cls, parts: Sequence[tuple[Floats, Floats, Floats, tuple[Floats, Floats, Floats]]]) -> "Squares":
        """Sum residuals up.

        Parameters
        ----------
        parts : sequence of (ndarray, ndarray, ndarray, tuple of ndarray)
            For each sort of residual its number, its square, its variance, and what a unit of σ², τ² and μ² adds to
            that, all of shape (N,).

        Returns
        -------
        Squares
            Of all.
        """
        matrix, vector, total, count = np.zeros((3, 3)), np.zeros(3), 0.0, 0.0
        for number, square, variance, contributions in parts:
            c = np.stack(contributions) / variance
            matrix += (c * number) @ c.T
            vector += c @ (square / variance)
            total += float(np.sum(square / variance))
            count += float(np.sum(number))
        return cls(matrix, vector, total, count)

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
