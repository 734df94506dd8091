"""Stretches of an episode at rest."""

import numpy as np
from numpy.typing import NDArray

from unconstrain.recordings.episodewise import percentile

Array = NDArray[np.float64]

# At rest an action is shorter than this share of all but 5 % of those of its episode.
AT_REST = 0.02

# A pause lasts at least this long (s); a movement that turns round is slow for less.
SHORTEST = 0.5


def find_pauses(speeds: Array, time: Array) -> tuple[NDArray[np.bool_], int]:
    """Find the pauses of one episode.

    Parameters
    ----------
    speeds : ndarray of shape (N,)
        Lengths of the velocities.
    time : ndarray of shape (N,)
        Seconds, increasing.

    Returns
    -------
    ndarray of shape (N,)
        Whether a sample is in a pause.
    int
        How many pauses there are.
    """
    resting = np.zeros(len(speeds), dtype=bool)
    if len(speeds) < 2:
        return resting, 0
    still = speeds <= AT_REST * percentile(speeds, 95)
    if not still.any():
        return resting, 0
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8)))
    count = 0
    for begin, end in edges.reshape(-1, 2):
        if time[end - 1] - time[begin] >= SHORTEST:
            resting[begin:end] = True
            count += 1
    return resting, count
