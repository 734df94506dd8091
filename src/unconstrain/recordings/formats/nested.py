"""What files that hold a tree of arrays have in common: their demonstrations are read as one table."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.memory import check_memory
from unconstrain.recordings.columns import Columns
from unconstrain.recordings.files import File
from unconstrain.recordings.formats.base import GUESS, ColumnKey, Declared, damage_named
from unconstrain.recordings.formats.npz import to_arrow
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
from unconstrain.recordings.table import Column, Header, row

EPISODE, TIME = "episode", "time"
"""What the columns are called that the file itself does not have."""

TIMES = frozenset({"t", "time", "times", "timestamp", "timestamps", "time_s", "stamp", "stamps"})
STEPS = frozenset({"dt", "timestep", "time_step", "sample_time"})
RATES = frozenset(
    {"fps", "hz", "fs", "rate", "freq", "frequency", "control_freq", "sample_rate", "sampling_rate"}
)

HELD = 0.5
"""Share of steps without a change from which a sensor is taken to have stopped, where elsewhere it changes."""

MOST_NAMED = 5

Fetch = Callable[[Leaf], NDArray[Any]]


class Nested:
    """A file that holds a tree of arrays, of which the demonstrations are stacked along time.

    A column is called by the path of its array within a demonstration: `pos[0]`, `pos[1]`. The column `episode` tells
    demonstrations apart. Scalars of a demonstration hold for all its samples; one that is the time step or the rate
    gives the column `time`, where there is no time.

    Parameters
    ----------
    file : File
    """

    suffixes: ClassVar[tuple[str, ...]] = ()
    at_once: ClassVar[bool] = False
    separator: ClassVar[str] = "."
    kind: ClassVar[str] = "a file of arrays"

    def __init__(self, file: File) -> None:
        self.file = file
        self.time_axis: str | None = None

    def with_time_axis(self, axis: str) -> "Nested":
        """Return the same file, in whose demonstrations the first or the last axis is time, as a user says."""
        other = copy(self)
        other.time_axis = axis
        return other

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the content is of this format; each format says by what it knows its own."""
        return False

    def columns(self) -> Header:
        """Return the arrays of the demonstrations as columns."""
        table, rows = self._table, sum(self.row_groups)
        columns: list[Column] = []
        lists: dict[str, tuple[pa.DataType, int | None]] = {}
        for path, each in table.stacked.items():
            kind = _arrow_type(each.kind)
            if not each.width:
                columns.append(Column(path, kind, rows))
                continue
            lists[path] = pa.list_(kind, each.width), rows
            parts = range(each.width)
            columns += [Column(f"{path}[{i}]", kind, rows, 0, path, i, each.width) for i in parts]
        if table.step is not None:
            columns.append(Column(table.time, pa.float64(), rows))
        if table.found.names:
            columns.append(Column(table.episode, table.labels.type, rows))
        return Header(self.file.shown, columns, lists, table.unusable)

    def declared(self) -> Declared | None:
        """Return which column tells episodes apart, and which is the time, where these are known."""
        return self._declared

    @property
    def row_groups(self) -> tuple[int, ...]:
        """The number of samples of each demonstration."""
        return self._table.lengths

    def read(
        self, columns: Sequence[ColumnKey], start: int = 0, stop: int | None = None
    ) -> Iterator[tuple[int, pa.RecordBatch]]:
        """Read samples of these columns, a demonstration at a time, each with its first row."""
        table = self._table
        names = [name for name, _ in columns]
        stop = sum(table.lengths) if stop is None else stop
        guesses = table.guesses(names)
        held = _Held()
        begin = 0
        with damage_named(self.file.shown, self.kind), self.opened() as fetch:
            for which, length in enumerate(table.lengths):
                low, high = max(start - begin, 0), min(stop - begin, length)
                if low < high:
                    whole = high - low == length
                    values = self._read_one(fetch, which, names, held if whole else None)
                    said = [*guesses, *(held.notes() if begin + high == stop else ())]
                    about = {GUESS: "\n".join(said)} if said else None
                    batch = pa.RecordBatch.from_arrays(values, names=names, metadata=about)
                    yield begin + low, batch.slice(low, high - low)
                begin += length

    def place(self, index: int) -> str:
        """Say in which demonstration a row is."""
        table = self._table
        if not table.found.names:
            return row(index)
        ends = np.cumsum(table.lengths)
        which = int(np.searchsorted(ends, index, side="right"))
        own = index - int(ends[which]) + table.lengths[which]
        return f"{row(own)} of demonstration {table.found.demonstrations[which].label}"

    def in_one_thread(self) -> "Nested":
        """Return the same file, decoded by one thread."""
        return self

    def identity(self) -> str:
        """Say what tells the file from others."""
        return repr(self.file.identity())

    def __getstate__(self) -> dict[str, Any]:
        """Return the file alone: what was read of it may be large."""
        return {"file": replace(self.file), "time_axis": self.time_axis}

    def tree(self) -> dict[str, Node]:
        """Read what there is in the file. Each format has its own."""
        raise NotImplementedError

    def opened(self) -> AbstractContextManager[Fetch]:
        """Open the file, and return what reads one of its arrays. Each format has its own."""
        raise NotImplementedError

    @cached_property
    def _table(self) -> "_Table":
        shown = self.file.shown
        with damage_named(shown, self.kind):
            tree = self.tree()
            table = _lay_out(tree, self.separator, self.time_axis)
        if not table.stacked or not sum(table.lengths):
            reasons = [f"{path!r} {reason}" for path, reason in table.unusable.items()]
            why = f" ({'; '.join(reasons[:MOST_NAMED])})" if reasons else ""
            raise DataError(f"{shown} holds no arrays that could be columns{why}")
        if table.step is None:
            return table
        with damage_named(shown, self.kind), self.opened() as fetch:
            steps = np.array(
                [float(np.asarray(fetch(part)).reshape(-1)[0]) for part in table.step.parts], np.float64
            )
        with np.errstate(divide="ignore"):
            seconds = 1.0 / steps if table.is_rate else steps
        if not np.all((seconds > 0) & np.isfinite(seconds)):
            return table._replace(step=None)
        return table._replace(seconds=tuple(seconds.tolist()))

    @cached_property
    def _declared(self) -> Declared | None:
        table = self._table
        time = (
            table.time
            if table.step is not None
            else next(
                (
                    path
                    for path in table.stacked
                    if _last(path, self.separator) in TIMES and self._increases(path)
                ),
                None,
            )
        )
        episode = table.episode if table.found.names else None
        if time is episode is None:
            return None
        said = (
            () if time is None or table.step is not None else (f"time is {time}; time= names another column",)
        )
        return Declared(Columns(time=time, episode=episode), notes=said)

    def _increases(self, path: str) -> bool:
        """Whether a column increases strictly within each demonstration."""
        each = self._table.stacked[path]
        if each.width or each.kind.kind not in "iuf" or any(axis is None for axis in each.axes):
            return False
        with damage_named(self.file.shown, self.kind), self.opened() as fetch:
            values = (self._read_one(fetch, which, [path], None)[0] for which in range(len(each.parts)))
            return all(bool(np.all(np.diff(np.asarray(column, np.float64)) > 0)) for column in values)

    def _read_one(
        self, fetch: Fetch, which: int, names: Sequence[str], held: "_Held | None"
    ) -> list[pa.Array]:
        """Read columns of one demonstration."""
        table = self._table
        length = table.lengths[which]
        parts = {name: table.stacked[name] for name in names if name in table.stacked}
        needed = sum(2.0 * 8 * length * max(each.width, 1) for each in parts.values())
        needed += sum(float(each.parts[which].size * each.kind.itemsize) for each in parts.values())
        check_memory(
            needed, f"reading {self.file.shown}", "read fewer columns, or write shorter demonstrations"
        )
        label = table.found.demonstrations[which].label
        values: list[pa.Array] = []
        for name in names:
            if name == table.time and table.step is not None:
                values.append(pa.array(np.arange(length) * table.seconds[which]))
                continue
            if name not in parts:
                values.append(pa.array([table.labels[which].as_py()] * length, table.labels.type))
                continue
            each = parts[name]
            array = np.asarray(fetch(each.parts[which]))
            if array.shape != each.parts[which].shape:
                raise ValueError("an array has another shape than it promises")
            array = each.arrange(which, array, length)
            if held is not None and not each.is_held:
                held.add(name, array, label)
            values.append(to_arrow(array.astype(each.kind, copy=False)))
        return values


