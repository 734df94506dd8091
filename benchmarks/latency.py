"""How long a step of a control loop takes at worst: the 99.9th percentile of a million.

It is held against the usual time of scikit-learn's `Ridge.predict` on one sample. One step of a thousand is interrupted
by the operating system, and at a busy time other processes run meanwhile: a bare `numpy.exp` that takes as long is as
late.
"""

import gc
from collections.abc import Callable
from statistics import median
from time import perf_counter_ns

import numpy as np
from sklearn.linear_model import Ridge

from benchmarks.ratio import Ratio
from benchmarks.step import KINDS, draw_samples

STEPS, CALLS_AGAINST = 1_000_000, 2_000


def latency_linear() -> Ratio:
    """The linear policy in 7 dimensions."""
    return _ratio("step-latency-linear", "linear")


def latency_rbf() -> Ratio:
    """36 RBFs in the plane."""
    return _ratio("step-latency-rbf", "rbf")


def latency_local() -> Ratio:
    """50 local models in 7 dimensions."""
    return _ratio("step-latency-local", "local")


def _ratio(name: str, kind: str) -> Ratio:
    work, policy, n = KINDS[kind]()
    X, U = draw_samples(n)
    step = policy.fit(X, U).compile()
    ridge, x, out = Ridge().fit(X, U), X[0].copy(), np.empty(policy.n_actions_)
    theirs = median(_times(lambda: ridge.predict(x[None]), CALLS_AGAINST).tolist())
    numbers, results = np.zeros(800), np.empty(800)
    bare, ours = (
        np.percentile(_times(call, STEPS), [50, 99.9, 100]) / 1e3
        for call in (lambda: np.exp(numbers, results), lambda: step(x, out))
    )
    said = f"{work}, 10^6 steps, µs at median, 99.9th percentile and most: {_list(ours)} (bare exp: {_list(bare)})"
    late = float(ours[1]) * 1e3
    return Ratio(name, said, "Ridge.predict, median", late / theirs, 1.0, late / 1e9, theirs / 1e9)


def _list(microseconds: np.ndarray) -> str:
    return ", ".join(f"{value:.2g}" if value < 10 else f"{value:.0f}" for value in microseconds)


def _times(call: Callable[[], object], count: int) -> np.ndarray:
    """Nanoseconds of each call, without the collector of cycles, which a loop that allocates nothing does not need."""
    times = np.zeros(count, dtype=np.int64)
    for _ in range(100):
        call()
    gc.disable()
    try:
        for k in range(count):
            start = perf_counter_ns()
            call()
            times[k] = perf_counter_ns() - start
    finally:
        gc.enable()
    return times


BENCHMARKS: dict[str, Callable[[], Ratio]] = {
    "step-latency-linear": latency_linear,
    "step-latency-rbf": latency_rbf,
    "step-latency-local": latency_local,
}
