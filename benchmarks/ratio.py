"""The one way anything is timed here: work and its yardstick in turn, medians after a warm-up."""

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Ratio:
    """One line of the table. `reach` is an upper bound, or a lower one where `more_is_better`."""

    name: str
    work: str
    against: str
    value: float
    reach: float
    seconds: float
    seconds_against: float
    more_is_better: bool = False

    @property
    def reached(self) -> bool:
        return self.value >= self.reach if self.more_is_better else self.value <= self.reach


def medians(*calls: Callable[[], object], repeats: int = 7) -> list[float]:
    """Median seconds of each call; they take turns, so that a noisy moment falls on all alike."""
    for call in calls:
        call()
    times: list[list[float]] = [[] for _ in calls]
    for _ in range(repeats):
        for call, taken in zip(calls, times, strict=True):
            start = time.perf_counter()
            call()
            taken.append(time.perf_counter() - start)
    return [statistics.median(taken) for taken in times]
