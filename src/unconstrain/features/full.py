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
from unconstrain.features.bases import Compilable, adapted, compilation_error


class FullFeatures(BaseEstimator):
    """The features of `π(x) = W b(x)` with W (d, M) free.

    Parameters
    ----------
    transformer : scikit-learn transformer, optional
        Its output is `b(x)`. It is cloned, never changed. None stands for the linear policy, `b(x) = (x, 1)`.

    Attributes
    ----------
    transformer_ : transformer or None
        The fitted copy.
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
        self.transformer_ = (
            None if self.transformer is None else fit_transformer(self.transformer, X, sample_weight)
        )
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
            # Stored a row a feature, as products are formed.
            rows = np.empty((X.shape[1] + 1, len(X)))
            rows[:-1], rows[-1] = X.T, 1.0
            return rows.T
        B = self.transformer_.transform(X.astype(np.float64, copy=False))
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
        return self.basis(X) @ w.reshape(self.n_actions_, -1).T

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
        W = w.reshape(self.n_actions_, -1)
        if self.transformer_ is None:
            return Linear(coef=W[:, :-1], intercept=W[:, -1])
        basis = adapted(self.transformer_)
        if not isinstance(basis, Compilable):
            raise compilation_error(self.transformer_)
        return basis.compile(W)


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
