"""Adding samples up into moments, at the speed of matrix multiplication.

With full features `v = q ⊗ b`, so `H = Σ ω (QᵀQ) ⊗ (b bᵀ)`. Both factors are symmetric: of the (dM)² entries of H
only d(d+1)/2 · M(M+1)/2 differ, and they are the entries of one matrix product, distinct products of directions
times distinct products of features. Local models weigh the same products differently, so all of them together
are one matrix product as well. Any other features are summed as `VᵀV`.

Samples are taken in blocks that stay in the processor's cache; no N x P matrix is ever held.
"""

import threading
from collections.abc import Callable, Sequence

import numpy as np

from unconstrain.features import FullFeatures, PolicyFeatures
from unconstrain.features.full import with_one
from unconstrain.fitting.kernels.products import distinct_products, n_pairs, pair_index, pairs
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import Sight
from unconstrain.parallel import blocks, shared_out
from unconstrain.receptive import activations

# Numbers of 8 bytes in the widest array of a block. Products are used as soon as they are made, so they should stay
# in a core's own cache; in VᵀV the product's own overhead counts, and is spread over more rows.
PRODUCTS_IN_BLOCK = 2**20
LOCAL_PRODUCTS_IN_BLOCK = 2**19
ROWS_IN_BLOCK = 2**21

# A product of at most so many entries is narrow: it is taken in pieces of so many samples (see `_narrow`).
NARROW = 2**12
SAMPLES_IN_PIECE = 384

# Beyond twelve σ: so little, squared rounding, that no number of samples makes it show. Farther out weights are
# subnormal numbers as well, with which processors multiply at a tenth of their speed.
NEGLIGIBLE = np.finfo(np.float64).eps ** 2

Totals = list[np.ndarray]

_spaces = threading.local()


def parametric_moments(
    features: PolicyFeatures, X: np.ndarray, seen: Sight, weights: np.ndarray | None = None
) -> Moments:
    """Moments of a policy with fitted `features`: states X (N, n), what a risk sees of the actions, weights (N,)."""
    if isinstance(features, FullFeatures):
        if seen.whole:
            return _whole_moments(features, X, seen, weights)
        M, d, k = features.n_basis_, seen.n_actions, seen.n_rows
        # Products halve the arithmetic; they pay as long as making them is no more work than making V.
        if k > 1 or n_pairs(M) + n_pairs(d) <= 2 * features.n_parameters_:
            return _product_moments(features, X, seen, weights)
    return _row_moments(features, X, seen, weights)


def local_moments(
    centers: np.ndarray, width: float, X: np.ndarray, seen: Sight, weights: np.ndarray | None = None
) -> Moments:
    """Moments of M local linear models `p_m(x) = B_m (x, 1)`, stacked, weighted by `exp(-‖x - c_m‖² / 2σ²)`.

    Parameters are in the order of B_m's rows. centers (M, n), width σ, states X (N, n), weights (N,).
    """
    M, n, d = len(centers), X.shape[1], seen.n_actions
    pairs_b, pairs_q = n_pairs(n + 1), (1 if seen.whole else n_pairs(d))
    n_products, n_pulls = pairs_b * pairs_q, d * (n + 1)
    # All that is summed, a row each: the distinct entries of H, then g, s and the weight itself.
    n_summed = n_products + n_pulls + 2
    size = _rows(LOCAL_PRODUCTS_IN_BLOCK, n_summed)

    def add(block: slice, totals: Totals) -> None:
        B, part = with_one(X[block]), seen[block]
        rows = part.rows
        receptive = activations(X[block], centers, width)
        near = receptive.max(axis=0) > NEGLIGIBLE
        if weights is not None:
            receptive *= weights[block, None]
        (total,) = totals
        summed = _space("summed", n_summed, size)[:, : len(B)]
        products = summed[:n_products].reshape(pairs_b, pairs_q, -1)
        if seen.whole:
            products[:, 0] = distinct_products(B)
        else:
            np.multiply(distinct_products(B)[:, None], _seen_products(rows), out=products)
        pulls = summed[n_products:-2].reshape(d, n + 1, -1)
        np.multiply(_pull(rows, part.targets).T[:, None], B.T, out=pulls)
        summed[-2] = part.squares
        summed[-1] = 1.0
        if near.all():
            total += receptive.T @ summed.T
        else:  # samples in a row are near each other, and in a large workspace far from most models
            total[near] += receptive[:, near].T @ summed.T

    (total,) = _sum_over_blocks(len(X), size, [(M, n_summed)], add)
    H, g = total[:, :n_products], total[:, n_products:-2]
    squares, weight = total[:, -2].copy(), total[:, -1].copy()
    if seen.whole:
        return Moments(
            H[:, pair_index(n + 1)], g.reshape(M, d, n + 1).swapaxes(1, 2), squares, weight, len(X)
        )
    H = _unfold(H.reshape(M, pairs_b, pairs_q), n + 1, d)
    return Moments(H, g[:, :, None].copy(), squares, weight, len(X))


