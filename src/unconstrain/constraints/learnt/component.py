"""The part of the actions that stays the same while a task varies."""

import numpy as np
from scipy.optimize import least_squares
from sklearn.base import BaseEstimator
from sklearn.utils.validation import check_is_fitted

from unconstrain.arrays import check_actions, check_number, check_samples, check_states
from unconstrain.errors import DataError
from unconstrain.features.full import as_policy_features


class NullspaceComponent(BaseEstimator):
    """``ũ(x) ≈ N(x) π(x)`` from actions ``u = A⁺(x) b + N(x) π(x)`` whose task part ``A⁺b`` varies between recordings.

    The two parts are at right angles, so the projection of u on the direction of the nullspace component is that
    component, whatever the task did. With ``P_n`` the projection on ``ũ(x_n)``,

        E(ũ) = Σ_n ‖P_n u_n - ũ(x_n)‖² = Σ_n (ũ_n·u_n / ‖ũ_n‖ - ‖ũ_n‖)²,

    minimised by nonlinear least squares (SciPy), started from direct regression, which is right where the task part
    averages out. Where it does not vary it cannot be told apart, and the minimum is not unique.

    features: of ũ, as for `ParametricPolicy`: a transformer, policy features, or None for ``(x, 1)``.
    alpha: weight decay λ of ``E(w) + λ‖w‖²``.

    After `fit`: `weights_` (P,), `features_`, `cost_` (mean E per sample), `n_evaluations_`.

    Source: Towell, Howard, Vijayakumar, "Learning nullspace policies", IROS 2010.
    """

    def __init__(self, features=None, alpha=1e-6):
        self.features = features
        self.alpha = alpha

    def fit(self, X, U, *, groups=None):
        """Learn from states X (N, n) and actions U (N, d), d > 1. `groups` changes nothing.

        Raises `DataError` for bad arrays, one action dimension, or no motion; `PolicyError` for bad options.
        """
        X, y = check_samples(self, X, U, reset=True, min_samples=2)
        U = check_actions(y)
        alpha = check_number(self.alpha, "alpha", positive=False)
        if U.shape[1] < 2:
            raise DataError("a task and a nullspace component need two or more actions between them, got 1")
        if not U.any():
            raise DataError("all actions are zero: there is nothing to separate")
        self.features_ = as_policy_features(self.features).fit(X, U.shape[1])
        self.n_actions_ = U.shape[1]
        scale = np.sqrt(np.mean(np.sum(U**2, axis=1)))
        V = U / scale
        root = np.sqrt(alpha)
        # Component by component, stacked: (d, N, P).
        along = np.stack([self.features_.along(X, np.broadcast_to(e, U.shape)) for e in np.eye(U.shape[1])])
        decay = root * np.eye(along.shape[2])

        def model(w: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            m = (along @ w).T
            length = np.maximum(np.linalg.norm(m, axis=1), 1e-12)
            return m / length[:, None], length, np.einsum("nd,nd->n", m, V) / length

        def residuals(w: np.ndarray) -> np.ndarray:
            _, length, seen = model(w)
            return np.concatenate([seen - length, root * w])

        def jacobian(w: np.ndarray) -> np.ndarray:
            unit, length, seen = model(w)
            slope = (V - seen[:, None] * unit) / length[:, None] - unit
            return np.concatenate([np.einsum("nd,dnp->np", slope, along), decay])

        stacked = along.transpose(1, 0, 2).reshape(-1, along.shape[2])
        start = np.linalg.lstsq(
            np.concatenate([stacked, decay]), np.concatenate([V.ravel(), np.zeros(len(decay))])
        )[0]
        found = least_squares(
            residuals, start, jac=jacobian, xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=500
        )
        self.weights_ = found.x * scale
        self.cost_ = float(np.mean(residuals(found.x)[: len(X)] ** 2) * scale**2)
        self.n_evaluations_ = int(found.nfev)
        return self

    def predict(self, X) -> np.ndarray:
        """The component ``ũ(x)``, (N, d), at states X (N, n)."""
        check_is_fitted(self)
        return self.features_.evaluate(check_states(self, X), self.weights_)

    def score(self, X, U) -> float:
        """``1 - E(ũ) / Σ ‖u‖²``, at most 1, for states X (N, n) and actions U (N, d)."""
        U, P = check_actions(U), self.predict(X)
        motion = float(np.sum(U**2))
        if motion == 0.0:
            raise DataError("all actions are zero: there is nothing to explain")
        length = np.linalg.norm(P, axis=1)
        seen = np.divide(np.einsum("nd,nd->n", P, U), length, out=np.zeros_like(length), where=length > 0)
        return 1.0 - float(np.sum((seen - length) ** 2)) / motion
