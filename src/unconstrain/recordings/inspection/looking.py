"""All columns of a file as numbers or text, whatever is in them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.recordings.formats.base import GUESS, ColumnKey, Format
from unconstrain.recordings.table import Cells, Column, Header, is_text

Array = NDArray[np.float64]

MOST_ROWS = 200_000
"""Rows looked at of files that are read in pieces."""

MOST_NAMED = 6
"""Names in a sentence."""

NOTHING: NDArray[np.int64] = np.zeros(0, np.int64)

MOST_CELLS = 20_000_000
"""Numbers looked at: fewer rows where there are many columns."""


@dataclass(frozen=True)
class Looked:
    """The columns of a recording that are equally long.

    Parameters
    ----------
    header : Header
        Of the first file.
    positions : tuple of int
        Where in the header the columns are.
    values : list of ndarray of shape (N,), or None
        Numbers of each, NaN where one is missing; None for text.
    texts : dict of int to ndarray of shape (N,)
        The values of columns of text, by place among those here.
    units : list of str or None
        Of columns that are stamps by their type.
    files : ndarray of shape (N,)
        The file of each row, as a number from 0.
    recordings : ndarray of shape (N,)
        The recording of each row: files of a folder are one.
    n_rows : int
        How many rows there are, of which these may be the first.
    notes : tuple of str
        What was left out.
    guesses : tuple of str
        What the format guessed of all columns, those that nobody chooses among them.
    """

    header: Header
    positions: tuple[int, ...]
    values: list[Array | None]
    texts: dict[int, NDArray[np.str_]]
    units: list[str | None]
    files: NDArray[np.int64]
    recordings: NDArray[np.int64]
    n_rows: int
    notes: tuple[str, ...]
    guesses: tuple[str, ...] = ()

    @property
    def columns(self) -> list[Column]:
        """The columns, as the header has them."""
        return [self.header.columns[i] for i in self.positions]

    @property
    def names(self) -> list[str]:
        """Their names, "" where there are none."""
        return [column.name for column in self.columns]


def look_at(files: Sequence[Format], recordings: Sequence[int]) -> Looked:
    """Read the columns of files that mean the same, whatever is in them.

    Parameters
    ----------
    files : sequence of Format
        With the columns of the first.
    recordings : sequence of int
        The number of the recording that each file is part of.

    Returns
    -------
    Looked

    Raises
    ------
    DataError
        A file is damaged, or has other columns than the first.
    """
    header = files[0].columns()
    positions, left_out = _equally_long(header)
    notes = _left_out({**header.unusable, **dict.fromkeys(left_out, "is not as long as the others")})
    columns = [header.columns[i] for i in positions]
    if not columns:
        return Looked(header, (), [], {}, [], NOTHING, NOTHING, 0, tuple(notes))
    keys = list(dict.fromkeys((column.part_of or column.name, column.nth) for column in columns))
    most = min(MOST_ROWS, max(MOST_CELLS // len(columns), 1000))
    n_rows = sum(sum(each.row_groups) for each in files)
    parts: list[tuple[int, pa.RecordBatch]] = []
    guesses: list[str] = []
    left = most
    for number, file in enumerate(files):
        stop = None if file.at_once else min(left, sum(file.row_groups))
        for _, rows in file.read(keys, 0, stop) if stop is None or stop > 0 else ():
            parts.append((number, rows))
            left -= len(rows)
            guess = (rows.schema.metadata or {}).get(GUESS)
            if guess is not None:
                guesses += guess.decode().splitlines()
    looked = sum(len(rows) for _, rows in parts)
    if looked < n_rows:
        notes.append(f"only the first {looked} of {n_rows} rows were looked at")
    values: list[Array | None] = []
    texts: dict[int, NDArray[np.str_]] = {}
    units: list[str | None] = []
    at = {key: i for i, key in enumerate(keys)}
    for place, column in enumerate(columns):
        numbers, text, unit, strays = _column(column, at, [rows for _, rows in parts], files[0])
        notes += strays
        values.append(numbers)
        units.append(unit)
        if text is not None:
            texts[place] = text
    repeats = [len(rows) for _, rows in parts]
    which = np.repeat([number for number, _ in parts], repeats).astype(np.int64)
    return Looked(
        header,
        tuple(positions),
        values,
        texts,
        units,
        which,
        np.asarray(recordings, dtype=np.int64)[which],
        n_rows,
        tuple(notes),
        tuple(dict.fromkeys(guesses)),
    )


def _left_out(unusable: Mapping[str, str]) -> list[str]:
    """Say what is no column, a sentence for each reason."""
    reasons: dict[str, list[str]] = {}
    for name, why in unusable.items():
        reasons.setdefault(why, []).append(name)
    said = []
    for why, names in reasons.items():
        more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
        which = f"which {why}" if len(names) == 1 else f"each of which {why}"
        said.append(f"left out {', '.join(names[:MOST_NAMED])}{more}, {which}")
    return said


def _equally_long(header: Header) -> tuple[list[int], list[str]]:
    """Find the columns of the length that most of them have, and name the others."""
    lengths = [column.length for column in header.columns]
    usual = max(dict.fromkeys(lengths), key=lambda n: (lengths.count(n), n or 0), default=None)
    kept = [i for i, length in enumerate(lengths) if length == usual]
    others = [c.part_of or c.name for c in header.columns if c.length != usual]
    return kept, list(dict.fromkeys(others))


def _column(
    column: Column, at: dict[ColumnKey, int], batches: Sequence[pa.RecordBatch], file: Format
) -> tuple[Array | None, NDArray[np.str_] | None, str | None, list[str]]:
    place = at[column.part_of or column.name, column.nth]
    numbers: list[Array] = []
    unit = None
    strays: list[str] = []
    for rows in batches:
        cells = Cells(rows.column(place), file.file.shown, column.name, file.place)
        try:
            if column.component is not None:
                cells = cells.component(column.component, column.width, "state", column.part_of)
            part, unit = _numbers(cells)
            strays += _strays(cells, part)
        except DataError:
            text = [str(value) for each in batches for value in each.column(place).to_pylist()]
            return None, np.array(text, dtype=np.str_), None, []
        numbers.append(part)
    return np.concatenate(numbers) if numbers else np.zeros(0), None, unit, strays


def _strays(cells: Cells, numbers: Array) -> list[str]:
    """Say where text stands in a column of numbers."""
    if not is_text(cells.values.type) or np.isfinite(numbers).all():
        return []
    places = np.flatnonzero(cells.stray_text().to_numpy(zero_copy_only=False))
    if not len(places):
        return []
    first = int(places[0])
    more = f" and at {len(places) - 1} more" if len(places) > 1 else ""
    return [
        f"{cells.called} holds {cells.values[first].as_py()!r} at {cells.place(first)}{more}, where numbers are needed"
        ": correct it, or leave such rows out with --drop missing"
    ]


def _numbers(cells: Cells) -> tuple[Array, str | None]:
    """Return values as numbers, and the unit of those that are stamps."""
    values = cells.values
    kind = values.type
    if is_text(kind):
        try:
            return cells.numbers_or_nan(), None
        except DataError:
            flags = _cast(values, pa.bool_())
            if flags is not None:
                return _floats(flags), None
            stamps = _cast(values, pa.timestamp("ns"))
            stamps = _cast(values, pa.timestamp("ns", "UTC")) if stamps is None else stamps
            if stamps is None:
                return cells.numbers_or_nan(beside_text=True), None
            return _floats(stamps), "ns"
    if pa.types.is_boolean(kind) or pa.types.is_decimal(kind):
        return _floats(values), None
    if pa.types.is_timestamp(kind) or pa.types.is_duration(kind):
        return _floats(values), kind.unit
    return cells.numbers_or_nan(), None


def _floats(values: pa.Array) -> Array:
    whole = not (pa.types.is_boolean(values.type) or pa.types.is_decimal(values.type))
    values = values.cast(pa.int64()) if whole else values
    return values.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)


def _cast(values: pa.Array, kind: pa.DataType) -> pa.Array | None:
    try:
        return values.cast(kind)
    except pa.ArrowInvalid:
        return None
