"""What files that hold a tree of arrays have in common: their demonstrations are read as one table."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.memory import check_memory
from unconstrain.recordings.columns import Columns, Key
from unconstrain.recordings.files import File
from unconstrain.recordings.formats.aligning import TIMES, bring, name_of
from unconstrain.recordings.formats.arrays import to_arrow
from unconstrain.recordings.formats.base import ColumnKey, Declared, damage_named, note_guesses
from unconstrain.recordings.formats.layout import MOST_NAMED, Layout, lay_out
from unconstrain.recordings.formats.trees import Leaf, Node, choose_part
from unconstrain.recordings.table import Column, Header, row

HELD = 0.5
"""Share of steps without a change from which a sensor is taken to have stopped, where elsewhere it changes."""

MOST_PARTS = 20
"""Parts of a file that a sentence lists."""

Fetch = Callable[[Leaf], NDArray[Any]]


class Nested:
    """A file that holds a tree of arrays, of which the demonstrations are stacked along time.

    A column is called by the path of its array within a demonstration: `pos[0]`, `pos[1]`. The column `episode` tells
    demonstrations apart, or the episodes of a single one, where ends or flags say where these begin. Numbers and short
    vectors of a demonstration hold for all its samples; a number that is the time step or the rate gives the column
    `time`, where there is no time. Arrays of another rate are brought to the time.

    Parameters
    ----------
    file : File
    """

    suffixes: ClassVar[tuple[str, ...]] = ()
    at_once: ClassVar[bool] = False
    separator: ClassVar[str] = "."
    episodes_last: ClassVar[bool] = False
    """Whether arrays of three axes count episodes along the last."""

    kind: ClassVar[str] = "a file of arrays"

    def __init__(self, file: File) -> None:
        self.file = file
        self.time_axis: str | None = None
        self.part: str | None = None
        self.time: Key | None = None

    def for_columns(self, wanted: Columns) -> "Nested":
        """Return the same file, of which these columns will be read: where a time is given, none is looked for."""
        other = self._unread()
        other.time = wanted.time
        return other

    def with_time_axis(self, axis: str) -> "Nested":
        """Return the same file, in whose demonstrations the first or the last axis is time, as a user says."""
        other = self._unread()
        other.time_axis = axis
        return other

    def parts(self) -> tuple[str, ...]:
        """Return the sets of demonstrations that there are, the one that is read first."""
        found = self._table.found
        own = (*found.path, *(found.members if len(found.members) == 1 else ()))
        return tuple(self.separator.join(path) for path in dict.fromkeys((own, *found.others)) if path)

    def for_part(self, name: str) -> "Nested":
        """Return the same file, of which nothing but this part is read. That it is not there, `columns` says."""
        other = self._unread()
        other.part = name
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
        if table.tells_episodes:
            kind = pa.int64() if table.codes is not None else table.labels.type
            columns.append(Column(table.episode, kind, rows))
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
        begin, about = 0, note_guesses(guesses)
        with damage_named(self.file.shown, self.kind), self.opened() as fetch:
            for which, length in enumerate(table.lengths):
                low, high = max(start - begin, 0), min(stop - begin, length)
                if low < high:
                    whole = high - low == length
                    values = self._read_one(fetch, which, names, held if whole else None)
                    if begin + high == stop:
                        about = note_guesses([*guesses, *held.notes()])
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
        return repr((self.file.identity(), self.part) if self.part else self.file.identity())

    def __getstate__(self) -> dict[str, Any]:
        """Return the file alone: what was read of it may be large."""
        return {"file": replace(self.file), "time_axis": self.time_axis, "part": self.part, "time": self.time}

    def tree(self) -> dict[str, Node]:
        """Read what there is in the file. Each format has its own."""
        raise NotImplementedError

    def opened(self) -> AbstractContextManager[Fetch]:
        """Open the file, and return what reads one of its arrays. Each format has its own."""
        raise NotImplementedError

    def choose(self, tree: dict[str, Node], part: str) -> dict[str, Node]:
        """Return the part of a tree that the user names. Raises `DataError` where there is none."""
        shown = self.file.shown
        chosen = choose_part(tree, part, self.separator)
        if isinstance(chosen, dict):
            return chosen
        if not chosen:
            raise DataError(f"{shown} has no parts to choose from: leave out part=")
        more = f" and {len(chosen) - MOST_PARTS} more" if len(chosen) > MOST_PARTS else ""
        raise DataError(
            f"{shown} has no part that {part!r} alone stands for; there are {', '.join(chosen[:MOST_PARTS])}{more}"
        )

    def _unread(self) -> "Nested":
        """Return the same file, of which nothing is known yet."""
        other = copy(self)
        for name in ("_table", "_declared"):
            vars(other).pop(name, None)
        return other

    @cached_property
    def _table(self) -> Layout:
        shown = self.file.shown
        with damage_named(shown, self.kind):
            tree = self.tree()
        if self.part is not None:
            tree = self.choose(tree, self.part)
        with damage_named(shown, self.kind):
            table = lay_out(tree, self.separator, self.time_axis, self.episodes_last)
        if not table.stacked or not sum(table.lengths):
            reasons = [f"{path!r} {reason}" for path, reason in table.unusable.items()]
            why = f" ({'; '.join(reasons[:MOST_NAMED])})" if reasons else ""
            raise DataError(f"{shown} holds no arrays that could be columns{why}")
        if table.step is None and not table.borders:
            return table
        with damage_named(shown, self.kind), self.opened() as fetch:
            if table.step is not None:
                table = _with_seconds(table, fetch)
            for borders in table.borders:
                codes = borders.episodes(fetch, table.lengths[0])
                if codes is not None:
                    return table.with_episodes(borders, codes)
        return table

    @cached_property
    def _declared(self) -> Declared | None:
        table = self._table
        time = (
            table.time
            if table.step is not None
            else None
            if self.time is not None
            else next(
                (
                    path
                    for path in table.stacked
                    if name_of(path, self.separator) in TIMES and self._increases(path)
                ),
                None,
            )
        )
        episode = table.episode if table.tells_episodes else None
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
            if name not in parts and table.codes is not None:
                values.append(pa.array(table.codes))
                continue
            if name not in parts:
                values.append(pa.repeat(table.labels[which], length))
                continue
            each = parts[name]
            array = np.asarray(fetch(each.parts[which]))
            if array.shape != each.parts[which].shape:
                raise ValueError("an array has another shape than it promises")
            if each.clocks:
                own, at = (
                    np.asarray(fetch(leaf), np.float64).reshape(-1)
                    for leaf in (each.clocks[which], table.stacked[str(table.clock)].parts[which])
                )
                array = bring(each.arrange(which, array, len(own)), own, at[:length])
            else:
                array = each.arrange(which, array, length)
            if held is not None and not each.is_held:
                held.add(name, array, label)
            values.append(to_arrow(array.astype(each.kind, copy=False)))
        return values


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


def _with_seconds(table: Layout, fetch: Fetch) -> Layout:
    """Read the time step of each demonstration; without one that can be, there is none."""
    assert table.step is not None
    steps = np.array([float(np.asarray(fetch(part)).reshape(-1)[0]) for part in table.step.parts], np.float64)
    with np.errstate(divide="ignore"):
        seconds = 1.0 / steps if table.is_rate else steps
    if not np.all((seconds > 0) & np.isfinite(seconds)):
        return table._replace(step=None)
    return table._replace(seconds=tuple(seconds.tolist()))


def _arrow_type(kind: np.dtype) -> pa.DataType:
    return pa.string() if kind.kind in "SU" else pa.from_numpy_dtype(kind)
