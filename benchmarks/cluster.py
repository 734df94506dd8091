"""What a cluster loses: the work of four workers of one thread for a processor second, beside that of one worker.

Both fit the same policy to the same files. Processor time is that of all worker processes, after a fit that has imported
everything, so that other programs on this machine and a number of cores below four change nothing. Efficiency is the
time of the one divided by that of the four together: 1 where dividing, serializing and adding cost nothing.
"""

import statistics
import time
from contextlib import ExitStack

import unconstrain as uc
from benchmarks.ratio import Ratio
from benchmarks.stream import ACTION, STATE, _folder, _local_policy

ROWS = 8_000_000
WORKERS = 4
REPEATS = 3


def linear(rows: int = ROWS) -> Ratio:
    """The linear policy, whose rows cost least, so that a cluster has the least to hide behind."""
    return _efficiency(
        "cluster-efficiency", rows, "linear", lambda: uc.ParametricPolicy(alpha=1e-6, risk="inconsistency")
    )


def local(rows: int = ROWS) -> Ratio:
    """50 local models, whose moments are 50 times as many numbers."""
    return _efficiency("cluster-efficiency-local", rows // 8, "50 local models", _local_policy)


def _efficiency(name, rows, model, policy) -> Ratio:
    one, four = _processor_seconds(rows, policy)
    return Ratio(
        name, f"{rows:.0e} rows of 7+7 float32, {model}: work per processor second of {WORKERS} workers",
        "of 1 worker", one / four, 0.8, four, one, True,
    )  # fmt: skip


def _processor_seconds(rows, policy) -> list[float]:
    """Return the processor seconds of a fit on 1 and on `WORKERS` workers, medians of fits that alternate."""
    import distributed

    folder = _folder(rows)
    with ExitStack() as stack:
        clients = []
        for n in (1, WORKERS):
            cluster = stack.enter_context(
                distributed.LocalCluster(n_workers=n, threads_per_worker=1, dashboard_address=":0")
            )
            clients.append(stack.enter_context(distributed.Client(cluster)))

        def fit(client) -> float:
            before = _spent(client)
            uc.distributed.fit(policy(), uc.open(str(folder), state=STATE, action=ACTION), client)
            return _spent(client) - before

        for client in clients:
            fit(client)
        times = [[fit(client) for client in clients] for _ in range(REPEATS)]
    return [statistics.median(each) for each in zip(*times, strict=True)]


def _spent(client) -> float:
    return sum(client.run(time.process_time).values())
