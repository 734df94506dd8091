"""How long arrows are drawn, so that one fast stretch does not make all others vanish."""

import numpy as np
from numpy.typing import NDArray

from unconstrain.motion import lengths

Array = NDArray[np.float64]

OF_SPEEDS, OF_MEDIAN = 0.9, 3.0
"""An arrow is of full length from this quantile of the speeds, or from so many medians where that is less."""


def find_full_speed(vectors: Array) -> float:
    """Find the speed from which on an arrow is drawn at full length.

    Parameters
    ----------
    vectors : ndarray of shape (N, k)
        Actions. Those of length zero do not count.

    Returns
    -------
    float
        The 0.9 quantile of the speeds, or three times their median where that is less: a tenth of the arrows, or a fast
        stretch of up to half of them, does not shorten the others to nothing. Above zero; 1 where nothing moves.
    """
    speeds = lengths(vectors)
    speeds = speeds[speeds > 0]
    if not len(speeds):
        return 1.0
    return float(min(np.quantile(speeds, OF_SPEEDS), OF_MEDIAN * np.median(speeds)))


def scale_arrows(vectors: Array, full_speed: float | None = None) -> Array:
    """Scale actions to arrows of at most length one.

    Parameters
    ----------
    vectors : ndarray of shape (N, k)
        Actions.
    full_speed : float, optional
        Speed from which on an arrow has length one; by default that of `find_full_speed`. Slower arrows are shorter in
        proportion.

    Returns
    -------
    ndarray of shape (N, k)
        Arrows of the same directions. A vector that is not finite becomes zero.
    """
    vectors = np.where(np.isfinite(vectors).all(axis=1, keepdims=True), vectors, 0.0)
    full = find_full_speed(vectors) if full_speed is None else full_speed
    speeds = lengths(vectors)[:, None]
    return vectors / np.maximum(speeds, full)
