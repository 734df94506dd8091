"""One step of a policy that blends over centres, in one call.

Types are fixed beforehand: whatever else is given is refused at once, and nothing is compiled within a control loop.
The interpreter's lock is kept, since a thread that gave it up might wait for milliseconds to get it back.
"""

import numpy as np
from numba import boolean, float64, types

from unconstrain.loops.compiling import compiled

UNDERFLOW = 1e-200
"""Where the activations' sum is less than this, their own precision is in doubt."""

_TABLE, _ROW = types.Array(float64, 2, "C", readonly=True), types.Array(float64, 1, "C", readonly=True)
_STATE, _OUT = types.Array(float64, 1, "A", readonly=True), types.Array(float64, 1, "C")
_STEP = boolean(_TABLE, _ROW, _TABLE, _STATE, _OUT, _OUT, _OUT)


@compiled(boolean(_TABLE, _ROW, _TABLE, _STATE, _OUT, _OUT), nogil=False)
def add_up(
    columns: np.ndarray,
    scale: np.ndarray,
    rows: np.ndarray,
    x: np.ndarray,
    activations: np.ndarray,
    sums: np.ndarray,
) -> bool:
    """Add up the rows of all centres, `Σ_m K_m(x) rows_m`.

    Parameters
    ----------
    columns : ndarray of shape (n, M)
        Centres.
    scale : ndarray of shape (n,)
        `-1 / 2σ²`.
    rows : ndarray of shape (M, k)
        What is blended, and a one.
    x : ndarray of shape (n,)
        State.
    activations : ndarray of shape (M,)
        Written to.
    sums : ndarray of shape (k,)
        Written to.

    Returns
    -------
    bool
        False where the state is too far from all centres for this.
    """
    n, M = columns.shape
    k = rows.shape[1]
    for m in range(M):
        activations[m] = 0.0
    for j in range(n):
        for m in range(M):
            away = columns[j, m] - x[j]
            activations[m] += scale[j] * away * away
    for i in range(k):
        sums[i] = 0.0
    for m in range(M):
        activation = np.exp(activations[m])
        for i in range(k):
            sums[i] += activation * rows[m, i]
    return sums[k - 1] > UNDERFLOW


@compiled(_STEP, nogil=False)
def radial(
    columns: np.ndarray,
    scale: np.ndarray,
    rows: np.ndarray,
    x: np.ndarray,
    activations: np.ndarray,
    sums: np.ndarray,
    out: np.ndarray,
) -> bool:
    """Act as radial basis functions do, `Σ_m K_m w_m / Σ_m K_m`; see `add_up`.

    Parameters
    ----------
    columns, scale, rows, x, activations, sums : ndarray
        As there; of the rows the first d numbers are weights.
    out : ndarray of shape (d,)
        Written to.

    Returns
    -------
    bool
        False where the state is too far from all centres for this.
    """
    if not add_up(columns, scale, rows, x, activations, sums):
        return False
    total = sums[len(sums) - 1]
    for i in range(len(out)):
        out[i] = sums[i] / total
    return True


@compiled(_STEP, nogil=False)
def local(
    columns: np.ndarray,
    scale: np.ndarray,
    rows: np.ndarray,
    x: np.ndarray,
    activations: np.ndarray,
    sums: np.ndarray,
    out: np.ndarray,
) -> bool:
    """Act as local linear models do, `(Σ_m K_m B_m x + Σ_m K_m t_m) / Σ_m K_m`; see `add_up`.

    Parameters
    ----------
    columns, scale, rows, x, activations, sums : ndarray
        As there; the rows hold B_m, row by row, and t_m.
    out : ndarray of shape (d,)
        Written to.

    Returns
    -------
    bool
        False where the state is too far from all centres for this.
    """
    if not add_up(columns, scale, rows, x, activations, sums):
        return False
    n, d, total = len(x), len(out), sums[len(sums) - 1]
    for i in range(d):
        moved = sums[d * n + i]
        for j in range(n):
            moved += sums[i * n + j] * x[j]
        out[i] = moved / total
    return True
