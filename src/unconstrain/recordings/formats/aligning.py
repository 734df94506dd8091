"""Arrays of a file that were recorded at a rate of their own, brought to the stamps of the others."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.recordings.formats.stacking import Stacked, stack
from unconstrain.recordings.formats.trees import Leaf, Odd
from unconstrain.recordings.gaps import GAP_STEPS

TIMES = frozenset({"t", "time", "times", "timestamp", "timestamps", "time_s", "stamp", "stamps"})
"""What columns of time are called, in small letters."""


def name_of(path: str, separator: str) -> str:
    """Return the last part of a path, in small letters."""
    return path.rsplit(separator, 1)[-1].strip().lower()


def find_time(stacked: Mapping[str, Stacked], separator: str) -> str | None:
    """Return the path of the first column of one number a sample that is called as time is."""
    for path, each in stacked.items():
        if name_of(path, separator) in TIMES and not each.width and not each.is_held:
            return path
    return None


def stack_others(
    demonstrations: Sequence[Mapping[str, Leaf | Odd]],
    stacked: Mapping[str, Stacked],
    labels: Sequence[str | int],
    separator: str,
    time_axis: str | None,
) -> dict[str, Stacked]:
    """Stack the arrays of another length that have stamps of their own in the same group.

    Parameters
    ----------
    demonstrations : sequence of mapping of str to Leaf or Odd
        The arrays by path.
    stacked : mapping of str to Stacked
        Those that are stacked already, the time among them.
    labels : sequence of (str or int)
        What a sentence calls each demonstration.
    separator : str
        Of paths.
    time_axis : {"first", "last"}, optional
        Which axis of each is time, where that is known.

    Returns
    -------
    dict of str to Stacked
        With their `clocks`; none where the others have no stamps.
    """
    found: dict[str, Stacked] = {}
    if find_time(stacked, separator) is None:
        return found
    for path in demonstrations[0]:
        if path in stacked or name_of(path, separator) in TIMES:
            continue
        arrays = [own.get(path) for own in demonstrations]
        clocks = [_clock_beside(path, own, separator) for own in demonstrations]
        leaves = [
            leaf for leaf in arrays if isinstance(leaf, Leaf) and leaf.kind.kind in "biuf" and leaf.numbers
        ]
        stamps = [leaf for leaf in clocks if leaf is not None]
        if not len(leaves) == len(stamps) == len(demonstrations):
            continue
        if all(clock.size in leaf.shape for leaf, clock in zip(leaves, stamps, strict=True)):
            alone = [{path: leaf} for leaf in leaves]
            usable, _ = stack(alone, [clock.size for clock in stamps], labels, time_axis)
            if path in usable and not usable[path].is_held:
                found[path] = replace(usable[path], kind=np.dtype(np.float64), clocks=tuple(stamps))
    return found


def bring(values: NDArray[Any], own: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bring values to other stamps: real numbers linearly, whole ones by the nearest.

    Parameters
    ----------
    values : ndarray of shape (N,) or (N, k)
    own : ndarray of shape (N,)
        Their stamps; one that does not go on is left out with its values.
    at : ndarray of shape (M,)
        The others.

    Returns
    -------
    ndarray of shape (M,) or (M, k)
        NaN outside of their own stamps, and in gaps longer than `GAP_STEPS` typical steps.
    """
    rising = own > np.concatenate([[-np.inf], np.maximum.accumulate(own)[:-1]])
    own, columns = own[rising], values[rising].reshape(int(rising.sum()), -1).astype(np.float64)
    if len(own) < 2:
        return np.full((len(at), *values.shape[1:]), np.nan)
    after = np.clip(np.searchsorted(own, at, side="left"), 1, len(own) - 1)
    before = after - 1
    step = own[after] - own[before]
    share = (at - own[before]) / step
    if values.dtype.kind != "f":
        share = np.round(share)
    mixed = (1.0 - share)[:, None] * columns[before] + share[:, None] * columns[after]
    lacks = (at < own[0]) | (at > own[-1]) | (step > GAP_STEPS * np.median(np.diff(own)))
    mixed[lacks] = np.nan
    return mixed.reshape(len(at), *values.shape[1:])


def _clock_beside(path: str, arrays: Mapping[str, Leaf | Odd], separator: str) -> Leaf | None:
    """Return the stamps in the group of an array, if it has any."""
    group = path.rpartition(separator)[0]
    for other, leaf in arrays.items():
        beside = other.rpartition(separator)[0] == group and name_of(other, separator) in TIMES
        if (
            beside
            and isinstance(leaf, Leaf)
            and leaf.kind.kind in "iuf"
            and leaf.size == max(leaf.shape, default=0)
        ):
            return leaf
    return None
