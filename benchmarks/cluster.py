"""What a cluster loses: the work of four workers of one thread for a processor second, beside that of one worker.

Both fit the same policy to the same files, so efficiency is the processor time of the one worker divided by that of the
four together: 1 where dividing, serializing and adding cost nothing. It does not count cores, so that four workers may
share two of them. Not counted is what workers take for each second that passes, however much is done in it: heartbeats,
and Dask's profiler, which is switched off; nor what a first fit imports.
"""

import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

import unconstrain as uc
from benchmarks.ratio import Ratio
from benchmarks.stream import ACTION, STATE, _folder, _local_policy

ROWS = 8_000_000
WORKERS = 4
REPEATS = 3
IDLE_SECONDS = 3.0


def linear(rows: int = ROWS) -> Ratio:
    """The linear policy, whose rows cost least, so that a cluster's own work shows most."""
    return _efficiency(
        "cluster-efficiency",
        rows,
        "linear",
        lambda: uc.ParametricPolicy(alpha=1e-6, risk="inconsistency"),
    )


def local(rows: int = ROWS) -> Ratio:
    """50 local models, whose moments are 50 times as many numbers."""
    return _efficiency("cluster-efficiency-local", rows // 8, "50 local models", _local_policy)


BENCHMARKS = {"cluster-efficiency": linear, "cluster-efficiency-local": local}


def _efficiency(name: str, rows: int, model: str, policy: Callable[[], Any]) -> Ratio:
    one, four = _processor_seconds(rows, policy)
    work = f"{rows:.0e} rows of 7+7 float32, {model}: work per processor second of {WORKERS} workers"
    return Ratio(name, work, "of 1 worker", one / four, 0.8, four, one, True)


def _processor_seconds(rows: int, policy: Callable[[], Any]) -> list[float]:
    """Return the processor seconds of a fit on 1 and on `WORKERS` workers, the least of fits that take turns."""
    import dask
    import distributed

    folder = str(_folder(rows))
    with ExitStack() as stack:
        stack.enter_context(dask.config.set({"distributed.worker.profile.enabled": False}))
        clients = []
        for n in (1, WORKERS):
            cluster = stack.enter_context(
                distributed.LocalCluster(n_workers=n, threads_per_worker=1, dashboard_address=":0")
            )
            clients.append(stack.enter_context(distributed.Client(cluster)))

        def fit(client: Any, idle: float) -> float:
            begun, before = time.perf_counter(), _spent(client)
            uc.distributed.fit(policy(), uc.open(folder, state=STATE, action=ACTION), client)
            return _spent(client) - before - idle * (time.perf_counter() - begun)

        for client in clients:
            fit(client, 0.0)
        idle = [_idle(client) for client in clients]
        times = [[fit(*each) for each in zip(clients, idle, strict=True)] for _ in range(REPEATS)]
    return [min(each) for each in zip(*times, strict=True)]


def _idle(client: Any) -> float:
    """Return the processor seconds that workers take each second with nothing to do."""
    before = _spent(client)
    time.sleep(IDLE_SECONDS)
    return (_spent(client) - before) / IDLE_SECONDS


def _spent(client: Any) -> float:
    return sum(client.run(time.process_time).values())
