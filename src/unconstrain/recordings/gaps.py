"""Where a recording is broken: gaps in time and jumps in space."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from unconstrain.recordings.episodewise import percentile, step_norms
from unconstrain.recordings.steps import follow_each_other, typical_step

Array = NDArray[np.float64]
Codes = NDArray[np.int64]

# A gap is this many times the episode's typical step, unless a length is given.
GAP_STEPS = 5.0

# A step this many times faster than all but 5 % of the episode's steps is no motion of a hand.
SUSPICIOUS = 30.0


@dataclass(frozen=True)
class Fragments:
    """What is left of episodes after splitting.

    Parameters
    ----------
    samples : ndarray of shape (M,)
        Indices of the samples kept, in the recording's order.
    episodes : ndarray of shape (M,)
        The fragment of each, as a number from 0.
    origins : tuple of (int, int)
        Of each fragment, the episode it is from, and which of that episode's fragments it is, counted from 1; 0 where
        it is the only one.
    gaps, fast, dropped, dropped_samples, suspicious : int
        How many gaps and fast steps were split at, what was dropped, and the suspicious steps that are left.
    """

    samples: Codes
    episodes: Codes
    origins: tuple[tuple[int, int], ...]
    gaps: int
    fast: int
    dropped: int
    dropped_samples: int
    suspicious: int


def split(
    states: Array,
    time: Array,
    episodes: Codes,
    *,
    gap: float | None,
    max_speed: float | None,
    long_enough: Callable[[Array], bool],
    drop_short: bool = False,
) -> Fragments:
    """Split episodes at steps longer than `gap` or faster than `max_speed`.

    The speed of a step is ‖x_{i+1} - x_i‖ / (t_{i+1} - t_i). Fragments of a split episode that are not `long_enough`
    are dropped; an episode that was not split stays, unless `drop_short`. All is decided episode by episode, so
    that it does not matter which episodes are split together.

    Parameters
    ----------
    states : ndarray of shape (N, n)
    time : ndarray of shape (N,)
        Seconds, strictly increasing within an episode.
    episodes : ndarray of shape (N,)
        Numbers from 0, each used; episodes may be interleaved.
    gap : float or None
        Seconds; None for five times an episode's typical step.
    max_speed : float or None
        [units of the states] / s.
    long_enough : function
        Of the stamps of a fragment.
    drop_short : bool
        Whether whole episodes that are not `long_enough` are dropped too.

    Returns
    -------
    Fragments
    """
    X, t, e = states, time, episodes
    follow = follow_each_other(episodes)
    if not follow:
        order = np.argsort(episodes, kind="stable")
        X, t, e = states[order], time[order], episodes[order]
    own = _runs(e)
    within = e[1:] == e[:-1]
    steps = np.diff(t)
    with np.errstate(divide="ignore", invalid="ignore"):  # steps between episodes, masked below
        speeds = step_norms(X) / steps
    longest = np.full(len(own), np.inf if gap is None else gap)
    if gap is None:
        for code, one in enumerate(own):
            if one.stop - one.start > 1:
                longest[code] = GAP_STEPS * typical_step(steps[one.start : one.stop - 1])
    never = np.zeros(len(steps), dtype=bool)
    gaps = within & (steps > longest[e[1:]]) if np.isfinite(longest).any() else never
    fast = never if max_speed is None else within & ~gaps & (speeds > max_speed)
    unbroken = within & ~gaps & ~fast

    fragment = np.concatenate([[0], np.cumsum(~unbroken)])
    kept = np.zeros(len(e), dtype=bool)
    codes = np.zeros(len(e), dtype=np.int64)
    origins: list[tuple[int, int]] = []
    dropped = suspicious = 0
    for code, one in enumerate(own):
        whole = fragment[one.start] == fragment[one.stop - 1]
        parts = (
            [one]
            if whole
            else [slice(one.start + part.start, one.start + part.stop) for part in _runs(fragment[one])]
        )
        good = [part for part in parts if (len(parts) == 1 and not drop_short) or long_enough(t[part])]
        dropped += len(parts) - len(good)
        for number, part in enumerate(good, start=1):
            kept[part], codes[part] = True, len(origins)
            origins.append((code, number if len(good) > 1 else 0))
        own_speeds = speeds[one.start : one.stop - 1]
        if not whole:
            own_speeds = own_speeds[unbroken[one.start : one.stop - 1]]
        typical = percentile(own_speeds, 95) if len(own_speeds) else 0.0
        suspicious += int(np.sum(own_speeds > SUSPICIOUS * typical)) if typical > 0 else 0

    if not follow:  # to the order of the file
        back = np.argsort(order, kind="stable")
        kept, codes = kept[back], codes[back]
    samples = np.flatnonzero(kept)
    return Fragments(
        samples=samples,
        episodes=codes[samples],
        origins=tuple(origins),
        gaps=int(gaps.sum()),
        fast=int(fast.sum()),
        dropped=dropped,
        dropped_samples=int(np.sum(~kept)),
        suspicious=suspicious,
    )


def _runs(values: Codes) -> Sequence[slice]:
    """Find the runs of equal values."""
    bounds = np.concatenate([[0], np.flatnonzero(np.diff(values)) + 1, [len(values)]]).tolist()
    return [slice(a, b) for a, b in pairwise(bounds)]
