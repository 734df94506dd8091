"""Gaussian receptive fields: how much a state activates each of several centres.

`width` is σ of `exp(-‖x - c‖² / 2σ²)` throughout, in the unit of the states.
"""

import numpy as np


def squared_distances(X: np.ndarray, centers: np.ndarray) -> np.ndarray:
    """Compute squared distances between states and centres.

    Parameters
    ----------
    X : ndarray of shape (N, n)
        States.
    centers : ndarray of shape (M, n)
        Centres.

    Returns
    -------
    ndarray of shape (N, M)
        `‖x - c‖²`, in squared units of the states.
    """
    from scipy.spatial.distance import cdist  # slow to import, and not needed before a policy is

    return cdist(X, centers, "sqeuclidean")


def activations(X: np.ndarray, centers: np.ndarray, width: float) -> np.ndarray:
    """Compute how much states activate centres.

    Parameters
    ----------
    X : ndarray of shape (N, n)
        States.
    centers : ndarray of shape (M, n)
        Centres.
    width : float
        σ, in the unit of the states.

    Returns
    -------
    ndarray of shape (N, M)
        `exp(-‖x - c‖² / 2σ²)`.
    """
    exponent = _exponents(squared_distances(X, centers), width)
    return np.exp(exponent, out=exponent)


def normalized_activations(X: np.ndarray, centers: np.ndarray, width: float) -> np.ndarray:
    """Compute activations divided by their sum over the centres.

    Parameters
    ----------
    X : ndarray of shape (N, n)
        States, however far from all centres.
    centers : ndarray of shape (M, n)
        Centres.
    width : float
        σ, in the unit of the states.

    Returns
    -------
    ndarray of shape (N, M)
        Shares of the centres, which sum to one.
    """
    exponent = squared_distances(X, centers)
    # Far from all centres every activation would underflow to zero: the nearest one's exponent is taken out.
    exponent -= exponent.min(axis=1, keepdims=True)
    exponent = _exponents(exponent, width)
    np.exp(exponent, out=exponent)
    exponent /= exponent.sum(axis=1, keepdims=True)
    return exponent


def _exponents(squares: np.ndarray, width: float) -> np.ndarray:
    """Divide squared distances by -2σ², in place; σ² itself may be more or less than double precision holds."""
    with np.errstate(over="ignore", under="ignore"):
        if 1e-150 < width < 1e150:
            squares *= -0.5 / width**2
        else:
            squares /= width
            squares /= width
            squares *= -0.5
    return squares
