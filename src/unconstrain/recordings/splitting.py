"""Where a recording is broken: gaps in time and jumps in space."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Codes = NDArray[np.int64]

# A gap is this many times the episode's typical step, unless a length is given.
GAP_STEPS = 5.0

# A step this many times faster than all but 5 % of the steps is no motion of a hand.
SUSPICIOUS = 30.0


@dataclass(frozen=True)
class Fragments:
    """What is left of a recording after splitting.

    samples: the indices (M,) kept, in the recording's order; episodes: codes (M,); labels: one per code.
    The other fields count the gaps and fast steps split at, what was dropped, and suspicious steps left.
    """

    samples: Codes
    episodes: Codes
    labels: tuple[str, ...]
    gaps: int
    fast: int
    dropped: int
    dropped_samples: int
    suspicious: int


def split(
    states: Array,
    time: Array,
    episodes: Codes,
    labels: tuple[str, ...],
    *,
    gap: float | None,
    max_speed: float | None,
    long_enough: Callable[[Array], bool],
) -> Fragments:
    """Split episodes at steps longer than `gap` (s) or faster than `max_speed` (units of the states / s).

    The speed of a step is ‖x_{i+1} - x_i‖ / (t_{i+1} - t_i). Without `gap`, five times an episode's median
    step is one. Fragments of a split episode whose stamps are not `long_enough` are dropped; an episode
    that was not split stays. Of several fragments, the i-th kept is labelled `label/i`.
    """
    order = np.argsort(episodes, kind="stable")
    X, t, e = states[order], time[order], episodes[order]
    within = np.diff(e) == 0
    steps = np.diff(t)
    with np.errstate(divide="ignore", invalid="ignore"):  # steps between episodes, masked below
        speeds = np.linalg.norm(np.diff(X, axis=0), axis=1) / steps
    longest = np.full(len(labels), np.inf if gap is None else gap)
    if gap is None:
        for code, own in _grouped(e):
            if own.stop - own.start > 1:
                longest[code] = GAP_STEPS * np.median(steps[own.start : own.stop - 1])
    gaps = within & (steps > longest[e[1:]])
    fast = within & ~gaps & (speeds > (np.inf if max_speed is None else max_speed))
    unbroken = within & ~gaps & ~fast

    fragment = np.concatenate([[0], np.cumsum(~unbroken)])
    kept = np.zeros(len(e), dtype=bool)
    codes = np.zeros(len(e), dtype=np.int64)
    new_labels: list[str] = []
    dropped = 0
    for code, own in _grouped(e):
        parts = [slice(own.start + part.start, own.start + part.stop) for _, part in _grouped(fragment[own])]
        good = [part for part in parts if len(parts) == 1 or long_enough(t[part])]
        dropped += len(parts) - len(good)
        for number, part in enumerate(good, start=1):
            kept[part], codes[part] = True, len(new_labels)
            new_labels.append(labels[code] if len(good) == 1 else f"{labels[code]}/{number}")
    typical = np.percentile(speeds[unbroken], 95) if np.any(unbroken) else 0.0
    suspicious = unbroken & (speeds > SUSPICIOUS * typical) if typical > 0 else np.zeros(0)

    back = np.argsort(order, kind="stable")  # to the order of the file
    samples = np.flatnonzero(kept[back])
    return Fragments(
        samples=samples,
        episodes=codes[back][samples],
        labels=tuple(new_labels),
        gaps=int(gaps.sum()),
        fast=int(fast.sum()),
        dropped=dropped,
        dropped_samples=int(np.sum(~kept)),
        suspicious=int(np.sum(suspicious)),
    )


def _grouped(values: Codes) -> list[tuple[int, slice]]:
    """The runs of equal values, each with the slice it covers."""
    bounds = np.concatenate([[0], np.flatnonzero(np.diff(values)) + 1, [len(values)]]).tolist()
    return [(int(values[a]), slice(a, b)) for a, b in pairwise(bounds)]
