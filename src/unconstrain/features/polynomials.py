"""Polynomials of the state: their slopes, `Σ_k q_k p_ik x_k^(p_ik - 1) Π_(l≠k) x_l^p_il` for the powers p."""

from typing import Any

import numpy as np


class Polynomials:
    """What scikit-learn's `PolynomialFeatures` can do besides `transform`: see `features.bases`.

    Parameters
    ----------
    transformer : PolynomialFeatures
        Fitted, before any method is called.
    """

    def __init__(self, transformer: Any) -> None:
        self.transformer = transformer

    def slopes(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Compute the slopes of all monomials.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        directions : ndarray of shape (N, n)
            Directions q, one for each state.

        Returns
        -------
        ndarray of shape (N, M)
            Slopes of the M basis functions.
        """
        powers = self.transformer.powers_
        table = _power_table(X, powers)
        total = np.zeros((len(X), len(powers)))
        for k in range(X.shape[1]):
            total += directions[:, k, None] * _partial(table, powers, k)
        return total

    def gradient(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Compute the gradient of `wᵀb(x)`.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        w : ndarray of shape (M,)
            Weights of the basis functions.

        Returns
        -------
        ndarray of shape (N, n)
            The gradient at each state.
        """
        powers = self.transformer.powers_
        table = _power_table(X, powers)
        return np.column_stack([_partial(table, powers, k) @ w for k in range(X.shape[1])])


def _power_table(X: np.ndarray, powers: np.ndarray) -> list[np.ndarray]:
    """Compute `x_j^p` for p from 0 to the highest power, an array (N, p + 1) for each dimension."""
    return [np.vander(x, powers.max(initial=0) + 1, increasing=True) for x in X.T]


def _partial(table: list[np.ndarray], powers: np.ndarray, k: int) -> np.ndarray:
    """Compute `∂/∂x_k` of every monomial, (N, M)."""
    result = powers[:, k] * table[k][:, np.maximum(powers[:, k] - 1, 0)]
    for j, column in enumerate(table):
        if j != k:
            result *= column[:, powers[:, j]]
    return result
