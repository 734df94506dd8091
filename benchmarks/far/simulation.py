"""A pass over the data on a simulated cluster, on simulated time, as Dask's own scheduler directs it.

The scheduler is one process that takes messages one by one, in the order in which they come. How long it is busy with
each is measured while this runs, unless the simulation is told that it takes none. Workers compute, fetch and wait as
`Costs` says.
"""

import asyncio
from collections import deque
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import count
from typing import Any

import numpy as np
from dask._task_spec import Task as Task_
from dask._task_spec import TaskRef

from benchmarks.far.costs import Costs
from benchmarks.far.driven import CLIENT, DrivenScheduler
from benchmarks.far.worker import Task, Worker
from unconstrain.scaling.tree import Tree

TICK = 1e-6
"""Seconds that Dask is told of a task that takes none: it knows of no such tasks."""


@dataclass(frozen=True)
class Outcome:
    """What a pass took; seconds of workers are those of all of them together.

    Parameters
    ----------
    seconds : float
        From planting the tasks until the client has the sum.
    rows : int
        Counted by what the client got.
    reading, computing, adding, fetching : float
        What workers did; fetching where they had nothing else to do.
    scheduler, client : float
        Seconds in which the scheduler was busy, and the client with sending the tasks.
    moved, sent : float
        Bytes between workers, and to and from the scheduler.
    most_held : int
        Results that one worker held at a time.
    n_workers, n_tasks : int
    """

    seconds: float
    rows: int
    reading: float
    computing: float
    adding: float
    fetching: float
    scheduler: float
    client: float
    moved: float
    sent: float
    most_held: int
    n_workers: int
    n_tasks: int

    def share(self, seconds: float) -> float:
        """Which share of the workers' time something took."""
        return seconds / (self.seconds * self.n_workers)


def simulate(
    tree: Tree,
    rows: dict[Any, int],
    n_workers: int,
    costs: Costs,
    *,
    timed: bool = True,
    one_by_one: bool = False,
) -> Outcome:
    """Make a pass.

    Parameters
    ----------
    tree : Tree
        As `scaling.cluster` sends it.
    rows : dict of key to int
        Of each part.
    n_workers : int
    costs : Costs
    timed : bool
        Whether the scheduler's own time counts.
    one_by_one : bool
        Whether tasks are sent in a message each.
    """
    return asyncio.run(_Pass(tree, rows, costs, timed).run(n_workers, one_by_one))


