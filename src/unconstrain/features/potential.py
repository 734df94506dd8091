"""Potential features: the policy goes down a potential, `π(x) = -∇Φ(x)` with `Φ(x) = wᵀ b(x)`.

An observation along q has the features `v = -J_b(x) q`, the slopes of the basis functions down that direction. One
function of the state has to explain all n actions, where full features have a function for each: reaching, avoiding and
resting movements are often of this kind. A policy that circulates, such as a limit cycle, is not.
"""

from typing import Any

import numpy as np
from sklearn.base import BaseEstimator

from unconstrain.deploy.compiled import CompiledPolicy
from unconstrain.features.base import check_square, fit_transformer
from unconstrain.features.bases import (
    CompilableDescent,
    adapted,
    compilation_error,
    differentiable,
    scaling_for,
)
from unconstrain.features.rbf import NormalizedRBF

BLOCK_ROWS = 4096


class PotentialFeatures(BaseEstimator):
    """The features of `π(x) = -∇Φ(x)`, `Φ(x) = wᵀ b(x)`.

    They need as many actions as states, in the same coordinates. The potential's constant is not determined by any
    movement; the solution of least norm settles it.

    Parameters
    ----------
    transformer : transformer, optional
        `b(x)`: a `NormalizedRBF`, or scikit-learn's `SplineTransformer` (the potential is then a sum of functions of
        one state each) or `PolynomialFeatures` (degree 2: all linear policies that have a potential). It is cloned,
        never changed. None stands for `NormalizedRBF(100)`.

    Attributes
    ----------
    transformer_ : transformer
        The fitted copy.
    scaling_ : Scaling or None
        Of the states that polynomials are functions of; None for other transformers, which get the state as it is.

    Examples
    --------
    >>> import numpy as np, unconstrain as uc
    >>> X = np.random.default_rng(0).uniform(-1, 1, size=(500, 2))
    >>> N = uc.constraints.projection(np.random.default_rng(1).normal(size=(500, 1, 2)))
    >>> Pi = -X * np.exp(-np.sum(X**2, axis=1, keepdims=True))
    >>> U = np.einsum("nij,nj->ni", N, Pi)
    >>> policy = uc.ParametricPolicy(uc.PotentialFeatures()).fit(X, U)
    >>> bool(uc.metrics.unconstrained_policy_error(Pi, policy.predict(X)) < 1e-4)
    True
    """

    def __init__(self, transformer: Any = None):
        self.transformer = transformer

    def fit(self, X: np.ndarray, d: int, sample_weight: np.ndarray | None = None) -> "PotentialFeatures":
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

        Raises
        ------
        PolicyError
            d is not n, or the gradient of the transformer is not known.
        """
        check_square("PotentialFeatures", X, d)
        transformer = NormalizedRBF(100) if self.transformer is None else self.transformer
        differentiable(transformer)
        self.scaling_ = scaling_for(transformer, X, sample_weight, constant=False)
        self.transformer_ = fit_transformer(transformer, self._standardize(X), sample_weight)
        return self

    def along(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Compute the features along one direction at each state.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        directions : ndarray of shape (N, n)
            One for each state, of any length.

        Returns
        -------
        ndarray of shape (N, M)
            `v = -J_b(x) q`.
        """
        q = directions if self.scaling_ is None else directions / self.scaling_.spread
        V = differentiable(self.transformer_).slopes(self._standardize(X), q)
        return np.negative(V, out=V)

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Evaluate the policy.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        w : ndarray of shape (M,)
            Parameters.

        Returns
        -------
        ndarray of shape (N, n)
            `π(x) = -∇Φ(x)`.
        """
        basis = differentiable(self.transformer_)
        actions = np.empty_like(X, dtype=np.float64)
        for start in range(0, len(X), BLOCK_ROWS):
            rows = slice(start, start + BLOCK_ROWS)
            actions[rows] = -basis.gradient(self._standardize(X[rows]), w)
        return actions if self.scaling_ is None else actions / self.scaling_.spread

    def compile(self, w: np.ndarray) -> CompiledPolicy:
        """Compile the policy for a control loop.

        Parameters
        ----------
        w : ndarray of shape (M,)
            Parameters.

        Returns
        -------
        CompiledPolicy
            The same policy, as arrays.

        Raises
        ------
        PolicyError
            It is not known how potentials of this transformer are compiled.
        """
        basis = adapted(self.transformer_)
        if not isinstance(basis, CompilableDescent):
            raise compilation_error(self.transformer_)
        return basis.compile_descent(w)

    def potential(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Evaluate the potential, up to a constant.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        w : ndarray of shape (M,)
            Parameters.

        Returns
        -------
        ndarray of shape (N,)
            `Φ(x)`.
        """
        return self.transformer_.transform(self._standardize(X)) @ w

    def _standardize(self, X: np.ndarray) -> np.ndarray:
        return X if self.scaling_ is None else self.scaling_(X)
