"""Which boxes of a grid states lie in."""

import numpy as np

from unconstrain.loops.compiling import compiled


@compiled(exact=True)  # a state on an edge lies in the box that NumPy says
def first_rows(
    Z: np.ndarray, edge: np.ndarray, shift: float, factor: float, limit: float, rows: np.ndarray
) -> int:
    """Find the first state in each box of a grid.

    Parameters
    ----------
    Z : ndarray of shape (N, m)
        States, of any precision.
    edge : ndarray of shape (m,)
        Of the finest boxes; those asked for are `floor((floor(z / edge) + shift) factor)`.
    shift, factor, limit : float
        Finest boxes are numbered up to `limit`.
    rows : ndarray of shape (K,), int64
        Written to: the indices of the states found.

    Returns
    -------
    int
        How many; -1 where there are more than K.
    """
    N, m = Z.shape
    places = 4 * len(rows)  # a power of two
    table = np.full(places, -1, np.int64)
    boxes = np.empty((len(rows), m))
    box = np.empty(m)
    found = 0
    for n in range(N):
        mixed = np.uint64(0)
        for j in range(m):
            finest = min(max(np.floor(np.float64(Z[n, j]) / edge[j]), -limit), limit)
            box[j] = np.floor((finest + shift) * factor)
            mixed = (mixed + np.uint64(np.int64(box[j]))) * np.uint64(0x9E3779B97F4A7C15)
            mixed ^= mixed >> np.uint64(29)
        at = np.int64(mixed & np.uint64(places - 1))
        while table[at] >= 0:
            same = True
            for j in range(m):
                if boxes[table[at], j] != box[j]:
                    same = False
                    break
            if same:
                break
            at = (at + 1) & (places - 1)
        if table[at] < 0:
            if found == len(rows):
                return -1
            table[at] = found
            boxes[found] = box
            rows[found] = n
            found += 1
    return found
