"""Task coordinates as features: a constraint row is a fixed combination of a Jacobian's rows."""

from collections.abc import Callable

import numpy as np
from sklearn.base import BaseEstimator

from unconstrain.errors import DataError


class JacobianFeatures(BaseEstimator):
    """``r(x) = J(x)ᵀ λ``: rows that combine the rows of a task Jacobian, the same way at all states.

    jacobian: function of states X (N, n) that returns J (N, m, d), such as `plants.arm.jacobian`.
    """

    def __init__(self, jacobian: Callable[[np.ndarray], np.ndarray]):
        self.jacobian = jacobian

    def fit(self, X: np.ndarray, d: int, sample_weight: np.ndarray | None = None) -> "JacobianFeatures":
        """Learn the number of task coordinates. Raises `DataError` where the Jacobian is not (N, m, d)."""
        J = np.asarray(self.jacobian(X[:2]))
        if J.ndim != 3 or J.shape[0] != len(X[:2]) or J.shape[2] != d:
            raise DataError(
                f"the Jacobian must be (samples, task coordinates, {d}) for {d} actions, got shape {J.shape} for "
                f"{len(X[:2])} samples"
            )
        self.n_parameters_ = J.shape[1]
        return self

    def along(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """``J(x) q``, (N, m), for states X (N, n) and directions (N, d)."""
        return np.einsum("nmd,nd->nm", self.jacobian(X), directions)

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """``J(x)ᵀ λ``, (N, d), for states X (N, n) and λ (m,)."""
        return np.einsum("nmd,m->nd", self.jacobian(X), w)