class _Table(NamedTuple):
    """How the demonstrations of a file become a table."""

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
    time_axis: str | None
    seconds: tuple[float, ...] = ()

    def guesses(self, names: Sequence[str]) -> list[str]:
        """Say what was guessed of columns."""
        said = []
        if self.episode in names and self.found.names:
            where = " and ".join(self.found.names[:MOST_NAMED])
            number = len(self.found.demonstrations)
            text = f"{number} demonstration{'' if number == 1 else 's'} found in {where}, each an episode"
            text += "; episode= names another column"
            if self.beside:
                more = f" and {len(self.beside) - MOST_NAMED} more" if len(self.beside) > MOST_NAMED else ""
                text += f"; what lies beside them is not read: {', '.join(self.beside[:MOST_NAMED])}{more}"
            said.append(text)
        if self.step is not None and self.time in names:
            low, high = min(self.seconds), max(self.seconds)
            step = f"{low:.4g} s" if low == high else f"{low:.4g} to {high:.4g} s"
            said.append(
                f"time is counted in steps of {step}, as {self.step_name} says; time= names another column"
            )
        orders: dict[str, list[str]] = {}
        for name in dict.fromkeys(names):
            if name in self.stacked and self.time_axis is None:
                order = self._order(self.stacked[name])
                if order:
                    orders.setdefault(order, []).append(name)
        for order, arrays in orders.items():
            said.append(
                f"{', '.join(arrays)} {'is' if len(arrays) == 1 else 'are'} read as {order}; time_axis= says "
                "which axis is time"
            )
        return said

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


