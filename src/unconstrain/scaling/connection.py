"""A Dask cluster that may not answer, or lose its workers: every wait has a limit, and says what it waited for."""

import asyncio
import logging
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from unconstrain.errors import UnconstrainError

if TYPE_CHECKING:
    import distributed

ANSWER_SECONDS = 10.0
"""In which a scheduler must answer."""

WORKER_SECONDS = 60.0
"""For which a cluster may be without workers."""

CHECK_SECONDS = 1.0
"""Between looks at whether there are workers."""


@contextmanager
def connected(
    cluster: str, timeout: float = ANSWER_SECONDS, worker_timeout: float = WORKER_SECONDS
) -> "Iterator[distributed.Client]":
    """Connect to a Dask cluster.

    Parameters
    ----------
    cluster : str
        The address of its scheduler, such as ``tcp://host:8786``, or "local" for a cluster of this machine, which ends
        with the connection.
    timeout : float
        Seconds in which the scheduler must answer.
    worker_timeout : float
        Seconds in which there must be a worker.

    Yields
    ------
    distributed.Client

    Raises
    ------
    UnconstrainError
        Dask is not installed, no scheduler answers, it has no workers, or none can be started on this machine.
    """
    try:
        import distributed
    except ImportError as error:
        raise UnconstrainError(
            "a cluster needs Dask, which is not installed: pip install 'unconstrain[distributed]'"
        ) from error
    if cluster == "local":
        try:  # what goes wrong with a part is raised here, so workers need not log it as well
            local = distributed.LocalCluster(
                threads_per_worker=1, dashboard_address=":0", silence_logs=logging.CRITICAL
            )
        except RuntimeError as error:
            raise UnconstrainError(
                "no worker processes could be started on this machine: in a script, call this below "
                'if __name__ == "__main__":, as each of them imports the script'
            ) from error
        with local, distributed.Client(local) as client:
            yield client
        return
    silence = (
        f"no Dask scheduler answered at {cluster} within {timeout:g} s: check the address, which looks like "
        "tcp://host:8786"
    )
    try:
        # Asked in a loop and a thread of its own: a client would wait for ever for what only listens, and in a
        # notebook this thread runs a loop already.
        with ThreadPoolExecutor(1) as thread:
            thread.submit(asyncio.run, _identity(cluster, timeout)).result()
        client = distributed.Client(cluster, timeout=timeout)
    except Exception as error:  # what answers may be anything, and so may be what comes of it
        raise UnconstrainError(silence) from error
    with client:
        wait_for_workers(client, cluster, worker_timeout)
        yield client


def wait_for_workers(client: "distributed.Client", where: str, timeout: float = WORKER_SECONDS) -> None:
    """Wait until a cluster has a worker.

    Parameters
    ----------
    client : distributed.Client
    where : str
        The scheduler's address, for the sentence.
    timeout : float
        Seconds.

    Raises
    ------
    UnconstrainError
        There is none by then.
    """
    try:
        client.wait_for_workers(1, timeout=timeout)
    except TimeoutError as error:
        raise UnconstrainError(
            f"the scheduler at {where} has no workers, and none came within {timeout:g} s: start some, with "
            f"dask worker {where}"
        ) from error


def as_finished(
    client: "distributed.Client", futures: "list[distributed.Future]", timeout: float = WORKER_SECONDS
) -> "Iterator[distributed.Future]":
    """Go through futures as they finish, for as long as there are workers.

    Parameters
    ----------
    client : distributed.Client
    futures : list of distributed.Future
    timeout : float
        Seconds for which the cluster may be without workers.

    Yields
    ------
    distributed.Future
        Finished or failed.

    Raises
    ------
    UnconstrainError
        The scheduler is gone, or all workers are.
    """
    import distributed

    waiting = distributed.as_completed(futures)
    looked = seen = time.monotonic()
    while not waiting.is_empty():
        if waiting.has_ready():
            future = next(waiting)
            if future.status in ("cancelled", "lost"):
                raise UnconstrainError(
                    "the scheduler of the cluster was lost, and with it what was learnt: start it again"
                )
            yield future
            continue
        time.sleep(0.01)
        now = time.monotonic()
        if now - looked < CHECK_SECONDS:
            continue
        looked = now
        if client.status == "running" and client.nthreads():
            seen = now
        elif now - seen > timeout:
            raise UnconstrainError(
                f"the cluster lost all its workers, and none came back within {timeout:g} s: start some again"
            )


async def _identity(cluster: str, timeout: float) -> dict[str, Any]:
    import distributed

    async def ask() -> dict[str, Any]:
        async with distributed.rpc(cluster) as scheduler:
            return await scheduler.identity()

    return await asyncio.wait_for(ask(), timeout)
