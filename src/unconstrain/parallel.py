"""Work on blocks of samples side by side, in as many threads as BLAS would use.

The sums of a fit are half matrix products and half elementwise work. BLAS spreads only the products over the
processor; so here BLAS gets one thread, and whole blocks are spread. NumPy releases the interpreter in both.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from threading import Lock
from typing import TypeVar

from threadpoolctl import ThreadpoolController

T = TypeVar("T")
R = TypeVar("R")

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


@cache
def _blas() -> ThreadpoolController:
    # Looking the loaded libraries up costs milliseconds: once, after SciPy's own BLAS is loaded too.
    import scipy.linalg.blas  # noqa: F401

    return ThreadpoolController().select(user_api="blas")
