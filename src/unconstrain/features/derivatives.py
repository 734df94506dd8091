"""Derivatives of bases `b(x)`, in closed form.

A potential `Φ(x) = wᵀ b(x)` needs two things of its basis: the slopes `qᵀ∇b_i(x)` along one direction a sample, to
learn w, and the gradient `∇Φ(x) = J_b(x)ᵀ w`, to act. Neither needs the Jacobians (N, M, n) of all samples at once.

| basis                 | qᵀ∇b_i(x)                                                                            |
| --------------------- | ------------------------------------------------------------------------------------- |
| `NormalizedRBF`       | b_i (qᵀc_i - Σ_j b_j qᵀc_j) / σ², since ∇ log K_i = (c_i - x) / σ² and x drops out     |
| `SplineTransformer`   | q_j b_i'(x_j), for the splines of dimension j                                         |
| `PolynomialFeatures`  | Σ_k q_k p_ik x_k^(p_ik - 1) Π_(l≠k) x_l^p_il, for the powers p                         |
"""

from typing import Any

import numpy as np
from sklearn.preprocessing import PolynomialFeatures, SplineTransformer

from unconstrain.errors import PolicyError
from unconstrain.features.rbf import NormalizedRBF
from unconstrain.receptive import normalized_activations

BASES = (NormalizedRBF, SplineTransformer, PolynomialFeatures)
EXTRAPOLATIONS = ("constant", "linear", "continue")


def check_differentiable(basis: Any) -> None:
    """Check that the derivative of a basis is known here.

    Parameters
    ----------
    basis : transformer
        Fitted or not.

    Raises
    ------
    PolicyError
        It is not.
    """
    if not isinstance(basis, BASES):
        raise PolicyError(
            f"a potential needs the gradient of its basis, known for {', '.join(b.__name__ for b in BASES)}, "
            f"got {basis!r}"
        )
    if isinstance(basis, SplineTransformer) and basis.extrapolation not in EXTRAPOLATIONS:
        raise PolicyError(
            f"the splines of a potential need an extrapolation out of {', '.join(map(repr, EXTRAPOLATIONS))}, "
            f"got {basis.extrapolation!r}"
        )


def slopes(basis: Any, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Compute the slopes `qᵀ∇b_i(x)` of a basis along one direction at each state.

    Parameters
    ----------
    basis : transformer
        Fitted; one that `check_differentiable` accepts.
    X : array (N, n)
        States.
    directions : array (N, n)
        One for each state, of any length.

    Returns
    -------
    array (N, M)
        Slopes of the M basis functions.
    """
    if isinstance(basis, NormalizedRBF):
        B = normalized_activations(X, basis.centers_, basis.width_)
        pulls = directions @ basis.centers_.T
        pulls -= np.einsum("nm,nm->n", B, pulls)[:, None]
        B *= pulls
        B /= basis.width_  # twice: σ² may be more or less than double precision holds
        B /= basis.width_
        return B
    if isinstance(basis, SplineTransformer):
        return (_spline_slopes(basis, X) * directions[:, :, None]).reshape(len(X), -1)
    powers, table = basis.powers_, _power_table(X, basis.powers_)
    return sum(directions[:, k, None] * _partial(table, powers, k) for k in range(X.shape[1]))


def gradient(basis: Any, X: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Compute the gradient `∇ wᵀb(x)` of a weighted sum of basis functions.

    Parameters
    ----------
    basis : transformer
        Fitted; one that `check_differentiable` accepts.
    X : array (N, n)
        States.
    w : array (M,)
        Weights of the basis functions.

    Returns
    -------
    array (N, n)
        The gradient at each state.
    """
    if isinstance(basis, NormalizedRBF):
        B = normalized_activations(X, basis.centers_, basis.width_)
        heights = B @ w
        return ((B * (w - heights[:, None])) @ basis.centers_) / basis.width_ / basis.width_
    if isinstance(basis, SplineTransformer):
        return np.einsum("njk,jk->nj", _spline_slopes(basis, X), w.reshape(X.shape[1], -1))
    powers, table = basis.powers_, _power_table(X, basis.powers_)
    return np.column_stack([_partial(table, powers, k) @ w for k in range(X.shape[1])])


def _spline_slopes(basis: SplineTransformer, X: np.ndarray) -> np.ndarray:
    """Compute `b_i'(x_j)`, (N, n, k)."""
    columns = []
    for spline, x in zip(basis.bsplines_, X.T, strict=True):
        low, high = spline.t[spline.k], spline.t[-spline.k - 1]
        if basis.extrapolation == "continue":
            columns.append(spline(x, nu=1))
            continue
        columns.append(spline(np.clip(x, low, high), nu=1))
        if basis.extrapolation == "constant":
            columns[-1][(x < low) | (x > high)] = 0.0
    stacked = np.stack(columns, axis=1)
    return stacked if basis.include_bias else stacked[:, :, :-1]


def _power_table(X: np.ndarray, powers: np.ndarray) -> list[np.ndarray]:
    """Compute `x_j^p` for p from 0 to the highest power, an array (N, p + 1) for each dimension."""
    return [np.vander(x, powers.max(initial=0) + 1, increasing=True) for x in X.T]


def _partial(table: list[np.ndarray], powers: np.ndarray, k: int) -> np.ndarray:
    """Compute `∂/∂x_k` of every monomial, (N, M)."""
    result = powers[:, k] * table[k][:, np.maximum(powers[:, k] - 1, 0)]
    for j, column in enumerate(table):
        if j != k:
            result *= column[:, powers[:, j]]
    return result
