"""Which motions were recorded near a state: the local second moment of recorded directions.

    C(x) = Σ_n K_n û_n û_nᵀ / Σ_n K_n,     K_n = exp(-‖x - x_n‖² / 2σ²),     trace C = 1.

It asks nothing of the model. Its small eigenvalues belong to the motions never seen near x; all d equal 1/d where every
direction was seen alike.
"""

from dataclasses import dataclass

import numpy as np

from unconstrain.fitting.kernels.products import distinct_products, pairs
from unconstrain.motion import directions
from unconstrain.parallel import cut_blocks
from unconstrain.receptive import normalized_activations

NUMBERS_IN_BLOCK = 2**22


@dataclass(frozen=True)
class Coverage:
    """Per state, least seen first.

    shares: (Q, d), ascending; of the squared directions seen near the state, the share along each of `directions`.
    directions: (Q, d, d), rows of length one.
    """

    shares: np.ndarray
    directions: np.ndarray


def coverage(X: np.ndarray, seen_at: np.ndarray, actions: np.ndarray, width: float) -> Coverage:
    """At states X (Q, n), of movements with states `seen_at` (N, n) and actions (N, d); width σ."""
    unit, _ = directions(actions)
    d = unit.shape[1]
    i, j = pairs(d)
    products = distinct_products(unit).T
    second = np.empty((len(X), d, d))
    for rows in cut_blocks(len(X), max(1, NUMBERS_IN_BLOCK // len(seen_at))):
        near = normalized_activations(X[rows], seen_at, width) @ products
        second[rows, i, j] = second[rows, j, i] = near
    values, vectors = np.linalg.eigh(second)
    return Coverage(np.clip(values, 0.0, 1.0), vectors.swapaxes(1, 2))
