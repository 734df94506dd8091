"""Equations that all motion obeys: a constraint that never varies hides the policy across it."""

import numpy as np
from numpy.typing import NDArray

from unconstrain.constraints.learnt.lines import equation
from unconstrain.demonstrations import Demonstrations

STILL = 1e-3
"""A direction with a smaller share of the squared motion is one in which nothing moves."""


def find_fixed(demos: Demonstrations, scale: NDArray[np.float64] | float = 1.0) -> tuple[str, ...]:
    """Find the directions in which no sample moves.

    Parameters
    ----------
    demos : Demonstrations
        Of any number of actions.
    scale : ndarray of shape (d,), or float
        What actions are measured in, `policy.scale_`: beside degrees a second, metres a second would all but vanish.

    Returns
    -------
    tuple of str
        An equation a direction, "1.000 z_dot ≈ 0"; none for a single action.
    """
    U = demos.actions / scale
    U = U / max(float(np.abs(U).max()), np.finfo(np.float64).tiny)
    d = U.shape[1]
    if d == 1 or len(U) < d:
        return ()
    values, vectors = np.linalg.eigh(U.T @ U)
    total = float(values.sum())
    rows = vectors.T / scale
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    return tuple(equation(rows[i], demos.action_names) for i in range(d - 1) if values[i] < STILL * total)
