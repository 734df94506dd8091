"""Gaussian receptive fields: how much a state activates each of several centres.

`width` is σ of `exp(-‖x - c‖² / 2σ²)` throughout, in the unit of the states: one number, or one for each dimension, by
which each is then divided before distances are taken.
"""

from collections.abc import Iterator

import numpy as np

FAR = 460.0
"""Where the nearest centre's exponent is below minus this, its activation is less than 1e-200."""
NEAR = 64.0
"""Up to so many squared widths from the centres' mean, a distance is the difference of products to 1e-14 of a squared
width, and no activation underflows."""
BLOCK_STATES = 2048
NARROWEST, WIDEST = 1e-150, 1e150
"""Widths whose square is a number in double precision."""


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


def activations(X: np.ndarray, centers: np.ndarray, width: float | np.ndarray) -> np.ndarray:
    """Compute how much states activate centres.

    Parameters
    ----------
    X : ndarray of shape (N, n)
        States.
    centers : ndarray of shape (M, n)
        Centres.
    width : float or ndarray of shape (n,)
        σ, in the unit of the states.

    Returns
    -------
    ndarray of shape (N, M)
        `exp(-‖x - c‖² / 2σ²)`.
    """
    X, centers, sigma = _in_one_unit(X, centers, width)
    exponent = _exponents(squared_distances(X, centers), sigma)
    return np.exp(exponent, out=exponent)


def normalized_activations(X: np.ndarray, centers: np.ndarray, width: float | np.ndarray) -> np.ndarray:
    """Compute activations divided by their sum over the centres.

    Parameters
    ----------
    X : ndarray of shape (N, n)
        States, however far from all centres.
    centers : ndarray of shape (M, n)
        Centres.
    width : float or ndarray of shape (n,)
        σ, in the unit of the states.

    Returns
    -------
    ndarray of shape (N, M)
        Shares of the centres, which sum to one.
    """
    X, centers, sigma = _in_one_unit(X, centers, width)
    exponent = squared_distances(X, centers)
    nearest = exponent.min(axis=1, keepdims=True)
    far = nearest[:, 0] > 2 * FAR * sigma**2 if NARROWEST < sigma < WIDEST else np.zeros(len(X), dtype=bool)
    with np.errstate(invalid="ignore"):  # where distances overflow
        # Far from all centres every activation would underflow to zero: the nearest one's exponent is taken out.
        exponent -= nearest
    exponent = _exponents(exponent, sigma)
    if far.any():
        exponent[far] = _exponents_from_afar(X[far], centers, sigma)
    np.exp(exponent, out=exponent)
    exponent /= exponent.sum(axis=1, keepdims=True)
    return exponent


def blend(
    X: np.ndarray, centers: np.ndarray, width: float | np.ndarray, rows: np.ndarray
) -> Iterator[tuple[slice, np.ndarray, np.ndarray]]:
    """Blend rows of numbers, one for each centre, by how much states activate the centres.

    That is `normalized_activations(X, centers, width) @ rows`, but in blocks of states that stay in the processor's
    cache, with distances by a matrix product as long as that rounds no more than the exponential does.

    Parameters
    ----------
    X : ndarray of shape (N, n)
        States.
    centers : ndarray of shape (M, n)
        Centres.
    width : float or ndarray of shape (n,)
        σ, in the unit of the states.
    rows : ndarray of shape (M, k)
        What is blended.

    Yields
    ------
    block : slice
        Of B states.
    sums : ndarray of shape (k, B)
        Sums over the centres, a column for each state; overwritten by the next block.
    total : ndarray of shape (B,)
        By which they are still to be divided.
    """
    mean = centers.mean(axis=0)
    with np.errstate(over="ignore", invalid="ignore"):
        away = (centers - mean) / width
        squares = np.einsum("mn,mn->m", away, away)
    (M, n), k = away.shape, rows.shape[1]
    near = bool(squares.max() <= NEAR)
    # Of one exponent: x·c, and the squares of both, whose other factor is one.
    products = np.column_stack([away, -0.5 * squares, np.full(M, -0.5)])
    weights = np.column_stack([rows, np.ones(M)]).T.copy()
    size = min(len(X), BLOCK_STATES)
    states, square, exponents, sums = (np.empty((count, size)) for count in (n + 2, n, M, k + 1))
    states[n] = 1.0
    for start in range(0, len(X), BLOCK_STATES):
        x = X[start : start + BLOCK_STATES]
        block, B = slice(start, start + len(x)), len(x)
        if size > B:
            states, square, exponents, sums = (
                part[:, :B].copy() for part in (states, square, exponents, sums)
            )
            size = B
        with np.errstate(over="ignore", invalid="ignore"):
            np.subtract(x.T, mean[:, None], out=states[:n])
            states[:n] /= np.reshape(width, (-1, 1))
            np.multiply(states[:n], states[:n], out=square)
            square.sum(axis=0, out=states[n + 1])
        if near and states[n + 1].max() <= NEAR:
            np.matmul(products, states, out=exponents)
            np.exp(exponents, out=exponents)
            np.matmul(weights, exponents, out=sums)
            yield block, sums[:k], sums[k]
        else:
            yield block, (normalized_activations(x, centers, width) @ rows).T, np.ones(B)


def _in_one_unit(
    X: np.ndarray, centers: np.ndarray, width: float | np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Divide each dimension by its own width, and return the one width that is left."""
    widths = np.ravel(width)
    if np.all(widths == widths[0]):
        return X, centers, float(widths[0])
    mean = centers.mean(axis=0)  # a far origin would cost the digits that tell centres apart
    return (X - mean) / widths, (centers - mean) / widths, 1.0


def _exponents_from_afar(X: np.ndarray, centers: np.ndarray, width: float) -> np.ndarray:
    """Compute `-‖x - c‖² / 2σ²` without the part that all centres share, and without squaring a state.

    With m the centres' mean that is `(c - m)ᵀ(x - m) / σ² - ‖c - m‖² / 2σ²`, less the largest. Neither overflows, nor
    drowns the centres' differences in the distance that they share. A matrix product would round otherwise in a batch
    than for one state, and where centres tie, far away that decides between them.
    """
    mean = centers.mean(axis=0)
    away, toward = (centers - mean) / width, (X - mean) / width
    exponent = np.tile(-0.5 * np.sum(away**2, axis=1), (len(X), 1))
    for along, state in zip(away.T, toward.T, strict=True):
        exponent += state[:, None] * along
    return exponent - exponent.max(axis=1, keepdims=True)


def _exponents(squares: np.ndarray, width: float) -> np.ndarray:
    """Divide squared distances by -2σ², in place; σ² itself may be more or less than double precision holds."""
    with np.errstate(over="ignore", under="ignore"):
        if NARROWEST < width < WIDEST:
            squares *= -0.5 / width**2
        else:
            squares /= width
            squares /= width
            squares *= -0.5
    return squares
