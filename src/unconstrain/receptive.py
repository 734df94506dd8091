"""Gaussian receptive fields: how much a state activates each of several centres.

`width` is σ of `exp(-‖x - c‖² / 2σ²)` throughout, in the unit of the states.
"""

import numpy as np


def squared_distances(X: np.ndarray, centers: np.ndarray) -> np.ndarray:
    """`‖x - c‖²` for states X (N, n) and centers (M, n): (N, M)."""
    from scipy.spatial.distance import cdist  # slow to import, and not needed before a policy is

    return cdist(X, centers, "sqeuclidean")


def activations(X: np.ndarray, centers: np.ndarray, width: float) -> np.ndarray:
    """`exp(-‖x - c‖² / 2σ²)`: (N, M)."""
    exponent = squared_distances(X, centers)
    exponent *= -0.5 / width**2
    return np.exp(exponent, out=exponent)


def normalized_activations(X: np.ndarray, centers: np.ndarray, width: float) -> np.ndarray:
    """Activations divided by their sum over the centres: (N, M), rows sum to one.

    The nearest centre's exponent is taken out first, so the result is right however far x is from all centres,
    where every activation by itself would underflow to zero.
    """
    exponent = squared_distances(X, centers)
    exponent -= exponent.min(axis=1, keepdims=True)
    exponent *= -0.5 / width**2
    np.exp(exponent, out=exponent)
    exponent /= exponent.sum(axis=1, keepdims=True)
    return exponent
