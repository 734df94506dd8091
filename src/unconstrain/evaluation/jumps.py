"""Whether a few samples hold most of the motion, as where a tracker jumps."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FEW, MOST = 0.01, 0.25
"""Share of the samples, and the share of the squared motion from which on they are jumps: of smooth movements the
fastest hundredth holds three to ten hundredths."""

USUAL, FASTER = 95.0, 3.0
"""Percentile of the speeds that is usual, and by how much a speed has to be above it to be none."""


class Jumps(NamedTuple):
    """Samples that are too fast beside the others.

    Parameters
    ----------
    share : float
        Of the squared motion that the fastest hundredth of the samples holds.
    max_speed : float
        A speed that leaves them out, in units of the actions.
    are : ndarray of shape (N,), bool
        Which samples are faster.
    """

    share: float
    max_speed: float
    are: NDArray[np.bool_]


def find_jumps(U: np.ndarray) -> Jumps | None:
    """Find samples that are too fast beside the others.

    Parameters
    ----------
    U : ndarray of shape (N, d)
        Actions.

    Returns
    -------
    Jumps or None
        None where no few samples hold most of the motion.
    """
    speeds = np.linalg.norm(U, axis=1)
    squares = np.sort(speeds**2)[::-1]
    total = float(squares.sum())
    if total == 0.0:
        return None
    share = float(squares[: -(-len(U) // round(1 / FEW))].sum()) / total
    limit = float(f"{FASTER * np.percentile(speeds, USUAL):.2g}")
    are = speeds > limit
    return Jumps(share, limit, are) if share > MOST and are.any() and not are.all() else None
