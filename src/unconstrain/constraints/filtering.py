"""Filters over the samples of one stretch of time, which never see beyond its ends."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.arrays import check_groups, quote
from unconstrain.errors import DataError

Array = NDArray[np.float64]


def split_episodes(episodes: ArrayLike | None, count: int) -> list[NDArray[np.intp]]:
    """Find the rows of each episode, in their order.

    Parameters
    ----------
    episodes : array_like of shape (N,), or None
        Episode labels; None is a single episode.
    count : int
        Number N of samples.

    Returns
    -------
    list of ndarray of int
        The rows, an array for each episode.

    Raises
    ------
    DataError
        If there is not one label a sample.
    """
    given = check_groups(episodes, count, "episodes")
    labels = np.zeros(count, dtype=int) if given is None else given
    order = np.argsort(labels, kind="stable")
    return np.split(order, np.flatnonzero(labels[order][1:] != labels[order][:-1]) + 1)


def check_window(window: int) -> int:
    """Check the number of samples that a filter looks at.

    Parameters
    ----------
    window : int
        An odd number of samples.

    Returns
    -------
    int
        The number.

    Raises
    ------
    DataError
        If it is not a whole odd number above zero.
    """
    whole = isinstance(window, int | np.integer) and not isinstance(window, bool)
    if not whole or window < 1 or window % 2 == 0:
        raise DataError(f"the window must be an odd number of samples, got {quote(window)}")
    return int(window)


def running_median(values: Array, window: int) -> Array:
    """Take out spikes and keep edges, which a mean would smear.

    Parameters
    ----------
    values : ndarray of shape (N, m)
        Samples of one stretch of time; beyond its ends the first and the last are repeated.
    window : int
        An odd number of samples.

    Returns
    -------
    ndarray of shape (N, m)
        The median over the window, of each component by itself.
    """
    from scipy.ndimage import median_filter  # slow to import

    return median_filter(values, size=(window, 1), mode="nearest")


def running_mean(values: Array, window: int) -> Array:
    """Steady values by their mean.

    Parameters
    ----------
    values : ndarray of shape (N, m)
        Samples of one stretch of time.
    window : int
        An odd number of samples.

    Returns
    -------
    ndarray of shape (N, m)
        The mean over those samples of the window that there are.
    """
    from scipy.ndimage import uniform_filter1d  # slow to import

    share = uniform_filter1d(np.ones(len(values)), window, mode="constant")
    return uniform_filter1d(values, window, axis=0, mode="constant") / share[:, None]
