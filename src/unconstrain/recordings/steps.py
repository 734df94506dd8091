"""The steps between the stamps of an episode."""

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Stamps come in bursts where more of the steps than this are longer than five median ones.
BURSTS = 0.05
LONG_STEPS = 5.0


def typical_step(steps: NDArray[Any]) -> float:
    """Return the step between samples (M,) that most steps are near to, in their unit; 0.0 where there is none.

    It is the median, but where stamps come in bursts the mean of all steps that are no gaps.
    """
    going = steps[steps > 0]
    if not len(going):
        return 0.0
    if not comes_in_bursts(going):
        return float(np.median(going))
    return float(np.mean(going[going <= LONG_STEPS * np.percentile(going, 95)]))


def comes_in_bursts(steps: NDArray[Any]) -> bool:
    """Whether most steps (M,) are much shorter than what passes between samples."""
    return len(steps) > 1 and bool(np.mean(steps > LONG_STEPS * np.median(steps)) > BURSTS)


def runs(codes: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Return the samples of each episode, in order, where `codes` (N,) number the episodes from 0."""
    order = np.argsort(codes, kind="stable")
    bounds = [0, *np.cumsum(np.bincount(codes)).tolist()]
    return [order[a:b] for a, b in pairwise(bounds) if b > a]
