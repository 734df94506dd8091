"""Adding samples up into moments, at the speed of matrix multiplication.

With full features `v = q ⊗ b`, so `H = Σ ω (QᵀQ) ⊗ (b bᵀ)`. Both factors are symmetric: of the (dM)² entries of H
only d(d+1)/2 · M(M+1)/2 differ, and they are the entries of one matrix product, distinct products of directions
times distinct products of features. Local models weigh the same products differently, so all of them together
are one matrix product as well. Any other features are summed as `VᵀV`.

Samples are taken in blocks that stay in the processor's cache; no N x P matrix is ever held.
"""

from collections.abc import Iterator

import numpy as np
from scipy.linalg.blas import dsyrk

from unconstrain.features import FullFeatures, PolicyFeatures
from unconstrain.features.centers import activations
from unconstrain.moments import Moments
from unconstrain.risk import Sight

BLOCK_NUMBERS = (
    2**18
)  # of 8 bytes: what the widest array of a block may hold, about a core's second-level cache


def parametric_moments(features: PolicyFeatures, X: np.ndarray, seen: Sight, weights: np.ndarray) -> Moments:
    """Moments of a policy with fitted `features`: states X (N, n), what a risk sees of the actions, weights (N,)."""
    if isinstance(features, FullFeatures):
        if seen.whole:
            return _whole_moments(features, X, seen, weights)
        return _full_moments(features, X, seen, weights)
    return _row_moments(features, X, seen, weights)


def local_moments(
    centers: np.ndarray, width: float, X: np.ndarray, seen: Sight, weights: np.ndarray
) -> Moments:
    """Moments of M local linear models `p_m(x) = B_m (x, 1)`, stacked, weighted by `exp(-‖x - c_m‖² / 2σ²)`.

    Parameters are in the order of B_m's rows. centers (M, n), width σ, states X (N, n), weights (N,).
    """
    M, n = centers.shape
    d = seen.n_actions
    pairs_b, pairs_q = _pairs(n + 1), (1 if seen.whole else _pairs(d))
    products = np.zeros((M, pairs_b * pairs_q))
    g = np.zeros((M, d * (n + 1)))
    squares, weight = np.zeros(M), np.zeros(M)
    for block in _blocks(len(X), pairs_b * pairs_q):
        B = _with_one(X[block])
        receptive = activations(X[block], centers, width)
        receptive *= weights[block, None]
        part = seen[block]
        columns = distinct_products(B)
        if not seen.whole:
            columns = (columns[:, None, :] * _seen_products(part)[None, :, :]).reshape(-1, len(B))
        products += receptive.T @ columns.T
        pulls = (_pull(part).T[:, None, :] * B.T[None, :, :]).reshape(-1, len(B))
        g += receptive.T @ pulls.T
        squares += part.squares @ receptive
        weight += receptive.sum(axis=0)
    if seen.whole:
        return Moments(
            products[:, _pair_index(n + 1)], g.reshape(M, d, n + 1).swapaxes(1, 2), squares, weight, len(X)
        )
    H = _unfold(products.reshape(M, pairs_b, pairs_q), n + 1, d)
    return Moments(H, g[:, :, None], squares, weight, len(X))


def distinct_products(A: np.ndarray) -> np.ndarray:
    """Products a_i a_j, i <= j, of the columns of A (N, k): rows in the order of the upper triangle, (k(k+1)/2, N)."""
    k = A.shape[1]
    T = np.ascontiguousarray(A.T)
    products = np.empty((_pairs(k), len(A)))
    row = 0
    for i in range(k):
        np.multiply(T[i], T[i:], out=products[row : row + k - i])
        row += k - i
    return products


