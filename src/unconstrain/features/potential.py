"""Potential features: the policy goes down a potential, `pi(x) = -∇Φ(x)` with `Φ(x) = wᵀ b(x)`.

What is seen along q is `v = -J_b(x) q`, the slopes of the basis functions down that direction. One function of the
state has to explain all n actions, where full features have a function for each: reaching, avoiding and resting
movements are often of this kind. What circulates, such as a limit cycle, is not.
"""

import numpy as np
from sklearn.base import BaseEstimator

from unconstrain.features.base import check_square, fitted
from unconstrain.features.derivatives import check_differentiable, gradient, slopes
from unconstrain.features.rbf import NormalizedRBF

BLOCK_ROWS = 4096


class PotentialFeatures(BaseEstimator):
    """`pi(x) = -∇Φ(x)`, `Φ(x) = wᵀ b(x)`.

    Needs as many actions as states, in the same coordinates. The potential's constant is not determined by any
    movement; the solution of least norm settles it.

    basis: `b(x)`, a `NormalizedRBF`, or scikit-learn's `SplineTransformer` (the potential is then a sum of functions of
        one state each) or `PolynomialFeatures` (degree 2: all linear policies that have a potential); None takes
        `NormalizedRBF(100)`. It is cloned, never changed.

    >>> import numpy as np, unconstrain as uc
    >>> X = np.random.default_rng(0).uniform(-1, 1, size=(500, 2))
    >>> N = uc.constraints.projection(np.random.default_rng(1).normal(size=(500, 1, 2)))
    >>> Pi = -X * np.exp(-np.sum(X**2, axis=1, keepdims=True))
    >>> U = np.einsum("nij,nj->ni", N, Pi)
    >>> policy = uc.ParametricPolicy(uc.PotentialFeatures(), alpha="cv").fit(X, U)
    >>> bool(uc.metrics.unconstrained_policy_error(Pi, policy.predict(X)) < 1e-4)
    True
    """

    def __init__(self, basis=None):
        self.basis = basis

    def fit(self, X: np.ndarray, d: int, sample_weight: np.ndarray | None = None) -> "PotentialFeatures":
        """Fit the basis to states X (N, n), with weights (N,) where it takes them.

        Raises `PolicyError` where d is not n, and for a basis whose gradient is not known.
        """
        check_square("PotentialFeatures", X, d)
        basis = NormalizedRBF(100) if self.basis is None else self.basis
        check_differentiable(basis)
        self.basis_ = fitted(basis, X, sample_weight)
        self.n_parameters_ = self.basis_.transform(X[:1]).shape[1]
        return self

    def along(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """`v = -J_b(x) q`, (N, M), for states X (N, n) and directions (N, n)."""
        V = slopes(self.basis_, X, directions)
        return np.negative(V, out=V)

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """`pi(x) = -∇Φ(x)`: actions (N, n) at states X (N, n) for parameters w (M,)."""
        actions = np.empty_like(X, dtype=np.float64)
        for start in range(0, len(X), BLOCK_ROWS):
            rows = slice(start, start + BLOCK_ROWS)
            actions[rows] = -gradient(self.basis_, X[rows], w)
        return actions

    def potential(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """`Φ(x)` at states X (N, n) for parameters w (M,), up to a constant: (N,)."""
        return self.basis_.transform(X) @ w
