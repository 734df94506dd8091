"""Few states that stand for many."""

import numpy as np


def choose_spread_out(Z: np.ndarray, most: int) -> np.ndarray:
    """Choose states that lie far from each other, each the farthest from those before it.

    Parameters
    ----------
    Z : ndarray of shape (N, n)
        States, standardised.
    most : int
        How many at most.

    Returns
    -------
    ndarray of int
        Their numbers, in the order of choice; fewer where states are the same.

    References
    ----------
    Gonzalez, Clustering to minimize the maximum intercluster distance, Theoretical Computer Science 38, 1985.
    """
    away = np.sum((Z - Z.mean(axis=0)) ** 2, axis=1)
    chosen = [int(np.argmin(away))]
    distance = np.sum((Z - Z[chosen[0]]) ** 2, axis=1)
    while len(chosen) < min(most, len(Z)):
        farthest = int(np.argmax(distance))
        if distance[farthest] <= 0:
            break
        chosen.append(farthest)
        distance = np.minimum(distance, np.sum((Z - Z[farthest]) ** 2, axis=1))
    return np.array(chosen)
