"""Which samples of many are drawn: more points than a picture resolves only make its file larger."""

import numpy as np
from numpy.typing import NDArray

MOST_EPISODES, MOST_POINTS = 1000, 20_000
"""What is drawn at most."""


def thin_evenly(count: int, most: int) -> NDArray[np.intp]:
    """Choose some of the samples, evenly spread over them.

    Parameters
    ----------
    count : int
        How many there are.
    most : int
        How many are wanted at most.

    Returns
    -------
    ndarray of int
        Rows, ascending; all of them where there are not too many.
    """
    if count <= most:
        return np.arange(count)
    return np.linspace(0, count - 1, most).round().astype(np.intp)


def split_episodes(codes: NDArray[np.int64]) -> list[NDArray[np.intp]]:
    """Find the samples of each episode that is drawn.

    Parameters
    ----------
    codes : ndarray of shape (N,)
        The episode of each sample.

    Returns
    -------
    list of ndarray of int
        Rows of at most 1,000 episodes, evenly spread over them, thinned to about 20,000 in all. The first and the last
        sample of an episode are among them.
    """
    order = np.argsort(codes, kind="stable")
    _, starts = np.unique(codes[order], return_index=True)
    episodes = np.split(order, starts[1:])
    shown = [episodes[k] for k in thin_evenly(len(episodes), MOST_EPISODES)]
    share = min(1.0, MOST_POINTS / sum(map(len, shown)))
    return [rows[thin_evenly(len(rows), max(2, int(share * len(rows))))] for rows in shown]
