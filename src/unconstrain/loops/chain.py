"""Hidden states along an episode."""

import numpy as np

from unconstrain.loops.compiling import compiled


@compiled()
def sweep(steps: np.ndarray, rows: np.ndarray) -> None:
    """Compute the rows `r_t = r_{t-1} M_t`, each scaled to sum to one, from the row (1/2, 1/2).

    Parameters
    ----------
    steps : ndarray of shape (N, 2, 2)
        M.
    rows : ndarray of shape (N, 2)
        Written to.
    """
    a = b = 0.5
    for t in range(len(steps)):
        first = a * steps[t, 0, 0] + b * steps[t, 1, 0]
        second = a * steps[t, 0, 1] + b * steps[t, 1, 1]
        total = first + second
        a, b = first / total, second / total
        rows[t, 0], rows[t, 1] = a, b
