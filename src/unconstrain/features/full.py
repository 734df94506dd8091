"""Full features: every action has its own weights on one shared basis, `pi(x) = W b(x)`.

With the parameters in the order of W's rows, `w = vec(Wᵀ)`, what is seen along q is `v = q ⊗ b(x)`, and a sum of
`v vᵀ` is a sum of `(q qᵀ) ⊗ (b bᵀ)`: symmetric in both factors. `moments` makes use of that.
Source: ICRA 2009, Sec. III-A.
"""

import numpy as np
from sklearn.base import BaseEstimator, clone

from unconstrain.errors import PolicyError
from unconstrain.features.base import PolicyFeatures, fitted, is_policy_features


def with_one(X: np.ndarray) -> np.ndarray:
    """`(x, 1)` of states X (N, n): (N, n + 1), in double precision; stored a row a feature, as products are formed."""
    rows = np.empty((X.shape[1] + 1, len(X)))
    rows[:-1], rows[-1] = X.T, 1.0
    return rows.T


class FullFeatures(BaseEstimator):
    """`pi(x) = W b(x)` with W (d, M) free.

    transformer: any scikit-learn transformer whose output is `b(x)`, or None for the linear policy,
        `b(x) = (x, 1)`. It is cloned, never changed.
    """

    def __init__(self, transformer=None):
        if transformer is not None and not (
            hasattr(transformer, "fit") and hasattr(transformer, "transform")
        ):
            raise PolicyError(
                f"features must be policy features or a scikit-learn transformer, got {transformer!r}"
            )
        self.transformer = transformer

    def fit(self, X: np.ndarray, d: int, sample_weight: np.ndarray | None = None) -> "FullFeatures":
        """Fit the transformer to states X (N, n), with weights (N,) where it takes them."""
        self.transformer_ = None if self.transformer is None else fitted(self.transformer, X, sample_weight)
        self.n_actions_ = d
        self.n_basis_ = self.basis(X[:1]).shape[1]
        self.n_parameters_ = d * self.n_basis_
        return self

    def basis(self, X: np.ndarray) -> np.ndarray:
        """`b(x)` at states X (N, n): an array (N, M)."""
        if self.transformer_ is None:
            return with_one(X)
        B = self.transformer_.transform(X.astype(np.float64, copy=False))
        return np.asarray(B.toarray() if hasattr(B, "toarray") else B, dtype=np.float64)

    def along(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """`v = q ⊗ b(x)`, (N, dM), for states X (N, n) and directions (N, d)."""
        return (directions[:, :, None] * self.basis(X)[:, None, :]).reshape(len(X), -1)

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """`pi(x) = W b(x)`: actions (N, d) at states X (N, n) for parameters w (dM,)."""
        return self.basis(X) @ w.reshape(self.n_actions_, -1).T


def as_policy_features(given) -> PolicyFeatures:
    """What `features=` stands for, not fitted yet: a copy of policy features, or the full features on a transformer.

    Raises `PolicyError` for anything that is neither, nor None.
    """
    return clone(given) if is_policy_features(given) else FullFeatures(given)
