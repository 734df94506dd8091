"""The steps between the stamps of an episode."""

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.recordings.episodewise import median

# Stamps come in bursts where more of the steps than this are longer than five median ones.
BURSTS = 0.05
LONG_STEPS = 5.0


# Between bursts less than this passes (s); what is longer is a gap.
BETWEEN = 1.0


def typical_step(steps: NDArray[Any], second: float = 1.0) -> float:
    """Return the step between samples that most steps are near to.

    It is the median, but where stamps come in bursts the mean of all steps that are no gaps.

    Parameters
    ----------
    steps : ndarray of shape (M,)
        In any unit.
    second : float
        A second in that unit.

    Returns
    -------
    float
        In that unit; 0.0 where there is none.
    """
    going = steps[steps > 0]
    if not len(going):
        return 0.0
    if not comes_in_bursts(going, second):
        return median(going)
    return float(np.mean(going[going <= LONG_STEPS * np.percentile(going, 95)]))


def comes_in_bursts(steps: NDArray[Any], second: float = 1.0) -> bool:
    """Whether most steps (M,) are much shorter than what passes between samples; a `second` is in their unit."""
    if len(steps) < 2:
        return False
    if are_even(steps):
        return False
    long = steps[steps > LONG_STEPS * median(steps)]
    return len(long) > BURSTS * len(steps) and bool(np.median(long) <= BETWEEN * second)


def are_even(steps: NDArray[Any]) -> bool:
    """Whether no step (M,) is longer than `LONG_STEPS` times another, nor than any median of some of them."""
    if not len(steps):
        return True
    least = steps.min()
    return bool(least > 0 and steps.max() <= LONG_STEPS * least)


def follow_each_other(codes: NDArray[np.int64]) -> bool:
    """Whether the samples of each episode follow each other, in the order of `codes` (N,), which number them."""
    return bool(np.all(codes[1:] >= codes[:-1]))


def runs(codes: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Return the samples of each episode, in order, where `codes` (N,) number the episodes from 0."""
    order = np.arange(len(codes)) if follow_each_other(codes) else np.argsort(codes, kind="stable")
    bounds = [0, *np.cumsum(np.bincount(codes)).tolist()]
    return [order[a:b] for a, b in pairwise(bounds) if b > a]
