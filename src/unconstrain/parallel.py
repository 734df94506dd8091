"""Work on blocks of samples side by side, in as many threads as BLAS would use.

The sums of a fit are half matrix products and half elementwise work. BLAS spreads only the products over the
processor; so here BLAS gets one thread, and whole blocks are spread. NumPy releases the interpreter in both.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from threading import Lock
from typing import TypeVar

import numpy as np
from threadpoolctl import ThreadpoolController

T = TypeVar("T")
R = TypeVar("R")

ROWS_OF_THREAD = 2**15
"""States at a time: enough that what is done once for all of them does not count."""

_one_at_a_time = Lock()


def cut_blocks(n_samples: int, rows: int) -> list[slice]:
    """Cut a range of samples into blocks.

    Parameters
    ----------
    n_samples : int
        Length of the range.
    rows : int
        Samples in a block; the last one may be shorter.

    Returns
    -------
    list of slice
        The blocks, in order.
    """
    return [slice(start, min(start + rows, n_samples)) for start in range(0, n_samples, rows)]


def map_shares(work: Callable[[Sequence[T]], R], pieces: Sequence[T]) -> list[R]:
    """Work on shares of some pieces side by side, in as many threads as BLAS would use.

    Where BLAS is held to one thread (by joblib, Dask or the user) everything runs in the caller's thread.

    Parameters
    ----------
    work : callable
        Is given a share of the pieces, and returns what came of it.
    pieces : sequence
        All pieces. Which one goes to which share depends only on the number of threads, so that sums come out the
        same each time.

    Returns
    -------
    list
        A result for each share.
    """
    if len(pieces) < 2:
        return [work(pieces)]
    controller = _blas()
    threads = min((library["num_threads"] for library in controller.info()), default=1)
    threads = min(threads, len(pieces))
    # A second caller would take the limit that the first has set for the user's, so it runs in its own thread.
    if threads <= 1 or not _one_at_a_time.acquire(blocking=False):
        return [work(pieces)]
    try:
        with controller.limit(limits=1), ThreadPoolExecutor(threads) as pool:
            return list(pool.map(work, [pieces[i::threads] for i in range(threads)]))
    finally:
        _one_at_a_time.release()


def evaluate_in_shares(evaluate: Callable[[np.ndarray], np.ndarray], X: np.ndarray, d: int) -> np.ndarray:
    """Evaluate a function of states that is elementwise work, in as many threads as BLAS would use.

    Parameters
    ----------
    evaluate : callable
        From states (B, n) to actions (B, d), a row for a row.
    X : ndarray of shape (N, n)
        States.
    d : int
        How many actions there are.

    Returns
    -------
    ndarray of shape (N, d)
        Actions.
    """
    if len(X) < 2 * ROWS_OF_THREAD:
        return evaluate(X)
    actions = np.empty((len(X), d))

    def share(blocks: Sequence[slice]) -> None:
        for block in blocks:
            actions[block] = evaluate(X[block])

    map_shares(share, cut_blocks(len(X), ROWS_OF_THREAD))
    return actions


@cache
def _blas() -> ThreadpoolController:
    # Looking the loaded libraries up costs milliseconds: once, after SciPy's own BLAS is loaded too.
    import scipy.linalg.blas  # noqa: F401

    return ThreadpoolController().select(user_api="blas")
