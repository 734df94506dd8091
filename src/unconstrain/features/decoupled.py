"""Decoupled features: each joint's policy depends on that joint alone, `π_j(x) = w_jᵀ b_j(x_j)`.

With the parameters of the n actions one after the other, an observation along q has the features
`v = (q_1 b_1(x_1), ..., q_n b_n(x_n))`: n k parameters where full features on the same splines have n² k. An action
seen along one direction then tells much more about each, and from the same data far more is learnt, if the policy is of
this kind; springs, attractors and joint-limit avoidance in joint space are.

The weight decay should make policies smooth. A plain λ‖w‖² would pull splines that few samples touch, at the ends of
the range, to zero, and the policy would break off there. So the parameters are the second differences of the splines'
coefficients, and a little of a straight line (P-splines); where there are no data, the policy goes on straight.

References
----------
Eilers and Marx, Flexible smoothing with B-splines and penalties, 1996.
"""

import numpy as np
from numpy.polynomial.legendre import legvander
from sklearn.base import BaseEstimator
from sklearn.preprocessing import SplineTransformer

from unconstrain.arrays import check_choice, quote
from unconstrain.deploy.compiled import CompiledPolicy
from unconstrain.errors import PolicyError
from unconstrain.features.base import check_square
from unconstrain.features.splines import EXTRAPOLATIONS, Splines

# A joint whose range is this much smaller than its value has not moved; its spline then spans a unit about it.
NO_RANGE = 1e-9

# How much a straight line's size is penalised against its bends: little, but enough that no λ leaves it undetermined.
LINE = 0.01


class DecoupledFeatures(BaseEstimator):
    """The features of `π_j(x) = w_jᵀ b_j(x_j)`, with B-splines `b_j` in one dimension.

    They need as many actions as states, action j belonging to state j (a joint's velocity to its angle). The splines of
    a dimension sum to one, so a constant policy can be represented; a straight one too.

    Parameters
    ----------
    n_knots : int
        Knots in each dimension, evenly over the data's range; each dimension has n_knots + degree - 1 parameters. The
        weight decay makes the policy smooth where more knots than needed are given, so there are enough of them for
        policies with a corner.
    degree : int
        Of the polynomials between knots.
    extrapolation : {"linear", "constant", "continue"}
        Beyond the data's range "linear" goes on with the slope at its border, "constant" with the value, and "continue"
        with the last polynomial, which soon grows beyond reason.

    Attributes
    ----------
    splines_ : SplineTransformer
        The splines of all dimensions.
    to_coefficients_ : ndarray of shape (k, k)
        The coefficients of joint j's splines are `to_coefficients_ @ w_j`.
    n_actions_ : int
        d = n.

    Examples
    --------
    >>> import numpy as np, unconstrain as uc
    >>> X = np.random.default_rng(0).uniform(-1, 1, size=(500, 3))
    >>> N = uc.constraints.projection(np.random.default_rng(1).normal(size=(500, 1, 3)))
    >>> U = np.einsum("nij,nj->ni", N, -np.sin(3 * X))
    >>> policy = uc.ParametricPolicy(uc.DecoupledFeatures(), risk="inconsistency").fit(X, U)
    >>> bool(uc.metrics.unconstrained_policy_error(-np.sin(3 * X), policy.predict(X)) < 1e-6)
    True
    """

    def __init__(self, n_knots: int = 31, *, degree: int = 3, extrapolation: str = "linear"):
        self.n_knots = n_knots
        self.degree = degree
        self.extrapolation = extrapolation

    def fit(self, X: np.ndarray, d: int, sample_weight: np.ndarray | None = None) -> "DecoupledFeatures":
        """Set the knots over the range of the states whose weight is not zero.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        d : int
            Dimension of the actions.
        sample_weight : ndarray of shape (N,), optional
            Weight of each sample, 1 by default.

        Returns
        -------
        self
            Fitted.

        Raises
        ------
        PolicyError
            d is not n, or the numbers of knots or the degree make no spline.
        """
        check_square("DecoupledFeatures", X, d)
        check_choice(self.extrapolation, "extrapolation", EXTRAPOLATIONS)
        for name, least in (("n_knots", 2), ("degree", 1)):
            value = getattr(self, name)
            if not isinstance(value, int | np.integer) or value < least:
                raise PolicyError(f"{name} must be a whole number of at least {least}, got {quote(value)}")
        if sample_weight is not None:
            X = X[sample_weight > 0]
        low, high = X.min(axis=0), X.max(axis=0)
        still = high - low <= NO_RANGE * np.maximum(np.abs(low), np.abs(high))
        margin = np.where(still, 0.5 * np.maximum(np.abs(low), 1.0), 0.0)
        knots = np.linspace(low - margin, high + margin, self.n_knots)
        # For straight pieces both are the same, but scikit-learn 1.9 gets "linear" right in the first dimension only.
        straight = self.degree == 1 and self.extrapolation == "linear"
        self.splines_ = SplineTransformer(
            knots=knots, degree=self.degree, extrapolation="continue" if straight else self.extrapolation
        ).fit(knots)
        self.n_actions_ = d
        self.to_coefficients_ = _coefficients_from_differences(self.n_knots + self.degree - 1)
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
        ndarray of shape (N, n k)
            `v = (q_1 b_1(x_1), ..., q_n b_n(x_n))`.
        """
        V = self._splines(X)
        V *= directions[:, :, None]
        return V.reshape(len(X), -1)

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Evaluate the policy.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        w : ndarray of shape (n k,)
            Parameters.

        Returns
        -------
        ndarray of shape (N, n)
            `π_j(x) = w_jᵀ b_j(x_j)`.
        """
        return np.einsum("njk,jk->nj", self._splines(X), w.reshape(self.n_actions_, -1))

    def compile(self, w: np.ndarray) -> CompiledPolicy:
        """Compile the policy for a control loop.

        Parameters
        ----------
        w : ndarray of shape (n k,)
            Parameters.

        Returns
        -------
        CompiledPolicy
            The same policy, as arrays.
        """
        n = self.n_actions_
        own = w.reshape(n, -1) @ self.to_coefficients_.T
        coefficients = np.zeros((*own.shape, n))
        coefficients[np.arange(n), :, np.arange(n)] = own
        return Splines(self.splines_).combined(coefficients)

    def _splines(self, X: np.ndarray) -> np.ndarray:
        """Compute the functions whose weights the parameters are, (N, n, k)."""
        return self.splines_.transform(X).reshape(*X.shape, -1) @ self.to_coefficients_


def _coefficients_from_differences(k: int) -> np.ndarray:
    """T (k, k), with `T w` the coefficients of k splines whose line and second differences are w."""
    order = min(2, k - 1)
    bends = np.diff(np.eye(k), order, axis=0)
    line = LINE * legvander(np.linspace(-1.0, 1.0, k), order)[:, :order].T
    return np.linalg.inv(np.vstack([line, bends]))
