"""Moments of one model, at the speed of matrix multiplication.

Where features have a basis, `v = q ⊗ b`, so `H = Σ ω (QᵀQ) ⊗ (b bᵀ)`. Both factors are symmetric: of the (dM)² entries
of H only d(d+1)/2 · M(M+1)/2 differ, and they are the entries of one matrix product, distinct products of directions
times distinct products of features. Any other features are summed as `VᵀV`. No N x P matrix is ever held.
"""

from types import ModuleType

import numpy as np

from unconstrain import loops
from unconstrain.features.base import Features, FullBasis
from unconstrain.fitting.kernels.blocks import (
    SAMPLES_IN_PIECE,
    Totals,
    rows_in_block,
    sum_over_blocks,
    working_space,
)
from unconstrain.fitting.kernels.products import distinct_products, n_pairs, pairs, unfold
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import AlongMotion, Observation

# Numbers of 8 bytes in the widest array of a block. Products are used as soon as they are made, so they should stay
# in a core's own cache; in VᵀV the product's own overhead counts, and is spread over more rows.
PRODUCTS_IN_BLOCK = 2**20
ROWS_IN_BLOCK = 2**21

# A product of at most so many entries is narrow, and is taken in pieces of SAMPLES_IN_PIECE samples.
NARROW = 2**12

# Samples whose basis is computed at a time for the compiled loops.
ROWS_OF_TILES = 2**12

NOTHING = np.empty(0)


def moments(
    features: Features, X: np.ndarray, observation: Observation, weights: np.ndarray | None = None
) -> Moments:
    """Sum the moments of a policy with these features.

    Parameters
    ----------
    features : Features
        Fitted.
    X : ndarray of shape (N, n)
        States.
    observation : Observation
        Of N samples.
    weights : ndarray of shape (N,), optional
        Weight of each sample, 1 by default.

    Returns
    -------
    Moments
        Where the whole action is observed and the features have a basis, H is the block that the d dimensions of the
        action share, and g has d columns.
    """
    if not isinstance(features, FullBasis):
        return of_rows(features, X, observation, weights)
    if observation.whole:
        return of_whole_actions(features, X, observation, weights)
    M, d, k = features.basis(X[:1]).shape[1], observation.n_actions, observation.n_rows
    # Products halve the arithmetic; they pay as long as making them is no more work than making V.
    if k > 1 or n_pairs(M) + n_pairs(d) <= 2 * d * M:
        if isinstance(observation, AlongMotion) and n_pairs(M) * n_pairs(d) <= NARROW:
            compiled = loops.load_for(len(X), "moments")
            if compiled is not None:
                return of_tiles(compiled, features, X, observation, weights)
        return of_products(features, X, observation, weights)
    return of_rows(features, X, observation, weights)


def of_products(
    features: FullBasis, X: np.ndarray, observation: Observation, weights: np.ndarray | None = None
) -> Moments:
    """Sum moments as one product of distinct products.

    Parameters
    ----------
    features : FullBasis
        Fitted.
    X : ndarray of shape (N, n)
        States.
    observation : Observation
        Of N samples.
    weights : ndarray of shape (N,), optional
        Weight of each sample, 1 by default.

    Returns
    -------
    Moments
        Of N samples.
    """
    M, d = features.basis(X[:1]).shape[1], observation.n_actions
    size = rows_in_block(PRODUCTS_IN_BLOCK, n_pairs(M) + n_pairs(d))

    def add(block: slice, totals: Totals) -> None:
        B, part = features.basis(X[block]), observation[block]
        omega = None if weights is None else weights[block]
        space = working_space("products", n_pairs(M) + n_pairs(d), size)[:, : len(B)]
        of_basis = distinct_products(B, out=space[: n_pairs(M)])
        totals[0] += _narrow(of_basis, part.products(omega, space[n_pairs(M) :]))
        pulled = part.pulls.T
        totals[1] += (pulled if omega is None else pulled * omega) @ B

    products, g = sum_over_blocks(len(X), size, [(n_pairs(M), n_pairs(d)), (d, M)], add)
    return Moments(
        unfold(products, M, d), g.reshape(-1, 1), *_squares_and_weight(observation, weights), len(X)
    )


