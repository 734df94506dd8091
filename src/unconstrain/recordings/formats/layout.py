"""How the demonstrations of a file that holds a tree of arrays become one table."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from unconstrain.recordings.formats.aligning import find_time, name_of, stack_others
from unconstrain.recordings.formats.borders import Borders, find_borders
from unconstrain.recordings.formats.stacking import Stacked, find_lengths, stack
from unconstrain.recordings.formats.trees import (
    MATRICES,
    Demonstration,
    Found,
    Leaf,
    Node,
    Odd,
    find_demonstrations,
    leaves,
    numbers_in,
    outside,
)

EPISODE, TIME = "episode", "time"
"""What the columns are called that the file itself does not have."""

STEPS = frozenset({"dt", "timestep", "time_step", "sample_time"})
RATES = frozenset(
    {"fps", "hz", "fs", "rate", "freq", "frequency", "control_freq", "sample_rate", "sampling_rate"}
)

MOST_NAMED = 5

MOST_DIMENSIONS = 3
"""Numbers a sample that leave no doubt which axis of a MATLAB array counts them."""


class Layout(NamedTuple):
    """How the demonstrations of a file become a table.

    Parameters
    ----------
    found : Found
    lengths : tuple of int
        Samples of each demonstration.
    stacked : dict of str to Stacked
        The columns, by path.
    unusable : dict of str to str
        Of all other paths, the reason.
    labels : pyarrow.Array
        What each demonstration is called.
    episode, time : str
        What the columns are called that the file itself does not have.
    step : Stacked or None
        The time step, or the rate, of each demonstration.
    step_name : str
    is_rate : bool
    beside : tuple of str
        Arrays beside the demonstrations.
    others : tuple of str
        Parts of the file that hold demonstrations as well.
    borders : tuple of Borders
        What may say where the episodes of a single demonstration begin.
    time_axis : str or None
        As the user gives it.
    clock : str or None
        The path of the column of time, where there is one.
    seconds : tuple of float
        The step of each demonstration, once it was read.
    codes : ndarray of shape (N,) or None
        The episode of each sample, where borders say it.
    """

    found: Found
    lengths: tuple[int, ...]
    stacked: dict[str, Stacked]
    unusable: dict[str, str]
    labels: Any
    episode: str
    time: str
    step: Stacked | None
    step_name: str
    is_rate: bool
    beside: tuple[str, ...]
    others: tuple[str, ...]
    borders: tuple[Borders, ...]
    time_axis: str | None
    clock: str | None
    seconds: tuple[float, ...] = ()
    codes: NDArray[np.int64] | None = None

    @property
    def tells_episodes(self) -> bool:
        """Whether there is a column that tells episodes apart."""
        return bool(self.found.names) or self.codes is not None

    def with_episodes(self, borders: Borders, codes: NDArray[np.int64]) -> "Layout":
        """Return the same table, whose episodes (N,) are told apart by arrays; their ends are no columns."""
        gone = borders.paths if borders.kind in ("ends", "lengths") else ()
        stacked = {path: each for path, each in self.stacked.items() if path not in gone}
        unusable = {path: why for path, why in self.unusable.items() if path not in gone}
        return self._replace(codes=codes, borders=(borders,), stacked=stacked, unusable=unusable)

    def guesses(self, names: Sequence[str]) -> list[str]:
        """Say what was guessed of columns."""
        said = []
        if self.episode in names and self.codes is not None:
            number = int(self.codes[-1]) + 1
            plural = "" if number == 1 else "s"
            said.append(
                f"{number} episode{plural} told apart by {self.borders[0].text}; episode= names another column"
            )
        if self.episode in names and self.found.names:
            where = " and ".join(self.found.names[:MOST_NAMED])
            number = len(self.found.demonstrations)
            text = f"{number} demonstration{'' if number == 1 else 's'} found in {where}, each an episode"
            text += "; episode= names another column"
            if self.others:
                text += f"; part= reads another set: {', '.join(self.others[:MOST_NAMED])}"
            elif self.beside:
                more = f" and {len(self.beside) - MOST_NAMED} more" if len(self.beside) > MOST_NAMED else ""
                text += f"; what lies beside them is not read: {', '.join(self.beside[:MOST_NAMED])}{more}"
            said.append(text)
        if self.step is not None and self.time in names:
            low, high = min(self.seconds), max(self.seconds)
            step = f"{low:.4g} s" if low == high else f"{low:.4g} to {high:.4g} s"
            said.append(
                f"time is counted in steps of {step}, as {self.step_name} says; time= names another column"
            )
        arrays = [name for name in dict.fromkeys(names) if name in self.stacked]
        held = [name for name in arrays if self.stacked[name].is_held and self.stacked[name].width]
        if held:
            said.append(f"{', '.join(held)}: one value for each demonstration, repeated for all its samples")
        apart = [name for name in arrays if self.stacked[name].clocks]
        if apart:
            said.append(
                f"{', '.join(apart)}: brought from stamps of its own to those in {self.clock}, real numbers linearly "
                "and whole ones by the nearest; missing before, after and in gaps; part= reads one group alone"
            )
        spare = [name for name in arrays if self._is_spare(self.stacked[name])]
        if spare:
            said.append(
                f"{', '.join(spare)}: one sample more than in other arrays, the last of which is left out"
            )
        orders: dict[str, list[str]] = {}
        for name in dict.fromkeys(names):
            if name in self.stacked and self.time_axis is None:
                order = self._order(self.stacked[name])
                if order:
                    orders.setdefault(order, []).append(name)
        for order, several in orders.items():
            said.append(
                f"{', '.join(several)} {'is' if len(several) == 1 else 'are'} read as {order}; time_axis= says "
                "which axis is time"
            )
        return said

    def _is_spare(self, each: Stacked) -> bool:
        lengths = [each.length(which) for which in range(len(self.lengths))]
        return not each.clocks and any(
            own not in (None, length) for own, length in zip(lengths, self.lengths, strict=True)
        )

    def _order(self, each: Stacked) -> str:
        """Say in which order of the axes an array is read."""
        orders: dict[str, list[int]] = {}
        for which in range(len(each.parts)):
            orders.setdefault(each.order(which), []).append(which)
        shown = []
        for order, several in orders.items():
            if not order:
                continue
            shape = " x ".join(map(str, each.parts[several[0]].shape))
            count = f" in {len(several)} demonstrations" if len(orders) > 1 else ""
            shown.append(f"{order} ({shape}){count}")
        return " and ".join(shown)


def lay_out(
    tree: dict[str, Node],
    separator: str,
    time_axis: str | None = None,
    episodes_last: bool = False,
) -> Layout:
    """Make a table of a tree.

    Parameters
    ----------
    tree : dict of str to Node
    separator : str
        Of paths.
    time_axis : {"first", "last"}, optional
        Which axis of a demonstration's arrays is time, where that is known.
    episodes_last : bool
        Whether arrays of three axes count episodes along the last, as MATLAB's do, and not along the first.

    Returns
    -------
    Layout
    """
    found = _split_batches(find_demonstrations(tree), separator, time_axis, episodes_last)
    labels = [each.label for each in found.demonstrations]
    arrays = [
        {path or found.members[0]: leaf for path, leaf in leaves(each.content, separator)}
        for each in found.demonstrations
    ]
    lengths = find_lengths(arrays, time_axis)
    stacked, unusable = stack(arrays, lengths, labels, time_axis)
    stacked |= stack_others(arrays, stacked, labels, separator, time_axis)
    unusable = {path: why for path, why in unusable.items() if path not in stacked}
    stacked = {path: replace(each, kind=_plain(each.kind)) for path, each in stacked.items()}
    beside = outside(tree, found, separator)
    for path, node in beside.items():
        reason = node.reason if isinstance(node, Odd) else "lies beside the demonstrations"
        unusable.setdefault(path, reason)
    episode = next(name for name in (EPISODE, "demonstration", "_episode") if name not in stacked)
    step, step_name = None, ""
    if find_time(stacked, separator) is None:
        step, step_name = _find_step(stacked, beside, separator, len(labels))
    text = any(isinstance(label, str) for label in labels)
    return Layout(
        found,
        tuple(lengths),
        stacked,
        unusable,
        pa.array([str(label) for label in labels] if text else labels),
        episode,
        TIME if TIME not in stacked else "time_counted",
        step,
        step_name,
        name_of(step_name, separator) in RATES,
        tuple(path for path, node in beside.items() if numbers_in(node) > 1),
        tuple(separator.join(path) for path in found.others),
        () if found.names else tuple(find_borders(arrays[0], lengths[0], separator)),
        time_axis,
        find_time(stacked, separator),
    )


def _split_batches(found: Found, separator: str, time_axis: str | None, episodes_last: bool) -> Found:
    """Take arrays of episodes, times and dimensions apart, where all of a file's arrays of three axes are such."""
    if found.names:
        return found
    every = dict(leaves(found.demonstrations[0].content, separator))
    arrays = {path: leaf for path, leaf in every.items() if isinstance(leaf, Leaf) and leaf.numbers > 1}
    deep = [leaf.shape for leaf in arrays.values() if len(leaf.shape) == 3]
    if not deep:
        return found
    # Three dimensions or fewer can hardly be told from as many episodes, of which there are more as a rule.
    last = episodes_last and not deep[0][2] <= MOST_DIMENSIONS < deep[0][0]
    inner = (0, 1) if last else (1, 2)
    first = deep[0]
    n_episodes, length = first[2 if last else 0], max(first)
    if time_axis is not None:
        length = first[inner[0 if time_axis == "first" else 1]]

    def within(shape: tuple[int, ...]) -> tuple[int, ...]:
        return shape[inner[0]], shape[inner[1]]

    def is_batch(shape: tuple[int, ...]) -> bool:
        matrices = shape[1:] if last else shape[:2]
        is_pose = matrices in MATRICES and shape[0 if last else 2] == length
        return shape[2 if last else 0] == n_episodes and max(shape) == length in within(shape) and not is_pose

    if not all(map(is_batch, deep)):
        return found

    def split(leaf: Leaf, i: int) -> Leaf:
        shape = leaf.shape
        if len(shape) == 3:
            return replace(leaf, shape=within(shape), index=(..., i) if last else (i,))
        if last and len(shape) == 2 and shape[1] == n_episodes and 1 not in shape:
            return replace(leaf, shape=shape[:1], index=(..., i))
        if not last and shape[0] == n_episodes and leaf.size != length:
            return replace(leaf, shape=shape[1:], index=(i,))
        return leaf

    demonstrations = tuple(
        Demonstration(i, {**every, **{path: split(leaf, i) for path, leaf in arrays.items()}})
        for i in range(n_episodes)
    )
    split_up = ", ".join(path for path, leaf in arrays.items() if len(leaf.shape) == 3)
    names = (f"the {'last' if last else 'first'} axis of {split_up}",)
    return Found((), names, tuple(found.demonstrations[0].content), demonstrations)


def _find_step(
    stacked: dict[str, Stacked], beside: dict[str, Leaf | Odd], separator: str, n_demonstrations: int
) -> tuple[Stacked | None, str]:
    """Find the time step or the rate: of each demonstration, or else of the file."""
    wanted = STEPS | RATES
    for path, each in stacked.items():
        if (
            name_of(path, separator) in wanted
            and each.kind.kind in "iuf"
            and not any(axis is not None for axis in each.axes)
        ):
            return each, path
    for path, node in beside.items():
        if isinstance(node, Leaf) and name_of(path, separator) in wanted and _is_number(node):
            parts = (node,) * n_demonstrations
            return Stacked(parts, (None,) * n_demonstrations, 0, node.kind), path
    return None, ""


def _is_number(leaf: Leaf) -> bool:
    return leaf.size == 1 and leaf.kind.kind in "iuf"


def _plain(kind: np.dtype) -> np.dtype:
    """Return the type in which values are read: one that Arrow has."""
    if kind.kind == "f" and kind.itemsize not in (4, 8):
        return np.dtype(np.float32 if kind.itemsize < 4 else np.float64)
    return kind.newbyteorder("=")
