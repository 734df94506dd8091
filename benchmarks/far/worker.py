"""A simulated worker of one thread: what it holds, waits for, and does next."""

from dataclasses import dataclass, field
from heapq import heappop, heappush
from typing import Any


@dataclass
class Task:
    """What a scheduler has asked of a worker."""

    key: Any
    run_id: int
    priority: tuple
    needs: tuple
    missing: set = field(default_factory=set)

    def __lt__(self, other: "Task") -> bool:
        return self.priority < other.priority


@dataclass
class Worker:
    """Parameters are where it stands."""

    address: str
    rows: dict[Any, int] = field(default_factory=dict)  # of the results that it holds
    waiting: list[Task] = field(default_factory=list)
    ready: list[Task] = field(default_factory=list)
    fetching: set = field(default_factory=set)
    running: Task | None = None
    sends_until: float = 0.0
    takes_until: float = 0.0
    idle_since: float = 0.0
    fetches_since: float = 0.0
    fetch_seconds: float = 0.0  # of those in which it had nothing else to do
    most_held: int = 0

    def ask(self, task: Task) -> list:
        """Take a task up; return the keys of results that are to be fetched first."""
        task.missing = {key for key in task.needs if key not in self.rows}
        if not task.missing:
            heappush(self.ready, task)
            return []
        self.waiting.append(task)
        return [key for key in task.missing if key not in self.fetching]

    def hold(self, key: Any, rows: int) -> None:
        """Hold a result, for which tasks may have waited."""
        self.rows[key] = rows
        self.most_held = max(self.most_held, len(self.rows))
        left = []
        for task in self.waiting:
            task.missing.discard(key)
            if task.missing:
                left.append(task)
            else:
                heappush(self.ready, task)
        self.waiting = left

    def next(self) -> Task | None:
        """Return what to do next, if there is something and nothing is being done."""
        if self.running is None and self.ready:
            self.running = heappop(self.ready)
            return self.running
        return None
