"""Decoupled features: each joint's policy depends on that joint alone, `pi_j(x) = w_jᵀ b_j(x_j)`.

With the parameters of the n actions one after the other, what is seen along q is
`v = (q_1 b_1(x_1), ..., q_n b_n(x_n))`:
n k parameters where full features on the same splines have n² k. An action seen along one direction then tells much
more about each, and from the same data far more is learnt, if the policy is of this kind; springs, attractors and
joint-limit avoidance in joint space are.

The weight decay is to mean smoothness: a plain λ‖w‖² would pull splines that few samples touch, at the ends of the
range, to zero, and the policy would break off there. So the parameters are the second differences of the splines'
coefficients, and the least of a straight line (P-splines: Eilers and Marx, Flexible smoothing with B-splines and
penalties, 1996); where there are no data, the policy goes on straight.
"""

import numpy as np
from numpy.polynomial.legendre import legvander
from sklearn.base import BaseEstimator
from sklearn.preprocessing import SplineTransformer

from unconstrain.arrays import check_choice
from unconstrain.errors import PolicyError
from unconstrain.features.base import check_square

EXTRAPOLATIONS = ("linear", "constant", "continue")

# A joint whose range is this much smaller than its value has not moved; its spline then spans a unit about it.
NO_RANGE = 1e-9

# How much a straight line's size is penalised against its bends: little, but enough that no λ leaves it undetermined.
LINE = 0.01


class DecoupledFeatures(BaseEstimator):
    """`pi_j(x) = w_jᵀ b_j(x_j)`, with B-splines `b_j` in one dimension, by scikit-learn's `SplineTransformer`.

    Needs as many actions as states, action j belonging to state j (a joint's velocity to its angle).

    n_knots: knots per dimension, evenly over the data's range; each dimension has n_knots + degree - 1 parameters.
    degree: of the polynomials between knots.
    extrapolation: beyond the data's range "linear" goes on with the slope at its border, "constant" with the value,
        and "continue" with the last polynomial, which soon grows beyond reason.

    The splines of a dimension sum to one, so a constant policy can be represented; a straight one too. After `fit` the
    coefficients of joint j's splines are `to_coefficients_ @ w_j`.

    >>> import numpy as np, unconstrain as uc
    >>> X = np.random.default_rng(0).uniform(-1, 1, size=(500, 3))
    >>> N = uc.constraints.projection(np.random.default_rng(1).normal(size=(500, 1, 3)))
    >>> U = np.einsum("nij,nj->ni", N, -np.sin(3 * X))
    >>> policy = uc.ParametricPolicy(uc.DecoupledFeatures(), alpha="cv").fit(X, U)
    >>> bool(uc.metrics.unconstrained_policy_error(-np.sin(3 * X), policy.predict(X)) < 1e-6)
    True
    """

    def __init__(self, n_knots=15, *, degree=3, extrapolation="linear"):
        self.n_knots = n_knots
        self.degree = degree
        self.extrapolation = extrapolation

    def fit(self, X: np.ndarray, d: int, sample_weight: np.ndarray | None = None) -> "DecoupledFeatures":
        """Set the knots over the range of states X (N, n) whose weight is not zero.

        Raises `PolicyError` where d is not n, and for numbers of knots or degrees that make no spline.
        """
        check_square("DecoupledFeatures", X, d)
        check_choice(self.extrapolation, "extrapolation", EXTRAPOLATIONS)
        for name, least in (("n_knots", 2), ("degree", 1)):
            value = getattr(self, name)
            if not isinstance(value, int | np.integer) or value < least:
                raise PolicyError(f"{name} must be a whole number of at least {least}, got {value!r}")
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
        self.n_basis_ = self.n_knots + self.degree - 1  # of one dimension
        self.n_parameters_ = d * self.n_basis_
        self.to_coefficients_ = _coefficients_from_differences(self.n_basis_)
        return self

    def along(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """`v = (q_1 b_1(x_1), ..., q_n b_n(x_n))`, (N, n k), for states X (N, n) and directions (N, n)."""
        V = self._basis(X)
        V *= directions[:, :, None]
        return V.reshape(len(X), -1)

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """`pi_j(x) = w_jᵀ b_j(x_j)`: actions (N, n) at states X (N, n) for parameters w (n k,)."""
        return np.einsum("njk,jk->nj", self._basis(X), w.reshape(self.n_actions_, -1))

    def _basis(self, X: np.ndarray) -> np.ndarray:
        """`b_j(x_j)`, seen from the parameters: (N, n, k)."""
        return self.splines_.transform(X).reshape(*X.shape, self.n_basis_) @ self.to_coefficients_


def _coefficients_from_differences(k: int) -> np.ndarray:
    """T (k, k), with `T w` the coefficients of k splines whose line and second differences are w."""
    order = min(2, k - 1)
    bends = np.diff(np.eye(k), order, axis=0)
    line = LINE * legvander(np.linspace(-1.0, 1.0, k), order)[:, :order].T
    return np.linalg.inv(np.vstack([line, bends]))
