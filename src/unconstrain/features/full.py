"""Full features: every action has its own weights on one shared basis, `π(x) = W b(x)`.

With the parameters in the order of W's rows, `w = vec(Wᵀ)`, an observation along q has the features `v = q ⊗ b(x)`,
and a sum of `v vᵀ` is a sum of `(q qᵀ) ⊗ (b bᵀ)`: symmetric in both factors. `fitting.kernels` makes use of that.

References
----------
Howard et al., ICRA 2009, Sec. III-A.
"""

from typing import Any

import numpy as np
from sklearn.base import BaseEstimator

from unconstrain.arrays import quote
from unconstrain.deploy.compiled import CompiledPolicy, Linear
from unconstrain.errors import PolicyError
from unconstrain.features.base import Features, fit_transformer, is_feature_map
from unconstrain.features.bases import (
    Blending,
    Compilable,
    adapted,
    compilation_error,
    constant_outputs,
    scaling_for,
)
from unconstrain.features.scaling import NO_SPREAD, Scaling

BLOCK_ROWS = 4096


class FullFeatures(BaseEstimator):
    """The features of `π(x) = W b(x)` with W (d, M) free.

    Parameters
    ----------
    transformer : scikit-learn transformer, optional
        Its output is `b(x)`. It is cloned, never changed. None stands for the linear policy, `b(x) = (z, 1)` with z
        the standardised state. Polynomials are of z as well; other transformers get the state as it is.

    Attributes
    ----------
    transformer_ : transformer or None
        The fitted copy.
    scaling_ : Scaling or None
        Of the states that the basis is a function of; None for the state as it is.
    n_actions_ : int
        d.

    Raises
    ------
    PolicyError
        `transformer` is not a transformer.
    """

    def __init__(self, transformer: Any = None):
        if transformer is not None and not (
            hasattr(transformer, "fit") and hasattr(transformer, "transform")
        ):
            raise PolicyError(
                f"features must be policy features or a scikit-learn transformer, got {quote(transformer)}"
            )
        self.transformer = transformer

    def fit(self, X: np.ndarray, d: int, sample_weight: np.ndarray | None = None) -> "FullFeatures":
        """Fit the transformer.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        d : int
            Dimension of the actions.
        sample_weight : ndarray of shape (N,), optional
            Passed on where the transformer takes it.

        Returns
        -------
        self
            Fitted.
        """
        self.scaling_: Scaling | None
        if self.transformer is None:
            self.scaling_ = Scaling.of(X, sample_weight)
            self.transformer_ = None
        else:
            self.scaling_ = scaling_for(self.transformer, X, sample_weight)
            Z = X if self.scaling_ is None else self.scaling_(X)
            self.transformer_ = fit_transformer(self.transformer, Z, sample_weight)
        self.n_actions_ = d
        return self

    def basis(self, X: np.ndarray) -> np.ndarray:
        """Compute the basis that all actions share.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States, of any precision.

        Returns
        -------
        ndarray of shape (N, M)
            `b(x)`, in double precision.
        """
        if self.transformer_ is None:
            return self._standardized(X, np.empty((X.shape[1] + 1, len(X))))
        Z = X.astype(np.float64, copy=False) if self.scaling_ is None else self.scaling_(X)
        B = self.transformer_.transform(Z)
        return np.asarray(B.toarray() if hasattr(B, "toarray") else B, dtype=np.float64)

    def along(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Compute the features along one direction at each state.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        directions : ndarray of shape (N, d)
            One for each state, of any length.

        Returns
        -------
        ndarray of shape (N, dM)
            `v = q ⊗ b(x)`.
        """
        return (directions[:, :, None] * self.basis(X)[:, None, :]).reshape(len(X), -1)

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Evaluate the policy.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        w : ndarray of shape (dM,)
            Parameters.

        Returns
        -------
        ndarray of shape (N, d)
            `π(x) = W b(x)`.
        """
        W = w.reshape(self.n_actions_, -1)
        if self.transformer_ is not None:
            if isinstance(self.transformer_, Blending) and self.scaling_ is None:
                return self.transformer_.blend(X.astype(np.float64, copy=False), W)
            return self.basis(X) @ W.T
        # In blocks that stay in the processor's cache.
        actions, rows = np.empty((len(X), len(W))), np.empty((X.shape[1] + 1, min(len(X), BLOCK_ROWS)))
        for start in range(0, len(X), BLOCK_ROWS):
            x = X[start : start + BLOCK_ROWS]
            np.matmul(self._standardized(x, rows[:, : len(x)]), W.T, out=actions[start : start + len(x)])
        return actions

    def decay_basis(self, second: np.ndarray) -> tuple[np.ndarray | None, np.ndarray]:
        """Standardise linear features by their own moments, and name the intercept.

        Parameters
        ----------
        second : ndarray of shape (M, M)
            Sum of `b(x) b(x)ᵀ` over the samples.

        Returns
        -------
        basis : ndarray of shape (M, M) or None
            None for features other than linear ones.
        intercepts : ndarray of shape (M,), bool
            The functions that are known to be constant.
        """
        M = len(second)
        if self.transformer_ is not None:
            return None, np.isin(np.arange(M), constant_outputs(self.transformer_))
        weight = second[-1, -1] if second[-1, -1] > 0 else 1.0
        mean, square = second[:-1, -1] / weight, np.diagonal(second)[:-1] / weight
        spread = np.sqrt(np.maximum(square - mean**2, 0.0))
        # What is left of a column without spread is rounding, also of the difference above.
        spread = np.where(spread > NO_SPREAD + 1e-7 * np.abs(mean), spread, 1.0)
        basis = np.eye(M)
        basis[-1, :-1] = -mean / spread
        basis[np.arange(M - 1), np.arange(M - 1)] = 1.0 / spread
        return basis, np.arange(M) == M - 1

    def linear(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Split the parameters of a linear policy into slopes and intercepts, in the units of the user's states.

        Parameters
        ----------
        w : ndarray of shape (..., dM)
            Parameters.

        Returns
        -------
        tuple of ndarray of shape (..., d, n) and ndarray of shape (..., d), or None
            None for features on a transformer.
        """
        if self.transformer_ is not None:
            return None
        W = w.reshape(*w.shape[:-1], self.n_actions_, -1)
        mean, spread = self._standard
        coef = W[..., :-1] / spread
        return coef, W[..., -1] - coef @ mean

    def compile(self, w: np.ndarray) -> CompiledPolicy:
        """Compile the policy for a control loop.

        Parameters
        ----------
        w : ndarray of shape (dM,)
            Parameters.

        Returns
        -------
        CompiledPolicy
            The same policy, as arrays.

        Raises
        ------
        PolicyError
            It is not known how policies on this transformer are compiled.
        """
        linear = self.linear(w)
        if linear is not None:
            return Linear(coef=linear[0], intercept=linear[1])
        basis = adapted(self.transformer_)
        if not isinstance(basis, Compilable):
            raise compilation_error(self.transformer_)
        return basis.compile(w.reshape(self.n_actions_, -1))

    def _standardized(self, X: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Return the linear features of states (N, n), stored a row a feature, as products are formed: (n + 1, N)."""
        mean, spread = self._standard
        np.subtract(X.T, mean[:, None], out=rows[:-1])
        rows[:-1] /= spread[:, None]
        rows[-1] = 1.0
        return rows.T

    @property
    def _standard(self) -> tuple[np.ndarray, np.ndarray]:
        """Mean and spread of the states that linear features count from and in."""
        assert self.scaling_ is not None
        return self.scaling_.mean, self.scaling_.spread


def as_features(given: Any) -> Features:
    """Make the feature map that an argument `features=` stands for.

    Parameters
    ----------
    given : Features, scikit-learn transformer, or None
        A transformer stands for the full features on it, None for those of the linear policy.

    Returns
    -------
    Features
        Not fitted yet.

    Raises
    ------
    PolicyError
        It is none of these.
    """
    return given if is_feature_map(given) else FullFeatures(given)
