"""Task coordinates as features: a constraint row is a fixed combination of a Jacobian's rows."""

from collections.abc import Callable
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator

from unconstrain.errors import DataError


class JacobianFeatures(BaseEstimator):
    """Features of rows ``r(x) = J(x)ᵀ λ`` that combine the rows of a task Jacobian, the same way at all states.

    Parameters
    ----------
    jacobian : callable
        Function of states X (N, n) that returns J (N, m, d), such as a robot's Jacobian of the hand.
    """

    def __init__(self, jacobian: Callable[[np.ndarray], ArrayLike]):
        self.jacobian = jacobian

    def fit(self, X: np.ndarray, d: int, sample_weight: np.ndarray | None = None) -> Self:
        """Check that the Jacobian fits the states and actions.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        d : int
            Number of actions.
        sample_weight : ndarray of shape (N,), optional
            Changes nothing.

        Returns
        -------
        JacobianFeatures
            Itself, fitted.

        Raises
        ------
        DataError
            If the Jacobian is not (N, m, d).
        """
        J = np.asarray(self.jacobian(X[:2]))
        if J.ndim != 3 or J.shape[0] != len(X[:2]) or J.shape[2] != d:
            raise DataError(
                f"the Jacobian must be (samples, task coordinates, {d}) for {d} actions, got shape {J.shape} for "
                f"{len(X[:2])} samples"
            )
        return self

    def along(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Compute the features along directions.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        directions : ndarray of shape (N, d)
            One direction a state.

        Returns
        -------
        ndarray of shape (N, m)
            ``J(x) q``.
        """
        return np.einsum("nmd,nd->nm", np.asarray(self.jacobian(X)), directions)

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Compute the row at states.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        w : ndarray of shape (m,)
            Parameters λ.

        Returns
        -------
        ndarray of shape (N, d)
            ``J(x)ᵀ λ``.
        """
        return np.einsum("nmd,m->nd", np.asarray(self.jacobian(X)), w)
