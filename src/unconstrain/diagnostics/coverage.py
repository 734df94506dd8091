"""Which directions of motion were observed near a state: the local second moment of recorded directions.

    C(x) = Σ_n K_n û_n û_nᵀ / Σ_n K_n,     K_n = exp(-‖x - x_n‖² / 2σ²),     trace C = 1.

It depends on no model. Its small eigenvalues belong to the directions that were not observed near x; all d are 1/d
where every direction was observed alike.
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
    """Directions of motion near Q states, the least observed first.

    Parameters
    ----------
    shares : ndarray of shape (Q, d)
        Ascending: the share of the motion near the state that went along each of `directions`.
    directions : ndarray of shape (Q, d, d)
        Rows of length one.
    """

    shares: np.ndarray
    directions: np.ndarray


def compute_coverage(
    X: np.ndarray, recorded: np.ndarray, actions: np.ndarray, width: float | np.ndarray
) -> Coverage:
    """Compute the directions of motion that were observed near states.

    Parameters
    ----------
    X : ndarray of shape (Q, n)
        States in question.
    recorded : ndarray of shape (N, n)
        States of the recorded movements.
    actions : ndarray of shape (N, d)
        Actions of the recorded movements.
    width : float or ndarray of shape (n,)
        Width σ, in the unit of the states.

    Returns
    -------
    Coverage
        At each of `X`.
    """
    unit, _ = directions(actions)
    d = unit.shape[1]
    i, j = pairs(d)
    products = distinct_products(unit).T
    second = np.empty((len(X), d, d))
    for rows in cut_blocks(len(X), max(1, NUMBERS_IN_BLOCK // len(recorded))):
        near = normalized_activations(X[rows], recorded, width) @ products
        second[rows, i, j] = second[rows, j, i] = near
    values, vectors = np.linalg.eigh(second)
    return Coverage(np.clip(values, 0.0, 1.0), vectors.swapaxes(1, 2))