def of_tiles(
    compiled: ModuleType,
    features: FullBasis,
    X: np.ndarray,
    observation: AlongMotion,
    weights: np.ndarray | None = None,
) -> Moments:
    """Sum moments as `of_products` does, in compiled loops that make products and use them tile by tile.

    Parameters
    ----------
    compiled : module
        `loops.moments`.
    features : FullBasis
        Fitted.
    X : ndarray of shape (N, n)
        States.
    observation : AlongMotion
        Of N samples.
    weights : ndarray of shape (N,), optional
        Weight of each sample, 1 by default.

    Returns
    -------
    Moments
        Of N samples.
    """
    M, d = features.basis(X[:1]).shape[1], observation.n_actions
    factors = pairs(M), pairs(d)

    def add(block: slice, totals: Totals) -> None:
        part = observation[block]
        omega = NOTHING if weights is None else weights[block]
        compiled.add_along_motion(
            features.basis(X[block]).T, part.actions.T, part.inverse, omega, *factors, *totals
        )

    shapes = [(_fours(n_pairs(M)), _fours(n_pairs(d))), (_fours(d), _fours(M))]
    products, g = sum_over_blocks(len(X), ROWS_OF_TILES, shapes, add)
    H = unfold(products[: n_pairs(M), : n_pairs(d)], M, d)
    return Moments(H, g[:d, :M].reshape(-1, 1), *_squares_and_weight(observation, weights), len(X))


def of_whole_actions(
    features: FullBasis, X: np.ndarray, observation: Observation, weights: np.ndarray | None = None
) -> Moments:
    """Sum moments where nothing is projected, `H = (Σ ω b bᵀ) ⊗ I`.

    Parameters
    ----------
    features : FullBasis
        Fitted.
    X : ndarray of shape (N, n)
        States.
    observation : Observation
        Of N samples.
    weights : ndarray of shape (N,), optional
        Weight of each sample, 1 by default.

    Returns
    -------
    Moments
        Of the block `Σ ω b bᵀ`; g has d columns.
    """
    M, d = features.basis(X[:1]).shape[1], observation.n_actions

    def add(block: slice, totals: Totals) -> None:
        B, targets = features.basis(X[block]), observation[block].pulls
        if weights is not None:
            root = np.sqrt(weights[block, None])
            B, targets = B * root, targets * root
        totals[0] += B.T @ B
        totals[1] += B.T @ targets

    H, g = sum_over_blocks(len(X), rows_in_block(ROWS_IN_BLOCK, M), [(M, M), (M, d)], add)
    return Moments(H, g, *_squares_and_weight(observation, weights), len(X))


def of_rows(
    features: Features, X: np.ndarray, observation: Observation, weights: np.ndarray | None = None
) -> Moments:
    """Sum moments of any features, as `VᵀV`.

    Parameters
    ----------
    features : Features
        Fitted.
    X : ndarray of shape (N, n)
        States.
    observation : Observation
        Of N samples.
    weights : ndarray of shape (N,), optional
        Weight of each sample, 1 by default.

    Returns
    -------
    Moments
        Of N samples.
    """
    P = features.along(X[:1].astype(np.float64, copy=False), np.ones((1, observation.n_actions))).shape[1]

    def add(block: slice, totals: Totals) -> None:
        part = observation[block]
        # A row a sample, as V is made.
        rows, targets, each = np.ascontiguousarray(part.rows), part.targets, part.row_weights
        omega = None if weights is None else weights[block]
        if targets is not None and omega is not None:
            root = np.sqrt(omega[:, None])
            rows, targets = rows * root[:, None], targets * root
        states = X[block].astype(np.float64, copy=False)
        for k in range(part.n_rows):
            V = features.along(states, rows[:, k])
            if targets is not None:
                totals[0] += V.T @ V
                totals[1] += V.T @ targets[:, k, None]
            else:
                assert each is not None
                counts = each[:, k] if omega is None else each[:, k] * omega
                totals[0] += (V * counts[:, None]).T @ V
        if targets is None:
            pulls = part.pulls if omega is None else part.pulls * omega[:, None]
            totals[1] += features.along(states, pulls).sum(axis=0)[:, None]

    H, g = sum_over_blocks(len(X), rows_in_block(ROWS_IN_BLOCK, P), [(P, P), (P, 1)], add)
    return Moments(H, g, *_squares_and_weight(observation, weights), len(X))


def _fours(length: int) -> int:
    """Round up to a multiple of four."""
    return -(-length // 4) * 4


def _narrow(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Multiply long rows, `A Bᵀ` of A (a, N) and B (b, N), a piece of their length at a time.

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


def _squares_and_weight(
    observation: Observation, weights: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """Sum `ω ‖Q u‖²` and `ω`."""
    if weights is None:
        return np.asarray(observation.squares.sum()), np.asarray(float(len(observation)))
    return np.asarray(observation.squares @ weights), np.asarray(weights.sum())
