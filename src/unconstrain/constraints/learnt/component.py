"""The part of the actions that stays the same while a task varies."""

from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator
from sklearn.utils.validation import check_is_fitted

from unconstrain.arrays import SQUARABLE, check_actions, check_number, check_samples, check_states
from unconstrain.errors import DataError
from unconstrain.features.base import Features, fit_features
from unconstrain.features.full import as_features
from unconstrain.motion import root_mean_square
from unconstrain.undo import undone_on_failure

OTHER_STARTS = 4
"""Starts besides regression, scattered around it by its own size."""


class NullspaceComponent(BaseEstimator):
    """The part ``ũ(x) ≈ N(x) π(x)`` of actions ``u = A⁺(x) b + N(x) π(x)`` whose task part ``A⁺b`` varies.

    Parameters
    ----------
    features : transformer or feature map, optional
        Of ũ, as for `ParametricPolicy`; ``(x, 1)`` by default.
    alpha : float
        Weight decay λ of ``E(w) + λ‖w‖²``.

    Attributes
    ----------
    weights_ : ndarray of shape (P,)
        Parameters of ũ.
    features_ : feature map
        As fitted.
    cost_ : float
        Mean of E over the samples, in squared units of the action.
    n_evaluations_ : int
        Evaluations of E that the minimisation took.

    Notes
    -----
    The two parts are at right angles, so the projection of u on the direction of the nullspace component is that
    component, whatever the task did. With ``P_n`` the projection on ``ũ(x_n)``,

        E(ũ) = Σ_n ‖P_n u_n - ũ(x_n)‖² = Σ_n (ũ_n·u_n / ‖ũ_n‖ - ‖ũ_n‖)²,

    minimised by nonlinear least squares (SciPy), started from direct regression, which is right where the task part
    averages out. Where it does not vary it cannot be told apart, and the minimum is not unique.

    References
    ----------
    Towell, Howard, Vijayakumar, "Learning nullspace policies", IROS 2010.
    """

    n_actions_: int
    features_: Features
    weights_: np.ndarray

    def __init__(self, features: object = None, alpha: float = 1e-6):
        self.features = features
        self.alpha = alpha

    @undone_on_failure
    def fit(self, X: ArrayLike, U: ArrayLike, *, groups: ArrayLike | None = None) -> Self:
        """Learn from recordings in which the task part varies.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.
        U : array_like of shape (N, d)
            Actions, d > 1.
        groups : array_like of shape (N,), optional
            Episodes; they change nothing.

        Returns
        -------
        NullspaceComponent
            Itself, fitted.

        Raises
        ------
        DataError
            For bad arrays, one action dimension, or no motion.
        PolicyError
            For bad options.
        """
        from scipy.optimize import least_squares  # slow to import

        X, U = check_samples(self, X, U, reset=True, min_samples=2)
        U = check_actions(U)
        alpha = check_number(self.alpha, "alpha", positive=False)
        if U.shape[1] < 2:
            raise DataError("a task and a nullspace component need two or more actions between them, got 1")
        if not U.any():
            raise DataError("all actions are zero: there is nothing to separate")
        self.features_ = fit_features(as_features(self.features), X, U.shape[1])
        self.n_actions_ = U.shape[1]
        scale = root_mean_square(U)
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
        # The error has local minima, and regression starts near one of them in about one problem of sixty.
        scatter = np.random.default_rng(0).normal(size=(OTHER_STARTS, len(start)))
        starts = [start, *(start + np.sqrt(np.mean(start**2)) * scatter)]
        tried = [
            least_squares(residuals, w, jac=jacobian, xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=500)
            for w in starts
        ]
        best = min(tried, key=lambda found: found.cost)
        self.weights_ = best.x * scale
        self.cost_ = float(np.mean(residuals(best.x)[: len(X)] ** 2) * scale**2)
        self.n_evaluations_ = sum(int(found.nfev) for found in tried)
        return self

    def predict(self, X: ArrayLike) -> np.ndarray:
        """Compute the component at states.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, d)
            ``ũ(x)``.
        """
        check_is_fitted(self)
        return self.features_.evaluate(check_states(self, X), self.weights_)

    def score(self, X: ArrayLike, U: ArrayLike) -> float:
        """Compute how well the component and a varying task part explain the motion.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.
        U : array_like of shape (N, d)
            Actions.

        Returns
        -------
        float
            ``1 - E(ũ) / Σ ‖u‖²``, at most 1.

        Raises
        ------
        DataError
            If nothing moves.
        """
        U, P = check_actions(U), self.predict(X)
        if U.shape != P.shape:
            raise DataError(f"actions {U.shape} and predictions {P.shape} must have the same shape")
        scale = root_mean_square(U)
        if scale == 0.0:
            raise DataError("all actions are zero: there is nothing to explain")
        if np.abs(P).max() / SQUARABLE > scale:
            raise DataError(
                "predictions are so much larger than the actions that their squares cannot be compared"
            )
        U, P = U / scale, P / scale
        length = np.linalg.norm(P, axis=1)
        along = np.divide(np.einsum("nd,nd->n", P, U), length, out=np.zeros_like(length), where=length > 0)
        return 1.0 - float(np.mean((along - length) ** 2))