class _Pass:
    def __init__(self, tree: Tree, rows: dict[Any, int], costs: Costs, timed: bool):
        self.tree, self.part_rows, self.costs, self.timed = tree, rows, costs, timed
        self.events: list[tuple[float, int, Any]] = []
        self.inbox: deque[Any] = deque()
        self.order = count()
        self.free_at = self.busy = self.client = 0.0
        self.reading = self.computing = self.adding = self.moved = 0.0
        self.end: float | None = None
        self.rng = np.random.default_rng(0)

    async def run(self, n_workers: int, one_by_one: bool) -> Outcome:
        self.driven = DrivenScheduler(n_workers, min(self.costs.network, 1e15))
        self.workers = {address: Worker(address) for address in self.driven.workers}
        tasks, wanted = self.tree.tasks, [*self.tree.parts, self.tree.total]
        graphs = _apart(tasks) if one_by_one else [(tasks, wanted)]
        for graph, keys in graphs:
            client, scheduler = await self.driven.submit(graph, keys)
            self._spend(self._own(client), scheduler)
        while self.events:
            now, _, happens = heappop(self.events)
            happens(now)
        assert self.end is not None
        await self.driven.close()
        every = self.workers.values()
        return Outcome(
            self.end, self.total, self.reading, self.computing, self.adding,
            sum(worker.fetch_seconds for worker in every), self.busy, self.client, self.moved, self.driven.bytes,
            max(worker.most_held for worker in every), n_workers, len(self.tree.tasks),
        )  # fmt: skip

    def _own(self, seconds: float) -> float:
        self.client += seconds if self.timed else 0.0
        return self.client

    def _at(self, time: float, happens: Any) -> None:
        heappush(self.events, (time, next(self.order), happens))

    def _spend(self, arrived: float, seconds: float) -> None:
        """Let the scheduler be busy with a message, and deliver what it answers."""
        took = seconds + self.costs.message if self.timed else 0.0
        begun = max(arrived, self.free_at)
        for name, messages, packing in self.driven.collect():
            took += packing + self.costs.message if self.timed else 0.0
            self._at(
                begun + took + self.costs.delay, lambda now, n=name, m=messages: self._deliver(now, n, m)
            )
        self.free_at = begun + took
        self.busy += took

    def _tell(self, now: float, call: Any, *arguments: Any) -> None:
        """Send the scheduler a message, which it takes when it is free."""

        def arrive(now: float) -> None:
            self.inbox.append((call, arguments))
            if len(self.inbox) == 1:
                self._at(max(now, self.free_at), self._take)

        self._at(now + self.costs.delay, arrive)

    def _take(self, now: float) -> None:
        """Let the scheduler take the message that has waited longest."""
        call, arguments = self.inbox[0]
        self._spend(now, call(*arguments))
        self.inbox.popleft()
        if self.inbox:
            self._at(self.free_at, self._take)

    def _deliver(self, now: float, name: str, messages: list[dict]) -> None:
        if name == CLIENT:
            self._tell_client(now, messages)
            return
        worker = self.workers[name]
        for message in messages:
            if message["op"] == "compute-task":
                needs = tuple(message["who_has"])
                task = Task(message["key"], message["run_id"], message["priority"], needs)
                for key in worker.ask(task):
                    self._fetch(now, worker, key)
            elif message["op"] in ("free-keys", "remove-replicas"):
                for key in message["keys"]:
                    worker.rows.pop(key, None)
        self._go_on(now, worker)

    def _tell_client(self, now: float, messages: list[dict]) -> None:
        keys = [message["key"] for message in messages if message["op"] == "key-in-memory"]
        if self.tree.total in keys:
            (holder, *_) = self.driven.holders(self.tree.total)
            self.total = self.workers[holder].rows[self.tree.total]
            size = self.costs.packed / self.costs.network + 2 * self.costs.packing
            self.end = now + 2 * self.costs.delay + size
        released = [key for key in keys if key != self.tree.total]
        if released:
            self._tell(now, self.driven.released, released)

    def _fetch(self, now: float, worker: Worker, key: Any) -> None:
        """Begin to fetch a result from whoever holds it and is free first."""
        if not worker.fetching and worker.running is None:
            worker.fetches_since = now
        worker.fetching.add(key)
        holder = min(
            (self.workers[name] for name in self.driven.holders(key)), key=lambda each: each.sends_until
        )
        is_setup = key[0].startswith("setup")
        size = self.costs.setup if is_setup else self.costs.packed
        begun = max(now, holder.sends_until, worker.takes_until)
        end = (
            begun
            + size / self.costs.network
            + (0.0 if is_setup else 2 * self.costs.packing)
            + 2 * self.costs.delay
        )
        holder.sends_until = worker.takes_until = end
        self.moved += size
        rows = holder.rows[key]

        def arrive(now: float) -> None:
            worker.fetching.discard(key)
            worker.hold(key, rows)
            if not worker.fetching and worker.running is None:
                worker.fetch_seconds += now - worker.fetches_since
            self._tell(now, self.driven.copied, worker.address, key)
            self._go_on(now, worker)

        self._at(end, arrive)

    def _go_on(self, now: float, worker: Worker) -> None:
        task = worker.next()
        if task is None:
            return
        if worker.fetching:
            worker.fetch_seconds += now - worker.fetches_since
        seconds, rows = self._work(worker, task)

        def finish(stop: float) -> None:
            worker.running = None
            if worker.fetching:
                worker.fetches_since = stop
            worker.hold(task.key, rows)
            size = self.costs.setup if task.key[0].startswith("setup") else self.costs.result
            self._tell(
                stop,
                self.driven.finished,
                worker.address,
                task.key,
                task.run_id,
                int(size),
                stop - max(stop - now, TICK),
                stop,
            )
            self._go_on(stop, worker)

        self._at(now + seconds, finish)

    def _work(self, worker: Worker, task: Task) -> tuple[float, int]:
        """Return how long a task takes, and the rows that its result counts."""
        kind = task.key[0].split("-")[0]
        if kind == "setup":
            return 0.0, 0
        if kind != "sum_of_part":
            adding = self.costs.adding * (len(task.needs) - 1)
            self.adding += adding
            return adding, sum(worker.rows[key] for key in task.needs)
        rows = self.part_rows[task.key]
        reading = rows * self.costs.row_bytes / self.costs.storage
        factor = float(np.exp(self.costs.spread * self.rng.standard_normal())) if self.costs.spread else 1.0
        computing = rows * self.costs.row * factor
        self.reading += reading
        self.computing += computing
        return reading + computing, rows


def _apart(tasks: dict) -> list[tuple[dict, list]]:
    """Make a graph of each task, as `Client.submit` does."""
    return [
        (
            {key: Task_(key, call, *(TaskRef(each) if _is_key(each, tasks) else each for each in arguments))},
            [key],
        )
        for key, (call, *arguments) in tasks.items()
    ]


def _is_key(argument: Any, tasks: dict) -> bool:
    return isinstance(argument, tuple) and argument in tasks
