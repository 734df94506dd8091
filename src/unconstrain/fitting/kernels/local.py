"""Moments of M local models at once.

Each model sums the same samples, weighted by its own receptive field. Where features have a basis, every model weighs
the same distinct products differently, so all of them together are one matrix product.
"""

from dataclasses import dataclass

import numpy as np

from unconstrain.features.base import Features, FullBasis
from unconstrain.fitting.kernels.blocks import Totals, rows_in_block, sum_over_blocks, working_space
from unconstrain.fitting.kernels.products import (
    distinct_products,
    n_pairs,
    pair_index,
    unfold,
)
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import Observation
from unconstrain.receptive import activations

# Numbers of 8 bytes in the widest array of a block, so that it stays in a core's own cache.
PRODUCTS_IN_BLOCK = 2**19

# Beyond twelve σ: so little, squared rounding, that no number of samples makes it show. Farther out weights are
# subnormal numbers as well, with which processors multiply at a tenth of their speed.
NEGLIGIBLE = np.finfo(np.float64).eps ** 2


def moments(
    features: Features,
    centers: np.ndarray,
    width: float | np.ndarray,
    X: np.ndarray,
    observation: Observation,
    weights: np.ndarray | None = None,
    *,
    everywhere: bool = False,
) -> Moments:
    """Sum the moments of local models, each weighted by `exp(-‖x - c_m‖² / 2σ²)`.

    Parameters
    ----------
    features : Features
        Fitted; the same for every model.
    centers : ndarray of shape (M, n)
        The models' centres.
    width : float or ndarray of shape (n,)
        Width σ, in the states' unit.
    X : ndarray of shape (N, n)
        States.
    observation : Observation
        Of N samples.
    weights : ndarray of shape (N,), optional
        Weight of each sample, 1 by default.
    everywhere : bool
        Sum one more model, that every sample reaches in full.

    Returns
    -------
    Moments
        Stacked along a leading axis of M models; with those of the one more as `everywhere`.
    """
    fields = _Fields(centers, width, everywhere)
    if isinstance(features, FullBasis):
        found = _of_products(features, fields, X, observation, weights)
    else:
        found = _of_rows(features, fields, X, observation, weights)
    if not everywhere:
        return found
    H, g, squares, weight = (part[:-1] for part in (found.H, found.g, found.squares, found.weight))
    whole = Moments(found.H[-1], found.g[-1], found.squares[-1], found.weight[-1], len(X))
    return Moments(H, g, squares, weight, len(X), whole)


@dataclass(frozen=True)
class _Fields:
    """The receptive fields of M models, the last of which reaches everywhere if asked."""

    centers: np.ndarray
    width: float | np.ndarray
    everywhere: bool

    def __len__(self) -> int:
        return len(self.centers) + self.everywhere

    def reach(self, X: np.ndarray, weights: np.ndarray | None, block: slice) -> tuple[np.ndarray, np.ndarray]:
        """Compute the weight (N, M) of each sample in each model, and which models (M,) the block reaches."""
        receptive = activations(X, self.centers, self.width)
        if self.everywhere:
            receptive = np.column_stack([receptive, np.ones(len(X))])
        near = receptive.max(axis=0) > NEGLIGIBLE
        if weights is not None:
            receptive *= weights[block, None]
        return receptive, near


def _of_products(
    features: FullBasis,
    fields: _Fields,
    X: np.ndarray,
    observation: Observation,
    weights: np.ndarray | None,
) -> Moments:
    M, k, d = len(fields), features.basis(X[:1]).shape[1], observation.n_actions
    pairs_b, pairs_q = n_pairs(k), (1 if observation.whole else n_pairs(d))
    n_products, n_pulls = pairs_b * pairs_q, d * k
    # All that is summed, a row each: the distinct entries of H, then g, s and the weight itself.
    n_summed = n_products + n_pulls + 2
    size = rows_in_block(PRODUCTS_IN_BLOCK, n_summed)

    def add(block: slice, totals: Totals) -> None:
        B, part = features.basis(X[block]), observation[block]
        receptive, near = fields.reach(X[block], weights, block)
        (total,) = totals
        summed = working_space("summed", n_summed, size)[:, : len(B)]
        products = summed[:n_products].reshape(pairs_b, pairs_q, -1)
        if observation.whole:
            products[:, 0] = distinct_products(B)
        else:
            np.multiply(distinct_products(B)[:, None], part.products(), out=products)
        pulls = summed[n_products:-2].reshape(d, k, -1)
        np.multiply(part.pulls.T[:, None], B.T, out=pulls)
        summed[-2] = part.squares
        summed[-1] = 1.0
        if near.all():
            total += receptive.T @ summed.T
        else:  # samples in a row are near each other, and in a large workspace far from most models
            total[near] += receptive[:, near].T @ summed.T

    (total,) = sum_over_blocks(len(X), size, [(M, n_summed)], add)
    H, g = total[:, :n_products], total[:, n_products:-2]
    squares, weight = total[:, -2].copy(), total[:, -1].copy()
    if observation.whole:
        return Moments(H[:, pair_index(k)], g.reshape(M, d, k).swapaxes(1, 2), squares, weight, len(X))
    H = unfold(H.reshape(M, pairs_b, pairs_q), k, d)
    return Moments(H, g[:, :, None].copy(), squares, weight, len(X))


def _of_rows(
    features: Features,
    fields: _Fields,
    X: np.ndarray,
    observation: Observation,
    weights: np.ndarray | None,
) -> Moments:
    M, d = len(fields), observation.n_actions
    P = features.along(X[:1].astype(np.float64, copy=False), np.ones((1, d))).shape[1]

    def add(block: slice, totals: Totals) -> None:
        part, states = observation[block], X[block].astype(np.float64, copy=False)
        rows, targets, each = np.ascontiguousarray(part.rows), part.targets, part.row_weights
        receptive, near = fields.reach(states, weights, block)
        H, g, squares, weight = totals
        for k in range(part.n_rows):
            V = features.along(states, rows[:, k])
            counted = V if each is None else V * each[:, k, None]
            for m in np.flatnonzero(near):
                weighted = V * receptive[:, m, None]
                H[m] += weighted.T @ counted
                if targets is not None:
                    g[m, :, 0] += weighted.T @ targets[:, k]
        if targets is None:
            g[:, :, 0] += receptive.T @ features.along(states, part.pulls)
        squares += receptive.T @ part.squares
        weight += receptive.sum(axis=0)

    size = rows_in_block(PRODUCTS_IN_BLOCK, P)
    H, g, squares, weight = sum_over_blocks(len(X), size, [(M, P, P), (M, P, 1), (M,), (M,)], add)
    return Moments(H, g, squares, weight, len(X))
