"""Pieces of files, and their columns as arrays."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from unconstrain.arrays import NOT_IDEMPOTENT, not_idempotent
from unconstrain.errors import DataError
from unconstrain.recordings.episodewise import BLOCK
from unconstrain.recordings.formats.base import ColumnKey, Format
from unconstrain.recordings.table import Cells, Field, describe_kind, is_text

Array = NDArray[np.float64]

Places = dict[ColumnKey, list[tuple[int, Field]]]
"""By column, which rows of an array of numbers it goes to, and as which field."""


class Piece(NamedTuple):
    """Consecutive rows of one file.

    Parameters
    ----------
    format : Format
        The file.
    file : int
        Which file of the recording it is.
    first : int
        The first row's number in the file.
    rows : pyarrow.RecordBatch
    at : mapping of (str, int) to int
        Where in `rows` each column is.
    kept : ndarray of shape (N,), optional
        Which rows these are, counted from `first`, where some were left out.
    whole : int, optional
        How many rows there were before.
    """

    format: Format
    file: int
    first: int
    rows: Any
    at: Mapping[ColumnKey, int]
    kept: NDArray[np.int64] | None = None
    whole: int | None = None

    @property
    def length(self) -> int:
        """The number of rows, with those that were left out."""
        return len(self.rows) if self.whole is None else self.whole

    def slice(self, start: int, length: int) -> "Piece":
        """Return some of the rows."""
        return self._replace(first=self.first + start, rows=self.rows.slice(start, length))

    def place(self, index: int) -> str:
        """Say where in the file a row is."""
        return self.format.place(self.first + (index if self.kept is None else int(self.kept[index])))

    def take(self, chosen: NDArray[np.int64]) -> "Piece":
        """Return the rows of these indices (M,), which still know where in the file they are."""
        kept = chosen if self.kept is None else self.kept[chosen]
        return self._replace(rows=self.rows.take(pa.array(chosen)), kept=kept, whole=self.length)

    def without(self, rows: NDArray[np.bool_]) -> "Piece":
        """Return the piece without the rows of a mask (N,)."""
        return self.take(np.flatnonzero(~rows))

    def missing(self, field: Field, role: str) -> NDArray[np.bool_]:
        """Tell in which rows (N,) a field is empty or no finite number; of times, only where it is empty."""
        values = self.column(field.key)
        if field.component is not None:
            return self._missing_component(values, field.width, field.component)
        if pa.types.is_temporal(values.type):
            return values.is_null().to_numpy(zero_copy_only=False)
        cells = self.cells(field, role)
        if role == "time" and is_text(values.type):
            return pc.equal(pc.fill_null(pc.utf8_trim_whitespace(values), ""), "").to_numpy(
                zero_copy_only=False
            )
        return ~np.isfinite(cells.numbers_or_nan(beside_text=True))

    def _missing_component(self, values: Any, width: int, component: int) -> NDArray[np.bool_]:
        lengths = pc.fill_null(pc.list_value_length(values), 0).to_numpy(zero_copy_only=False)
        missing = lengths != width
        flat = values.filter(pa.array(~missing)).flatten().to_numpy(zero_copy_only=False)
        missing[~missing] = ~np.isfinite(flat.astype(np.float64).reshape(-1, width)[:, component])
        return missing

    def column(self, key: ColumnKey) -> Any:
        """Return a column as an Arrow array."""
        return self.rows.column(self.at[key])

    def cells(self, field: Field, role: str) -> Cells:
        """Return a field's values. Raises `DataError` for lists of another length than the header says."""
        cells = Cells(
            self.column(field.key),
            self.format.file.shown,
            field.called,
            self.place,
        )
        if field.component is None:
            return cells
        return cells.component(field.component, field.width, role, field.column)

    def alike(self, field: Field, role: str) -> Cells:
        """Return a field's values, which must be of the same kind in all files of a recording."""
        cells = self.cells(field, role)
        kind = describe_kind(cells.values.type)
        if kind != field.kind:
            raise DataError(
                f"{cells.path} and the files beside it hold {kind} and {field.kind} values in {cells.called}: write "
                "them alike, or load them one by one"
            )
        return cells


def read_numbers(
    pieces: Sequence[Piece], fields: Sequence[Field], role: str, *, by_row: bool = False
) -> NDArray[Any]:
    """Read fields as finite numbers.

    Parameters
    ----------
    pieces : sequence of Piece
    fields : sequence of Field
    role : str
        What they are for, as the user calls it.
    by_row : bool
        Whether the numbers of a row lie beside each other in memory, rather than those of a field.

    Returns
    -------
    ndarray of shape (k, N)
        A row a field, as columns are stored: float32 where the files hold nothing else, half of what is moved about
        then; float64 otherwise.

    Raises
    ------
    DataError
        Something is not a number; the sentence names file, column and row.
    """
    shape = (len(fields), sum(len(piece.rows) for piece in pieces))
    single = all(_is_single(piece.column(field.key).type) for piece in pieces for field in fields)
    kind = np.float32 if single else np.float64
    numbers: NDArray[Any] = np.empty(shape[::-1], kind).T if by_row else np.empty(shape, kind)
    columns: Places = {}
    for i, field in enumerate(fields):
        columns.setdefault(field.key, []).append((i, field))
    usual, at = True, 0
    for piece in pieces:
        part = numbers[:, at : at + len(piece.rows)]
        at += len(piece.rows)
        usual = usual and _fill(part, piece, columns)
    # A sum of squares is finite and small if and only if every number is, and costs next to nothing. Where it
    # overflows, as it does from 1e19 in single precision, the numbers are looked at one by one.
    with np.errstate(over="ignore"):
        usual = usual and float(np.dot(numbers.ravel("K"), numbers.ravel("K"))) < 1e300
    if not usual:
        at = 0
        for piece in pieces:
            stop = at + len(piece.rows)
            for i, field in enumerate(fields):
                numbers[i, at:stop] = piece.cells(field, role).numbers()
            at = stop
    return numbers