class _Held:
    """Columns that hold one value in some demonstrations and not in others, as when a sensor has stopped."""

    def __init__(self) -> None:
        self._shares: dict[str, list[tuple[str | int, NDArray[np.bool_]]]] = {}

    def add(self, name: str, array: NDArray[Any], label: str | int) -> None:
        if len(array) < 3 or array.dtype.kind not in "iuf":
            return
        still = np.mean(array[1:] == array[:-1], axis=0)
        self._shares.setdefault(name, []).append((label, np.atleast_1d(still) > HELD))

    def notes(self) -> list[str]:
        said = []
        for name, each in self._shares.items():
            always = np.all([held for _, held in each], axis=0)
            for label, held in each:
                odd = np.flatnonzero(held & ~always)
                if not len(odd):
                    continue
                called = [name] if len(held) == 1 else [f"{name}[{i}]" for i in odd]
                more = f" and {len(called) - MOST_NAMED - 1} more" if len(called) > MOST_NAMED + 1 else ""
                said.append(
                    f"{', '.join(called[: MOST_NAMED + 1])}{more} {'does' if len(called) == 1 else 'do'} not change in "
                    f"most steps of episode {label}, though in others: a sensor may have stopped there"
                )
        more_notes = len(said) - 2 * MOST_NAMED
        return (
            [*said[: 2 * MOST_NAMED], f"so do columns of {more_notes} more episodes"]
            if more_notes > 0
            else said
        )


