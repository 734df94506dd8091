"""Dask's own scheduler without a network: every message it takes and sends passes through its code, and is timed."""

import pickle
import time
from collections.abc import Iterator
from typing import Any

import dask
from dask._expr import LLGExpr
from distributed.core import Status
from distributed.protocol import Serialized, dumps, loads, serialize, to_serialize
from distributed.scheduler import ClientState, Scheduler, WorkerState
from distributed.spans import SpanMetadata

CLIENT = "client"
TYPE = pickle.dumps(dict)


class Wire:
    """Takes what the scheduler sends in place of a connection, until it is collected."""

    def __init__(self, name: str, sent: dict[str, list[dict]]):
        self.name, self.sent = name, sent

    def send(self, *messages: dict) -> None:
        self.sent.setdefault(self.name, []).extend(messages)


class DrivenScheduler:
    """A scheduler with workers that are names only.

    Each call returns the processor seconds that it took the scheduler, unpacking the message and packing its answers
    included. What it sent is in `collect`. Must be made in a running event loop. Work is not stolen: what it would
    balance, here waits in the scheduler until a worker is idle.
    """

    def __init__(self, n_workers: int, bandwidth: float):
        with dask.config.set({"distributed.scheduler.active-memory-manager.start": False}):
            self.scheduler = Scheduler(dashboard=False, dashboard_address=":0", validate=False)
        self.sent: dict[str, list[dict]] = {}
        self.bytes = 0
        self.scheduler.bandwidth = bandwidth
        self.scheduler.clients[CLIENT] = ClientState(CLIENT)
        self.scheduler.client_comms[CLIENT] = Wire(CLIENT, self.sent)
        self.workers = [self._add_worker(i) for i in range(n_workers)]

    def _add_worker(self, number: int) -> str:
        # As `Scheduler.add_worker` does, which waits for a connection.
        address = f"tcp://10.{number >> 16}.{number >> 8 & 255}.{number & 255}:1"
        state = WorkerState(
            address=address, status=Status.running, pid=number, name=number, nthreads=1, memory_limit=0,
            local_directory="", nanny="", server_id=address, services={}, versions={}, extra={},
            scheduler=self.scheduler,
        )  # fmt: skip
        self.scheduler.workers[address] = state
        self.scheduler.running.add(state)
        self.scheduler.total_nthreads += 1
        self.scheduler.aliases[number] = address
        self.scheduler.check_idle_saturated(state)
        self.scheduler.stream_comms[address] = Wire(address, self.sent)
        for plugin in list(self.scheduler.plugins.values()):
            plugin.add_worker(scheduler=self.scheduler, worker=address)
        return address

    async def submit(self, tasks: dict, wanted: list) -> tuple[float, float]:
        """Send a graph; return the client's and the scheduler's processor seconds."""
        begun = time.process_time()
        graph = Serialized(*serialize(to_serialize(LLGExpr(tasks)), on_error="raise"))
        sent = time.process_time()
        self.bytes += sum(memoryview(frame).nbytes for frame in graph.frames)
        await self.scheduler.update_graph(
            client=CLIENT, expr_ser=graph, keys=set(wanted), internal_priority=None, submitting_task=None,
            span_metadata=SpanMetadata(collections=[{"type": "low-level-graph"}]), fifo_timeout="60s",
        )  # fmt: skip
        return sent - begun, time.process_time() - sent

    def finished(self, worker: str, key: Any, run_id: int, nbytes: int, start: float, stop: float) -> float:
        """Tell that a worker has finished a task."""
        return self._take(
            self.scheduler.handle_task_finished,
            {
                "key": key, "worker": worker, "stimulus_id": f"task-finished-{stop}", "run_id": run_id,
                "nbytes": nbytes, "type": TYPE, "typename": "Added", "metadata": {}, "thread": 1,
                "startstops": [{"action": "compute", "start": start, "stop": stop}],
            },
        )  # fmt: skip

    def copied(self, worker: str, key: Any) -> float:
        """Tell that a worker holds a result of another."""
        return self._take(
            self.scheduler.add_keys, {"worker": worker, "keys": [key], "stimulus_id": f"copied-{worker}"}
        )

    def released(self, keys: list) -> float:
        """Tell that the client no longer wants results."""
        return self._take(
            self.scheduler.client_releases_keys, {"keys": keys, "client": CLIENT, "stimulus_id": "released"}
        )

    def holders(self, key: Any) -> list[str]:
        """List the workers that hold a result."""
        return [state.address for state in self.scheduler.tasks[key].who_has or ()]

    def collect(self) -> Iterator[tuple[str, list[dict], float]]:
        """Yield who was sent what, and the processor seconds of packing it."""
        while self.sent:
            name, messages = self.sent.popitem()
            begun = time.process_time()
            frames = dumps(messages)
            took = time.process_time() - begun
            self.bytes += sum(memoryview(frame).nbytes for frame in frames)
            yield name, messages, took

    async def close(self) -> None:
        # It never listened, so that there is nobody to say goodbye to.
        self.scheduler.http_server.stop()
        for comm in (self.scheduler.stream_comms, self.scheduler.client_comms):
            comm.clear()

    def _take(self, handle: Any, message: dict) -> float:
        frames = dumps(message)
        begun = time.process_time()
        handle(**loads(frames))
        return time.process_time() - begun
