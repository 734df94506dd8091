"""The one way anything is timed here: work and its yardstick in one run, medians after a warm-up."""

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
    """Median seconds of each call, after a warm-up.

    One after the other, not in turns: BLAS's threads go on spinning for a while after a product, and would slow down
    whoever comes next.
    """
    results = []
    for call in calls:
        call()
        times = []
        for _ in range(repeats):
            start = time.perf_counter()
            call()
            times.append(time.perf_counter() - start)
        results.append(statistics.median(times))
    return results