def _full_moments(features: FullFeatures, X: np.ndarray, seen: Sight, weights: np.ndarray) -> Moments:
    M, d = features.n_basis_, seen.n_actions
    g = np.zeros((d, M))
    squares = weight = 0.0
    products = np.zeros((_pairs(M), _pairs(d)))
    for block in _blocks(len(X), _pairs(M) + _pairs(d)):
        B, part, omega = features.basis(X[block]), seen[block], weights[block]
        products += distinct_products(B) @ (_seen_products(part) * omega).T
        g += (_pull(part) * omega[:, None]).T @ B
        squares += part.squares @ omega
        weight += omega.sum()
    H = _unfold(products, M, d)
    return Moments(H, g.reshape(-1, 1), np.asarray(squares), np.asarray(weight), len(X))


def _whole_moments(features: FullFeatures, X: np.ndarray, seen: Sight, weights: np.ndarray) -> Moments:
    """Nothing is projected: `H = (Σ ω b bᵀ) ⊗ I`, so the d dimensions of the action share the M x M block."""
    total = Moments.zeros((), features.n_basis_, seen.n_actions)
    for block in _blocks(len(X), features.n_basis_):
        B, part, omega = features.basis(X[block]), seen[block], weights[block]
        weighted = (B * omega[:, None]).T
        total.H += weighted @ B
        total.g += weighted @ part.targets
        total.squares += part.squares @ omega
        total.weight += omega.sum()
    total.n_samples = len(X)
    return total


def _row_moments(features: PolicyFeatures, X: np.ndarray, seen: Sight, weights: np.ndarray) -> Moments:
    total = Moments.zeros((), features.n_parameters_, 1)
    H = np.zeros_like(total.H, order="F")
    for block in _blocks(len(X), features.n_parameters_):
        part, root = seen[block], np.sqrt(weights[block])
        for k in range(part.targets.shape[1]):
            V = features.along(X[block], part.rows[:, k]) * root[:, None]
            H = dsyrk(1.0, V.T, beta=1.0, c=H, overwrite_c=True)
            total.g[:, 0] += V.T @ (part.targets[:, k] * root)
        total.squares += part.squares @ weights[block]
        total.weight += weights[block].sum()
    total.H = np.triu(H) + np.triu(H, 1).T
    total.n_samples = len(X)
    return total


def _seen_products(seen: Sight) -> np.ndarray:
    """The distinct entries of `QᵀQ`, (d(d+1)/2, N)."""
    if seen.rows.shape[1] == 1:
        return distinct_products(seen.rows[:, 0])
    i, j = np.triu_indices(seen.n_actions)
    return np.einsum("nki,nkj->nij", seen.rows, seen.rows)[:, i, j].T


def _pull(seen: Sight) -> np.ndarray:
    """`QᵀQ u`, (N, d)."""
    return np.einsum("nki,nk->ni", seen.rows, seen.targets)


def _unfold(products: np.ndarray, M: int, d: int) -> np.ndarray:
    """H (..., dM, dM) from its distinct entries (..., M(M+1)/2, d(d+1)/2)."""
    over_q = products[..., _pair_index(d)]  # (..., pairs of b, d, d)
    full = np.moveaxis(over_q, -3, -1)[..., _pair_index(M)]  # (..., d, d, M, M)
    return np.ascontiguousarray(full.swapaxes(-2, -3)).reshape(*products.shape[:-2], d * M, d * M)


def _pairs(k: int) -> int:
    return k * (k + 1) // 2


def _pair_index(k: int) -> np.ndarray:
    """Where the product of columns i and j stands among the distinct ones, (k, k)."""
    index = np.empty((k, k), dtype=np.intp)
    i, j = np.triu_indices(k)
    index[i, j] = index[j, i] = np.arange(len(i))
    return index


def _with_one(X: np.ndarray) -> np.ndarray:
    return np.column_stack([X, np.ones(len(X))])


def _blocks(n_samples: int, width: int) -> Iterator[slice]:
    rows = max(64, BLOCK_NUMBERS // max(width, 1))
    for start in range(0, n_samples, rows):
        yield slice(start, min(start + rows, n_samples))
