"""Blocks of samples side by side, in as many threads as BLAS would use.

The sums of a fit are half matrix products and half elementwise work. BLAS spreads only the products over the
processor; so here BLAS gets one thread, and whole blocks are spread. NumPy lets go of the interpreter in both.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from threading import Lock
from typing import TypeVar

from threadpoolctl import ThreadpoolController

T = TypeVar("T")

_one_at_a_time = Lock()


def blocks(n_samples: int, rows: int) -> list[slice]:
    """`range(n_samples)` as slices of `rows` samples, the last one shorter."""
    return [slice(start, min(start + rows, n_samples)) for start in range(0, n_samples, rows)]


def shared_out(work: Callable[[Sequence[T]], object], pieces: Sequence[T]) -> list:
    """`work` on as many shares of `pieces` as BLAS has threads, each share in its own; a result a share.

    Which piece goes to which share depends only on the number of threads, so that sums come out the same each
    time. Where BLAS is held to one thread (by joblib, Dask or the user) everything runs in the caller's.
    """
    controller = _blas()
    threads = min((library["num_threads"] for library in controller.info()), default=1)
    threads = min(threads, len(pieces))
    # Whoever comes second while the limit is set would take it for the user's: let him run by himself.
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