def _lay_out(tree: dict[str, Node], separator: str, time_axis: str | None) -> _Table:
    found = _split_batches(find_demonstrations(tree), separator, time_axis)
    labels = [each.label for each in found.demonstrations]
    arrays = [
        {path or found.members[0]: leaf for path, leaf in leaves(each.content, separator)}
        for each in found.demonstrations
    ]
    lengths = find_lengths(arrays, time_axis)
    stacked, unusable = stack(arrays, lengths, labels, time_axis)
    stacked = {path: replace(each, kind=_plain(each.kind)) for path, each in stacked.items()}
    beside = outside(tree, found, separator)
    for path, node in beside.items():
        reason = node.reason if isinstance(node, Odd) else "lies beside the demonstrations"
        unusable.setdefault(path, reason)
    episode = next(name for name in (EPISODE, "demonstration", "_episode") if name not in stacked)
    has_time = any(
        _last(path, separator) in TIMES and not each.width and None not in each.axes
        for path, each in stacked.items()
    )
    step, step_name = None, ""
    if not has_time:
        step, step_name = _find_step(stacked, beside, separator, len(labels))
    text = any(isinstance(label, str) for label in labels)
    return _Table(
        found,
        tuple(lengths),
        stacked,
        unusable,
        pa.array([str(label) for label in labels] if text else labels),
        episode,
        TIME if TIME not in stacked else "time_counted",
        step,
        step_name,
        _last(step_name, separator) in RATES,
        tuple(path for path, node in beside.items() if numbers_in(node) > 1),
        time_axis,
    )


def _split_batches(found: Found, separator: str, time_axis: str | None) -> Found:
    """Take arrays (episodes, time, dimensions) apart, where all of a file's arrays are of this form."""
    if found.names:
        return found
    every = dict(leaves(found.demonstrations[0].content, separator))
    arrays = {path: leaf for path, leaf in every.items() if isinstance(leaf, Leaf) and leaf.size > 1}
    deep = [leaf.shape for leaf in arrays.values() if len(leaf.shape) == 3]
    if not deep:
        return found
    n_episodes, length = deep[0][0], max(deep[0])
    if time_axis is not None:
        length = deep[0][1 if time_axis == "first" else 2]
    fits = all(
        shape[0] == n_episodes
        and max(shape) == length in shape[1:]
        and not (shape[2] == length and shape[:2] in MATRICES)
        for shape in deep
    )
    others = (leaf.shape for leaf in arrays.values() if len(leaf.shape) != 3)
    if not fits or any(shape not in ((n_episodes, length), (n_episodes,)) for shape in others):
        return found
    rest = {path: node for path, node in every.items() if path not in arrays}
    demonstrations = tuple(
        Demonstration(
            i,
            {
                **{path: replace(leaf, shape=leaf.shape[1:], index=i) for path, leaf in arrays.items()},
                **rest,
            },
        )
        for i in range(n_episodes)
    )
    names = (f"the first axis of {', '.join(arrays)}",)
    return Found((), names, tuple(found.demonstrations[0].content), demonstrations)


def _find_step(
    stacked: dict[str, Stacked], beside: dict[str, Leaf | Odd], separator: str, n_demonstrations: int
) -> tuple[Stacked | None, str]:
    """Find the time step or the rate: of each demonstration, or else of the file."""
    wanted = STEPS | RATES
    for path, each in stacked.items():
        if (
            _last(path, separator) in wanted
            and each.kind.kind in "iuf"
            and not any(axis is not None for axis in each.axes)
        ):
            return each, path
    for path, node in beside.items():
        if isinstance(node, Leaf) and _last(path, separator) in wanted and _is_number(node):
            parts = (node,) * n_demonstrations
            return Stacked(parts, (None,) * n_demonstrations, 0, node.kind), path
    return None, ""


def _is_number(leaf: Leaf) -> bool:
    return leaf.size == 1 and leaf.kind.kind in "iuf"


def _last(path: str, separator: str) -> str:
    return path.rsplit(separator, 1)[-1].strip().lower()


def _plain(kind: np.dtype) -> np.dtype:
    """Return the type in which values are read: one that Arrow has."""
    if kind.kind == "f" and kind.itemsize not in (4, 8):
        return np.dtype(np.float32 if kind.itemsize < 4 else np.float64)
    return kind.newbyteorder("=")


def _arrow_type(kind: np.dtype) -> pa.DataType:
    return pa.string() if kind.kind in "SU" else pa.from_numpy_dtype(kind)
