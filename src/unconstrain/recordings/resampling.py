"""Samples brought to even times."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unconstrain.recordings.steps import LONG_STEPS, comes_in_bursts, runs, typical_step

Array = NDArray[np.float64]
Codes = NDArray[np.int64]


@dataclass(frozen=True)
class Grid:
    """Even times, and between which samples each of them lies.

    Parameters
    ----------
    time : ndarray of shape (M,)
        Seconds.
    episodes : ndarray of shape (M,)
    before, after : ndarray of shape (M,)
        The samples on either side.
    share : ndarray of shape (M,)
        How far on the way from one to the other, from 0 to 1.
    """

    time: Array
    episodes: Codes
    before: Codes
    after: Codes
    share: Array

    @property
    def nearest(self) -> Codes:
        """The nearest sample of each time, (M,)."""
        return np.where(self.share < 0.5, self.before, self.after)

    def between(self, values: Array) -> Array:
        """Interpolate values (N, ...) linearly."""
        share = self.share.reshape(-1, *[1] * (values.ndim - 1))
        return (1.0 - share) * values[self.before] + share * values[self.after]


def make_grid(time: Array, episodes: Codes, rate: float) -> Grid:
    """Lay even times over each episode, from its first sample on.

    Stamps in bursts are spread evenly before, since the last of a burst is the one that came in time.

    Parameters
    ----------
    time : ndarray of shape (N,)
        Seconds, strictly increasing within an episode.
    episodes : ndarray of shape (N,)
        Numbers from 0, each used; no episode has a gap.
    rate : float
        Samples a second.

    Returns
    -------
    Grid
    """
    parts = []
    for code, own in enumerate(runs(episodes)):
        stamps = spread(time[own])
        count = count_even(float(stamps[-1] - stamps[0]), rate)
        even = stamps[0] + np.arange(count) / rate
        right = np.clip(np.searchsorted(stamps, even, side="left"), 1, max(len(own) - 1, 1))
        left, right = right - 1, np.minimum(right, len(own) - 1)
        width = stamps[right] - stamps[left]
        share = np.clip((even - stamps[left]) / np.where(width > 0, width, 1.0), 0.0, 1.0)
        parts.append(Grid(even, np.full(count, code), own[left], own[right], share))
    names = ("time", "episodes", "before", "after", "share")
    return Grid(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def count_even(seconds: float, rate: float) -> int:
    """Return how many samples a fragment of this duration has at a rate; rounding does not cost the last one."""
    return int(np.floor(seconds * rate * (1 + 1e-9))) + 1


def spread(stamps: Array) -> Array:
    """Spread the stamps (N,) of bursts evenly between the ends of bursts; return others as they are."""
    steps = np.diff(stamps)
    if not comes_in_bursts(steps):
        return stamps
    ends = np.append(np.flatnonzero(steps > LONG_STEPS * np.median(steps)), len(stamps) - 1)
    if ends[0] > 0:
        # What the first burst holds came at the usual step before its end.
        first = stamps[ends[0]] - ends[0] * typical_step(steps)
        return np.interp(np.arange(len(stamps)), [0, *ends], [first, *stamps[ends]])
    return np.interp(np.arange(len(stamps)), ends, stamps[ends])