def read_flags(pieces: Sequence[Piece], field: Field) -> Array:
    """Read flags (N,), 1 or 0. Raises `DataError` that names file, column and row of anything else."""
    return np.concatenate([piece.cells(field, "free").flags() for piece in pieces])


def read_projections(
    pieces: Sequence[Piece], columns: Sequence[ColumnKey], d: int, *, check: bool = True
) -> Array:
    """Read projections (N, d, d), NaN where they are missing.

    Parameters
    ----------
    pieces : sequence of Piece
    columns : sequence of (str, int)
        One column of lists of d² numbers, row by row, or d² columns.
    d : int
    check : bool
        Whether each has to be a projection.

    Returns
    -------
    ndarray of shape (N, d, d)

    Raises
    ------
    DataError
        One is known in part, or is no projection; the sentence names file, column and row.
    """
    parts = []
    for piece in pieces:
        N = _read_sparse(piece, columns, d**2)
        bad = ~np.isfinite(N).all(axis=1) & ~np.isnan(N).all(axis=1)
        shown = piece.format.file.shown
        if bad.any():
            raise DataError(
                f"{shown}: the projection at {piece.place(int(np.argmax(bad)))} is neither finite numbers "
                "throughout nor NaN throughout: correct it, or make all of it NaN"
            )
        N = N.reshape(-1, d, d)
        if check and len(odd := not_idempotent(N)):
            raise DataError(f"{shown}: the projection at {piece.place(int(odd[0]))} {NOT_IDEMPOTENT}")
        parts.append(N)
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _fill(numbers: NDArray[Any], piece: Piece, columns: Places) -> bool:
    """Write a piece's columns into their rows of `numbers`; False if anything about them is unusual."""
    arrays: list[Any] = [None] * len(numbers)
    for key, fields in columns.items():
        values = piece.column(key)
        if values.null_count:
            return False
        if fields[0][1].component is None:
            if not (pa.types.is_floating(values.type) or pa.types.is_integer(values.type)):
                return False
            flat = values.to_numpy(zero_copy_only=False)
            for i, _ in fields:
                arrays[i] = flat
            continue
        rows = _matrix(values, fields[0][1].width)
        if rows is None:
            return False
        own = [(i, field.component) for i, field in fields]
        if own == [(i, i) for i in range(len(numbers))] and rows.shape[1] == len(numbers):
            numbers[...] = rows.T
            return True
        for i, field in fields:
            arrays[i] = rows[:, field.component]
    if numbers.flags.c_contiguous:
        # One operation, where threads would wait for each other at each of many.
        np.stack(arrays, out=numbers)
        return True
    for at in range(0, numbers.shape[1], BLOCK):
        np.stack([array[at : at + BLOCK] for array in arrays], out=numbers[:, at : at + BLOCK])
    return True


def _matrix(values: Any, width: int) -> NDArray[Any] | None:
    """Return a column of lists as (N, width), or None where it holds anything but that many floats in each row."""
    flat = values.flatten() if hasattr(values, "flatten") else None
    if (
        flat is None
        or flat.null_count
        or not pa.types.is_floating(flat.type)
        or len(flat) != width * len(values)
    ):
        return None
    if not pa.types.is_fixed_size_list(values.type) and np.any(np.diff(values.offsets.to_numpy()) != width):
        return None
    return flat.to_numpy().reshape(-1, width)


def _read_sparse(piece: Piece, columns: Sequence[ColumnKey], width: int) -> Array:
    """Read `width` numbers a row, (N, width), NaN where they are missing."""
    numbers = np.full((len(piece.rows), width), np.nan)
    shown = piece.format.file.shown
    for i, key in enumerate(columns):
        values, name = piece.column(key), key[0]
        if pa.types.is_null(values.type):  # a file in which none is known
            continue
        rows: Any = slice(None)
        if pa.types.is_nested(values.type) and hasattr(values.type, "value_type"):
            lengths = pc.fill_null(pc.list_value_length(values), 0).to_numpy()
            odd = np.flatnonzero((lengths != width) & (lengths != 0))
            if len(odd):
                raise DataError(
                    f"{shown}: column {name!r} holds a list of {lengths[odd[0]]} at "
                    f"{piece.place(int(odd[0]))} where {width} numbers are needed"
                )
            rows, values = lengths > 0, values.flatten()
        cells = Cells(values, shown, f"column {name!r}", piece.place)
        plain = cells.numbers_or_nan()
        if len(columns) == 1:
            numbers[rows] = plain.reshape(-1, width)
        else:
            numbers[rows, i] = plain
    return numbers


def _is_single(kind: pa.DataType) -> bool:
    return pa.types.is_float32(
        kind.value_type if pa.types.is_nested(kind) and hasattr(kind, "value_type") else kind
    )
