"""What Figueroa and Billard (2018) measure of a dynamical system on handwriting, as their published scripts compute it.

`rmse_error.m`, `edot_error.m`, `Simulation.m` and `evaluate_LPVDS_PCGMM.m` of ds-opt, in
`epfl-lasa/icra19-lfd-tutorial-exercises`.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

Array = NDArray[np.float64]

DT, LONGEST = 0.01, 3000
"""Seconds a step of a simulated movement, and the most states it has."""

REST, RESTING = 0.1, 4
"""Movements end once each of their velocities was below this, mm/s, for so many steps."""


def velocity_error(U: Array, P: Array) -> float:
    """Compute what is published as RMSE: the mean over samples of `‖p - u‖ / √d`.

    Parameters
    ----------
    U, P : ndarray of shape (N, d)
        Recorded and predicted velocities.

    Returns
    -------
    float
        In their unit. The root mean square of the error's length is larger: 1.6 to 1.9 times on handwriting.
    """
    return float(np.mean(np.sqrt(np.mean((P - U) ** 2, axis=1))))


def direction_error(U: Array, P: Array) -> float:
    """Compute the mean over samples of `1 - cos` of the angle between velocities; where one is zero it counts as 0.

    Parameters
    ----------
    U, P : ndarray of shape (N, d)
        Recorded and predicted velocities.

    Returns
    -------
    float
        From 0 to 2.
    """
    lengths = np.linalg.norm(U, axis=1) * np.linalg.norm(P, axis=1)
    cosine = np.divide(np.sum(U * P, axis=1), lengths, out=np.ones(len(U)), where=lengths > 0)
    return float(np.mean(np.abs(1.0 - cosine)))


def warping_distance(a: Array, b: Array) -> float:
    """Compute the dynamic time warping distance: the sum of distances along the best alignment of two paths.

    Parameters
    ----------
    a, b : ndarray of shape (N, d) and (M, d)
        Paths.

    Returns
    -------
    float
        In their unit. It grows with the number of points.
    """
    apart = cdist(a, b)
    n, m = apart.shape
    # Antidiagonals: each needs the two before it only. Entry i + 1 is that of row i, and entry 0 lies outside.
    before = last = np.full(n + 1, np.inf)
    for k in range(n + m - 1):
        i = np.arange(max(0, k - m + 1), min(n, k + 1))
        best = np.minimum(np.minimum(last[i + 1], last[i]), before[i]) if k else 0.0
        current = np.full(n + 1, np.inf)
        current[i + 1] = apart[i, k - i] + best
        before, last = last, current
    return float(last[n])


def simulate(velocity: Callable[[Array], Array], starts: Sequence[Array]) -> list[Array]:
    """Follow a system from several starts until all of them rest, by Euler's method.

    Parameters
    ----------
    velocity : callable
        From states (N, d) to velocities.
    starts : sequence of ndarray of shape (d,)
        Where movements begin.

    Returns
    -------
    list of ndarray of shape (T, d)
        A path for each start, all of the same length.
    """
    X = np.array(starts)
    path, resting = [X], 0
    while len(path) < LONGEST and resting < RESTING:
        U = velocity(X)
        resting = resting + 1 if np.all(np.abs(U) < REST) else 0
        X = X + DT * U
        path.append(X)
    return list(np.stack(path, axis=1))
