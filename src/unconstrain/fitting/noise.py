"""What recorded actions deviate from the policy by, and how it is estimated.

Two variances: σ² of the actions, in every direction alike, and τ² of the speed, since people are faster one day than
the next (a share of the policy, along it). So a free sample has the covariance

    S = σ² I + τ² p pᵀ,

and the distance δ of a constrained one from its sphere the variance

    s² = σ² + ω τ² ‖u‖²,        ω ≈ ‖u‖² / ‖p‖²,

since a change e of the policy moves the sphere by `ûᵀe ‖u‖/‖p‖`. Every squared residual thus has an expectation linear
in the two, from which they are estimated by scoring, as a weighted regression of squares.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

KINDS = ("action", "speed")


@dataclass(frozen=True)
class Noise:
    """Variances of what actions deviate by.

    Parameters
    ----------
    action : float
        σ², in squared units of the action.
    speed : float
        τ², a squared share of the policy.
    """

    action: float
    speed: float = 0.0


@dataclass(frozen=True)
class Squares:
    """Normal equations of the regression of squared residuals on what the variances contribute. They add.

    Parameters
    ----------
    matrix : ndarray of shape (2, 2)
        `Σ c cᵀ / v²` for residuals of variance `v = cᵀ (σ², τ²)`.
    vector : ndarray of shape (2,)
        `Σ c e² / v²`.
    count : float
        How many residuals.
    """

    matrix: Floats
    vector: Floats
    count: float

    def __add__(self, other: "Squares") -> "Squares":
        return Squares(self.matrix + other.matrix, self.vector + other.vector, self.count + other.count)

    @classmethod
    def sum(cls, parts: Sequence[tuple[Floats, Floats, Floats, tuple[Floats, Floats]]]) -> "Squares":
        """Sum residuals up.

        Parameters
        ----------
        parts : sequence of (ndarray, ndarray, ndarray, tuple of ndarray)
            For each sort of residual its number, its square, its variance, and what a unit of σ² and of τ² adds to
            that, all of shape (N,).

        Returns
        -------
        Squares
            Of all.
        """
        matrix, vector, count = np.zeros((2, 2)), np.zeros(2), 0.0
        for number, square, variance, contributions in parts:
            c = np.stack(contributions) / variance
            matrix += (c * number) @ c.T
            vector += c @ (square / variance)
            count += float(np.sum(number))
        return cls(matrix, vector, count)

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