def _product_moments(
    features: FullFeatures, X: np.ndarray, seen: Sight, weights: np.ndarray | None
) -> Moments:
    M, d = features.n_basis_, seen.n_actions
    size = _rows(PRODUCTS_IN_BLOCK, n_pairs(M) + n_pairs(d))

    def add(block: slice, totals: Totals) -> None:
        B, part, omega = features.basis(X[block]), seen[block], None if weights is None else weights[block]
        rows, targets = part.rows, part.targets
        space = _space("products", n_pairs(M) + n_pairs(d), size)[:, : len(B)]
        of_basis = distinct_products(B, out=space[: n_pairs(M)])
        totals[0] += _narrow(of_basis, _seen_products(rows, omega, space[n_pairs(M) :]))
        pull = _pull(rows, targets).T
        totals[1] += (pull if omega is None else pull * omega) @ B

    products, g = _sum_over_blocks(len(X), size, [(n_pairs(M), n_pairs(d)), (d, M)], add)
    return Moments(_unfold(products, M, d), g.reshape(-1, 1), *_squares_and_weight(seen, weights), len(X))


def _narrow(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """`A Bᵀ` of long rows, A (a, N) and B (b, N), a piece of their length at a time.

    BLAS copies both into the order in which it multiplies; where there are few rows that is half the work, and
    goes twice as fast while a piece fits the innermost cache.
    """
    (a, N), b = A.shape, len(B)
    pieces = N // SAMPLES_IN_PIECE if a * b <= NARROW else 0
    if pieces < 2:
        return A @ B.T
    cut = pieces * SAMPLES_IN_PIECE
    left = A[:, :cut].reshape(a, pieces, SAMPLES_IN_PIECE).transpose(1, 0, 2)
    right = B[:, :cut].reshape(b, pieces, SAMPLES_IN_PIECE).transpose(1, 2, 0)
    return np.matmul(left, right).sum(axis=0) + A[:, cut:] @ B[:, cut:].T


def _whole_moments(features: FullFeatures, X: np.ndarray, seen: Sight, weights: np.ndarray | None) -> Moments:
    """Nothing is projected: `H = (Σ ω b bᵀ) ⊗ I`, so the d dimensions of the action share the M x M block."""
    M, d = features.n_basis_, seen.n_actions

    def add(block: slice, totals: Totals) -> None:
        B, targets = features.basis(X[block]), seen.targets[block]
        if weights is not None:
            root = np.sqrt(weights[block, None])
            B, targets = B * root, targets * root
        totals[0] += B.T @ B
        totals[1] += B.T @ targets

    H, g = _sum_over_blocks(len(X), _rows(ROWS_IN_BLOCK, M), [(M, M), (M, d)], add)
    return Moments(H, g, *_squares_and_weight(seen, weights), len(X))


def _row_moments(features: PolicyFeatures, X: np.ndarray, seen: Sight, weights: np.ndarray | None) -> Moments:
    P = features.n_parameters_

    def add(block: slice, totals: Totals) -> None:
        part = seen[block]
        # A row a sample, as V is made.
        rows, targets = np.ascontiguousarray(part.rows), part.targets
        if weights is not None:
            root = np.sqrt(weights[block, None])
            rows, targets = rows * root[:, None], targets * root
        states = X[block].astype(np.float64, copy=False)
        for k in range(part.n_rows):
            V = features.along(states, rows[:, k])
            totals[0] += V.T @ V
            totals[1] += V.T @ targets[:, k, None]

    H, g = _sum_over_blocks(len(X), _rows(ROWS_IN_BLOCK, P), [(P, P), (P, 1)], add)
    return Moments(H, g, *_squares_and_weight(seen, weights), len(X))


def _squares_and_weight(seen: Sight, weights: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """`Σ ω ‖Q u‖²` and `Σ ω`."""
    if weights is None:
        return np.asarray(seen.squares.sum()), np.asarray(float(len(seen)))
    return np.asarray(seen.squares @ weights), np.asarray(weights.sum())


def _sum_over_blocks(
    n_samples: int, rows: int, shapes: list[tuple[int, ...]], add: Callable[[slice, Totals], None]
) -> Totals:
    """What `add` sums into zeroed arrays of `shapes`, over all samples, in blocks of `rows`."""

    def share(of_blocks: Sequence[slice]) -> Totals:
        totals = [np.zeros(shape) for shape in shapes]
        for block in of_blocks:
            add(block, totals)
        return totals

    first, *others = shared_out(share, blocks(n_samples, rows))
    return [np.asarray(sum(parts[1:], start=parts[0])) for parts in zip(first, *others, strict=True)]


def _space(name: str, *shape: int) -> np.ndarray:
    """This thread's own working space, its contents those of the block before.

    Memory new for every block would have to be mapped and cleared each time, which costs a fifth of the whole.
    """
    held = getattr(_spaces, name, None)
    if held is None or held.shape != shape:
        held = np.empty(shape)
        setattr(_spaces, name, held)
    return held


def _rows(numbers: int, width: int) -> int:
    """How many samples a block of so many numbers holds: few enough for the cache, enough to be worth a call."""
    size = max(256, min(numbers // width, 11 * SAMPLES_IN_PIECE))
    return size - size % SAMPLES_IN_PIECE if size > SAMPLES_IN_PIECE else size


def _seen_products(
    rows: np.ndarray, weights: np.ndarray | None = None, out: np.ndarray | None = None
) -> np.ndarray:
    """The distinct entries of `ω QᵀQ`, (d(d+1)/2, N), for rows Q (N, k, d), weights (N,); `out` may hold them."""
    if rows.shape[1] == 1:
        return distinct_products(rows[:, 0], weights, out)
    i, j = pairs(rows.shape[2])
    products = np.einsum("nki,nkj->nij", rows, rows)[:, i, j].T
    return products if weights is None else products * weights


def _pull(rows: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """`QᵀQ u`, (N, d), for rows Q (N, k, d) and targets `Q u` (N, k)."""
    if rows.shape[1] == 1:
        return rows[:, 0] * targets
    return np.einsum("nki,nk->ni", rows, targets)


def _unfold(products: np.ndarray, M: int, d: int) -> np.ndarray:
    """H (..., dM, dM) from its distinct entries (..., M(M+1)/2, d(d+1)/2)."""
    over_q = products[..., pair_index(d)]  # (..., pairs of b, d, d)
    full = np.moveaxis(over_q, -3, -1)[..., pair_index(M)]  # (..., d, d, M, M)
    return np.ascontiguousarray(full.swapaxes(-2, -3)).reshape(*products.shape[:-2], d * M, d * M)
