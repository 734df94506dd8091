"""Forces that do not change: a sensor that stopped, whose last value says nothing of any contact."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.constraints.contacts import check_forces
from unconstrain.constraints.filtering import split_episodes

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

LEAST_RUN = 20
"""So many samples in a row with the same force, to the last digit, are no measurement."""
MOST_STUCK = 0.5
"""An episode of which more than this is stuck is not trusted elsewhere either."""


def find_stuck(forces: ArrayLike, *, episodes: ArrayLike | None = None) -> NDArray[np.bool_]:
    """Find the samples at which a force sensor had stopped: its value stays the same to the last digit.

    An episode that also has stretches of exactly zero is left alone: simulated forces, and sensors that cut off small
    ones, are zero out of contact, and may be constant within.

    Parameters
    ----------
    forces : array_like of shape (N, m)
        As measured, in the order of time.
    episodes : array_like of shape (N,), optional
        Each is judged by itself.

    Returns
    -------
    ndarray of shape (N,), bool
        True where the force is not to be used.

    Raises
    ------
    DataError
        If the forces are not finite and (N, m).
    """
    F = check_forces(forces)
    return detect_stuck(F, split_episodes(episodes, len(F)))


def detect_stuck(F: Array, episodes: list[Rows]) -> NDArray[np.bool_]:
    """Find the samples at which a sensor had stopped, as `find_stuck` does.

    Parameters
    ----------
    F : ndarray of shape (N, m)
        Forces.
    episodes : list of ndarray of int
        Rows of each episode.

    Returns
    -------
    ndarray of shape (N,), bool
        True where the force is not to be used.
    """
    stuck = np.zeros(len(F), dtype=bool)
    for own in episodes:
        changes = np.flatnonzero((F[own][1:] != F[own][:-1]).any(axis=1)) + 1
        begins = np.concatenate([[0], changes])
        lengths = np.diff(np.concatenate([begins, [len(own)]]))
        # The trust in zeros goes for stretches; a single zero may be chance.
        zero = ~F[own[begins]].any(axis=1)
        if (zero & (lengths > 1)).any():
            continue
        held = np.repeat(lengths >= min(LEAST_RUN, len(own)), lengths) & (len(own) > 1)
        stuck[own] = held.mean() > MOST_STUCK or held
    return stuck
