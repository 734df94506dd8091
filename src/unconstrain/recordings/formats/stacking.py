"""Arrays of several demonstrations, stacked along time: which axis that is, and what cannot be stacked."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from unconstrain.recordings.formats.trees import MATRICES, WIDEST, Leaf, Odd

Shape = tuple[int, ...]

MOST_HELD = 32
"""Numbers, at most, of an array that holds for a whole demonstration, as the position of its goal does."""

HELD_FROM = 3
"""Samples, at least, for each of these numbers: an array that is a little shorter than others is another mistake."""

WIDE, WIDER = 64, 4
"""How many dimensions, and how many times as many as samples, leave no doubt that an axis is not time."""

SPARE_FROM = 30
"""Samples of a demonstration from which arrays that have one more are taken to begin with the others."""


@dataclass(frozen=True)
class Stacked:
    """An array of every demonstration, as columns of one table.

    Parameters
    ----------
    parts : tuple of Leaf
        One a demonstration.
    axes : tuple of (int or None)
        Which axis of each is time; None for a number, vector or matrix that holds for all samples of its demonstration.
    width : int
        Numbers a sample; 0 for an array of one number a sample.
    kind : numpy.dtype
        Of all parts.
    clocks : tuple of Leaf
        The stamps of each, where these are others than those of the table; none otherwise.
    """

    parts: tuple[Leaf, ...]
    axes: tuple[int | None, ...]
    width: int
    kind: np.dtype
    clocks: tuple[Leaf, ...] = ()

    @property
    def is_held(self) -> bool:
        """Whether it holds for all samples of a demonstration."""
        return None in self.axes

    def length(self, which: int) -> int | None:
        """Return the number of samples of a part; None where it holds for all of its demonstration."""
        axis = self.axes[which]
        return None if axis is None else self.parts[which].shape[axis]

    def order(self, which: int) -> str:
        """Say in which order the axes of a part are; "" where there is but one way to read it."""
        shape, axis = self.parts[which].shape, self.axes[which]
        if axis is None or sum(length != 1 for length in shape) < 2:
            return ""
        return "time x dimensions" if axis == 0 else "dimensions x time"

    def arrange(self, which: int, array: NDArray, length: int) -> NDArray:
        """Bring a part into the shape (length,) or (length, width)."""
        axis = self.axes[which]
        if axis is None:
            rows = np.broadcast_to(array.reshape(1, -1), (length, array.size))
        else:
            rows = array if axis == 0 else np.moveaxis(array, axis, 0)
            rows = rows[:length].reshape(length, -1)
        return rows if self.width else rows[:, 0]


def find_lengths(
    demonstrations: Sequence[Mapping[str, Leaf | Odd]], time_axis: str | None = None
) -> list[int]:
    """Find how many samples each demonstration has.

    It is the length that most of a demonstration's arrays have an axis of. Where the axes of several lengths are as
    many, one that differs between demonstrations, and the longest, come first.

    Parameters
    ----------
    demonstrations : sequence of mapping of str to Leaf or Odd
        The arrays by path.
    time_axis : {"first", "last"}, optional
        Which axis is time, where that is known.

    Returns
    -------
    list of int
        Zero where a demonstration has no arrays.
    """
    lengths_at: dict[tuple[str, int], set[int]] = {}
    for arrays in demonstrations:
        for path, axis, length in _axes(arrays, time_axis):
            lengths_at.setdefault((path, axis), set()).add(length)
    found = []
    for arrays in demonstrations:
        votes = Counter(
            length for length, _ in {(length, path) for path, _, length in _axes(arrays, time_axis)}
        )
        longest = max(votes, default=0)
        votes[longest] += 1
        votes.update({n for path, axis, n in _axes(arrays, time_axis) if len(lengths_at[path, axis]) > 1})
        found.append(max(votes, key=partial(_rank, votes)))
    if all(_is_spare(arrays, length) for arrays, length in zip(demonstrations, found, strict=True)):
        return [length - 1 for length in found]
    return found


def _is_spare(arrays: Mapping[str, Leaf | Odd], length: int) -> bool:
    """Whether other arrays have one sample less, as actions have that lie between observations."""
    leaves = [node for node in arrays.values() if isinstance(node, Leaf) and node.numbers > 1]
    fewer = [leaf for leaf in leaves if length - 1 in leaf.shape and length not in leaf.shape]
    return length > SPARE_FROM and bool(fewer)


def stack(
    demonstrations: Sequence[Mapping[str, Leaf | Odd]],
    lengths: Sequence[int],
    labels: Sequence[str | int],
    time_axis: str | None = None,
) -> tuple[dict[str, Stacked], dict[str, str]]:
    """Stack the arrays of demonstrations that fit together.

    Parameters
    ----------
    demonstrations : sequence of mapping of str to Leaf or Odd
        The arrays by path.
    lengths : sequence of int
        As `find_lengths` gives them.
    labels : sequence of (str or int)
        What a sentence calls each.
    time_axis : {"first", "last"}, optional
        Which axis is time, where that is known.

    Returns
    -------
    stacked : dict of str to Stacked
        By path.
    unusable : dict of str to str
        Of all other paths, the reason.
    """
    leading = _usual_order(demonstrations, lengths) if time_axis is None else time_axis == "first"
    strict = time_axis is not None
    stacked: dict[str, Stacked] = {}
    unusable: dict[str, str] = {}
    for path in dict.fromkeys(path for arrays in demonstrations for path in arrays):
        result = _stack_one([arrays.get(path) for arrays in demonstrations], lengths, labels, leading, strict)
        if isinstance(result, str):
            unusable[path] = result
        else:
            stacked[path] = result
    return stacked, unusable


def _stack_one(
    nodes: Sequence[Leaf | Odd | None],
    lengths: Sequence[int],
    labels: Sequence[str | int],
    leading: bool,
    strict: bool,
) -> Stacked | str:
    parts: list[Leaf] = []
    axes: list[int | None] = []
    widths: dict[int, str | int] = {}
    for node, length, label in zip(nodes, lengths, labels, strict=True):
        if node is None:
            return f"is missing in demonstration {label}"
        if isinstance(node, Odd):
            return node.reason if len(nodes) == 1 else f"{node.reason} in demonstration {label}"
        if node.kind.kind not in "biufUSMm":
            return f"holds values of type {node.kind}"
        if node.is_image:
            return "holds bytes along several axes, as images do"
        axis = _time_axis(node.shape, length, leading, strict)
        if axis is None and strict and length in node.shape and node.size != 1:
            return f"has shape {node.shape}, in which time is not the {'first' if leading else 'last'} axis"
        if axis is None and node.size != 1 and not _may_be_held(node, length, len(nodes) > 1):
            where = f" in demonstration {label}" if len(nodes) > 1 else ""
            return f"has shape {node.shape}{where}, of which no axis has the {length} samples that other arrays share"
        width = node.size if axis is None else node.size // node.shape[axis]
        if strict and axis is not None and width > WIDE and width > WIDER * node.shape[axis]:
            opposite = "last" if leading else "first"
            return (
                f"has {width} numbers a sample and but {node.shape[axis]} samples, if time is its "
                f"{'first' if leading else 'last'} axis: time_axis={opposite} reads it the other way round"
            )
        if width > WIDEST:
            return f"holds {width} numbers a sample, as images do"
        widths.setdefault(width, label)
        parts.append(node)
        axes.append(axis)
    if len(widths) > 1:
        (first, one), (second, other) = list(widths.items())[:2]
        return f"has {first} numbers a sample in demonstration {one} but {second} in {other}"
    if len({axis is None for axis in axes}) > 1:
        return "holds for all of some demonstrations and changes in others"
    kinds = {"text" if part.kind.kind in "US" else "number" for part in parts}
    if len(kinds) > 1:
        return "holds text in some demonstrations and numbers in others"
    width = next(iter(widths))
    kind = np.result_type(*{part.kind for part in parts})
    return Stacked(tuple(parts), tuple(axes), 0 if width == 1 else width, kind)


def _usual_order(demonstrations: Sequence[Mapping[str, Leaf | Odd]], lengths: Sequence[int]) -> bool:
    """Whether time is mostly the first axis, by which square arrays are read."""
    first = last = 0
    for arrays, length in zip(demonstrations, lengths, strict=True):
        for node in arrays.values():
            if isinstance(node, Leaf) and len(node.shape) > 1 and node.shape.count(length) == 1:
                first += node.shape[0] == length
                last += node.shape[-1] == length
    return first >= last


def _time_axis(shape: Shape, length: int, leading: bool, strict: bool) -> int | None:
    places = [axis for axis, size in enumerate(shape) if size == length]
    if not places and length >= SPARE_FROM:
        places = [axis for axis, size in enumerate(shape) if size == length + 1]
    if strict and sum(size != 1 for size in shape) > 1:
        places = [axis for axis in places if axis == (0 if leading else len(shape) - 1)]
    if not places or (length == 1 and math.prod(shape) == 1):
        return None
    return places[0] if leading else places[-1]


def _may_be_held(leaf: Leaf, length: int, repeats: bool) -> bool:
    """Whether an array may hold for a whole demonstration: a short vector or, where these repeat, a matrix."""
    is_vector = sum(size != 1 for size in leaf.shape) < 2
    fits = leaf.kind.kind in "biuf" and leaf.size <= min(MOST_HELD, length // HELD_FROM)
    return fits and (is_vector or (repeats and leaf.shape in MATRICES))


def _rank(votes: Counter[int], length: int) -> tuple[int, int]:
    return votes[length], length


def _axes(arrays: Mapping[str, Leaf | Odd], time_axis: str | None) -> list[tuple[str, int, int]]:
    """Return by path each axis that may be time, and its length."""
    return [
        (path, axis, length)
        for path, node in arrays.items()
        if isinstance(node, Leaf) and node.kind.kind in "biuf" and node.numbers
        for axis, length in enumerate(node.shape)
        if length > 1
        and (
            time_axis is None
            or node.size == length
            or axis == (0 if time_axis == "first" else len(node.shape) - 1)
        )
    ]
