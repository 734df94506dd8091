"""Parquet files of any number and size, on disk or in an object store, read in order, as many rows at a time."""

import os
import re
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.fs
import pyarrow.parquet as pq
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.recordings.files import Paths, recordings
from unconstrain.recordings.formats.parquet import columns_of
from unconstrain.recordings.table import Table, row

Array = NDArray[np.float64]

SUFFIXES = (".parquet", ".pq")
DECODED = 131_072
"""Rows decoded at a time: as many as cost little memory, since every start on a column costs time."""
SAMPLED_GROUPS = 16
"""Row groups, at least, that a sample is drawn from: neighbouring rows resemble each other."""


Places = dict[str, list[tuple[int, int | None]]]
"""By column, which rows of an array of numbers it goes to, and which of its components."""


class Piece(NamedTuple):
    """Consecutive rows of one file: which file, its first row there, and the columns read."""

    file: int
    first: int
    rows: Any  # pyarrow.RecordBatch

    def slice(self, start: int, length: int) -> "Piece":
        return Piece(self.file, self.first + start, self.rows.slice(start, length))


class Field(NamedTuple):
    """A column of numbers, or one of the numbers of a column of lists."""

    column: str
    component: int | None


@dataclass(frozen=True)
class Shards:
    """Parquet files one after the other, as one table.

    shown: what the user called them. paths: of the files, in `filesystem`. row_groups: the rows of each row group, a
    tuple a file. threads: whether columns are decoded side by side.
    """

    shown: str
    filesystem: Any
    paths: tuple[str, ...]
    row_groups: tuple[tuple[int, ...], ...]
    threads: bool = True

    @classmethod
    def find(cls, source: Paths) -> "Shards":
        """The Parquet files of a folder (and the folders in it), of a path or pattern, or of several of them.

        They are taken in the order of their paths, numbers in them as numbers. Paths may be URIs that
        `pyarrow.fs.FileSystem.from_uri` opens, such as `s3://bucket/folder`.
        Raises `DataError` where there are none, or one cannot be opened.
        """
        filesystem, paths, shown = _located(source)
        shards = cls(shown, filesystem, tuple(paths), ())
        with ThreadPoolExecutor(16) as pool:  # footers are small and far apart
            row_groups = tuple(pool.map(shards._rows_of_groups, paths))
        found = cls(shown, filesystem, tuple(paths), row_groups)
        if not found.n_rows:
            raise DataError(f"{shown} has no samples")
        return found

    @property
    def n_rows(self) -> int:
        return sum(map(sum, self.row_groups))

    def name(self, file: int) -> str:
        """What to call a file to the user."""
        return self.paths[file]

    def first_rows(self, count: int = 1) -> tuple[Table, Any]:
        """All columns of the first rows there are, and their Arrow schema."""
        file = next(i for i, groups in enumerate(self.row_groups) if sum(groups))
        with _NamedErrors(self.name(file)), self._open(self.paths[file]) as opened:
            rows = next(opened.iter_batches(count))
            schema = opened.schema_arrow
        return columns_of(pa.Table.from_batches([rows]), self.name(file)), schema

    def pieces(self, columns: Sequence[str], start: int = 0, stop: int | None = None) -> Iterator[Piece]:
        """Rows `start` to `stop` of these columns, in order, some at a time."""
        stop = self.n_rows if stop is None else min(stop, self.n_rows)
        first = 0  # row of the file at hand
        for file, groups in enumerate(self.row_groups):
            n_rows = sum(groups)
            if first < stop and first + n_rows > start:
                yield from self._pieces_of(file, columns, start - first, stop - first)
            first += n_rows

    def sample(self, columns: Sequence[str], n_rows: int, random_state: int | None) -> list[Piece]:
        """Random rows, in order; all rows where there are no more. Of many row groups only some are read."""
        if self.n_rows <= n_rows:
            return list(self.pieces(columns))
        rng = np.random.default_rng(random_state)
        groups = [(file, g) for file, sizes in enumerate(self.row_groups) for g in range(len(sizes))]
        chosen: list[tuple[int, int]] = []
        available = 0
        for i in rng.permutation(len(groups)):
            if available >= n_rows and len(chosen) >= SAMPLED_GROUPS:
                break
            chosen.append(groups[i])
            available += self.row_groups[groups[i][0]][groups[i][1]]
        picked = np.sort(rng.choice(available, n_rows, replace=False, shuffle=False))
        sampled: list[Piece] = []
        at = 0
        for file, g in sorted(chosen):
            sizes = self.row_groups[file]
            before = sum(sizes[:g])
            for piece in self._pieces_of(file, columns, before, before + sizes[g]):
                low, high = np.searchsorted(picked, [at, at + len(piece.rows)])
                if high > low:
                    sampled.append(Piece(file, piece.first, piece.rows.take(pa.array(picked[low:high] - at))))
                at += len(piece.rows)
        return sampled

    def numbers(self, pieces: Sequence[Piece], fields: Sequence[Field], role: str) -> NDArray[Any]:
        """These fields as finite numbers, (k, N): a row a field, as columns are stored.

        float32 where the files hold nothing else, half of what is moved about then; float64 otherwise.
        Raises `DataError` that names file, column and row of whatever is not a number.
        """
        shape = (len(fields), sum(len(piece.rows) for piece in pieces))
        single = all(_single(self._column(piece, field.column).type) for piece in pieces for field in fields)
        numbers: NDArray[Any] = np.empty(shape, np.float32 if single else np.float64)
        columns: Places = {}
        for i, field in enumerate(fields):
            columns.setdefault(field.column, []).append((i, field.component))
        usual, at = True, 0
        for piece in pieces:
            part = numbers[:, at : at + len(piece.rows)]
            at += len(piece.rows)
            usual = usual and self._fill(part, piece, columns)
        # A sum of squares is finite and small if and only if every number is, and costs next to nothing. Where it
        # overflows, as it does from 1e19 in single precision, the numbers are looked at one by one.
        with np.errstate(over="ignore"):
            usual = usual and float(np.dot(numbers.ravel(), numbers.ravel())) < 1e300
        if not usual:
            self._fill_slowly(numbers, pieces, columns, role)
        return numbers

    def labels(self, pieces: Sequence[Piece], column: str) -> NDArray[Any]:
        """The values of a column that tells episodes apart, (N,). Raises `DataError` where one is missing."""
        parts = []
        for piece in pieces:
            values = self._column(piece, column)
            if pa.types.is_dictionary(values.type):
                values = values.dictionary_decode()
            if pa.types.is_nested(values.type):
                raise DataError(
                    f"{self.name(piece.file)}: column {column!r} holds {values.type} values, which do not tell "
                    "episodes apart; choose another column"
                )
            if values.null_count or pa.types.is_floating(values.type):
                self.table(piece, [column]).labels(0)  # says which row is empty or NaN
            parts.append(values.to_numpy(zero_copy_only=False))
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def sparse(self, piece: Piece, columns: Sequence[str], width: int) -> Array:
        """`width` numbers a row, (N, width), of one column of lists or as many columns; NaN where they are missing.

        Raises `DataError` that names file, column and row of a list of another length.
        """
        numbers = np.full((len(piece.rows), width), np.nan)
        for i, column in enumerate(columns):
            values = self._column(piece, column)
            if pa.types.is_null(values.type):  # a file in which none is known
                continue
            rows = slice(None)
            if pa.types.is_nested(values.type) and hasattr(values.type, "value_type"):
                lengths = pc.fill_null(pc.list_value_length(values), 0).to_numpy()
                odd = np.flatnonzero((lengths != width) & (lengths != 0))
                if len(odd):
                    raise DataError(
                        f"{self.name(piece.file)}: column {column!r} holds a list of {lengths[odd[0]]} at "
                        f"{row(piece.first + int(odd[0]))} where {width} numbers are needed"
                    )
                rows, values = lengths > 0, values.flatten()
            kind = values.type
            if not (pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_null(kind)):
                raise DataError(
                    f"{self.name(piece.file)}: column {column!r} holds {kind} values where numbers are needed; choose "
                    "other columns"
                )
            plain = values.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
            if len(columns) == 1:
                numbers[rows] = plain.reshape(-1, width)
            else:
                numbers[rows, i] = plain
        return numbers

    def table(self, piece: Piece, columns: Sequence[str]) -> Table:
        """A piece as the readers know tables, whose errors name the row in the file."""
        arrays = [self._column(piece, column) for column in columns]
        table = pa.Table.from_arrays(arrays, names=list(columns))
        return columns_of(table, self.name(piece.file), lambda index: row(piece.first + index))

    def places(self, pieces: Sequence[Piece]) -> Callable[[int], str]:
        """Where in the files a row of these pieces is, as a table's errors say it."""
        bounds = np.cumsum([0, *(len(piece.rows) for piece in pieces)])

        def place(index: int) -> str:
            which = int(np.searchsorted(bounds, index, side="right")) - 1
            piece = pieces[which]
            return f"row {piece.first + index - bounds[which]} of {self.name(piece.file)} (counted from 0)"

        return place

    def _fill(self, numbers: NDArray[Any], piece: Piece, columns: Places) -> bool:
        """Write a piece's columns into their rows of `numbers`; False if anything about them is unusual."""
        arrays: list[Any] = [None] * len(numbers)
        for column, places in columns.items():
            values = self._column(piece, column)
            if values.null_count:
                return False
            if places[0][1] is None:
                if not (pa.types.is_floating(values.type) or pa.types.is_integer(values.type)):
                    return False
                flat = values.to_numpy(zero_copy_only=False)
                for i, _ in places:
                    arrays[i] = flat
                continue
            rows = _matrix(values)
            if rows is None or any(part is None or part >= rows.shape[1] for _, part in places):
                return False
            for i, part in places:
                arrays[i] = rows[:, part]
        np.stack(
            arrays, out=numbers
        )  # one operation, where threads would wait for each other at each of many
        return True

    def _fill_slowly(
        self, numbers: NDArray[Any], pieces: Sequence[Piece], columns: Places, role: str
    ) -> None:
        at = 0
        for piece in pieces:
            stop = at + len(piece.rows)
            for column, places in columns.items():
                table = self.table(piece, [column])
                for i, component in places:
                    key = column if component is None else f"{column}[{component}]"
                    (position,) = table.find(role, key)
                    numbers[i, at:stop] = table.numbers(position)
            at = stop

    def _column(self, piece: Piece, column: str) -> Any:
        index = piece.rows.schema.get_field_index(column)
        if index < 0:
            raise DataError(
                f"{self.name(piece.file)} has no column {column!r}, or has it twice, but other files of "
                f"{self.shown} have it; leave the file out, or choose other columns"
            )
        return piece.rows.column(index)

    def _pieces_of(self, file: int, columns: Sequence[str], start: int, stop: int) -> Iterator[Piece]:
        """Rows `start` to `stop` of one file, where they lie in it."""
        bounds = np.cumsum((0, *self.row_groups[file]))
        groups = [g for g in range(len(bounds) - 1) if bounds[g] < stop and bounds[g + 1] > start]
        if not groups:
            return
        at = int(bounds[groups[0]])
        with _NamedErrors(self.name(file)), self._open(self.paths[file]) as opened:
            batches = opened.iter_batches(
                DECODED, row_groups=groups, columns=list(columns), use_threads=self.threads
            )
            while True:
                rows = next(batches, None)
                if rows is None:
                    break
                piece, length = Piece(file, at, rows), len(rows)
                low, high = max(start - at, 0), min(stop - at, length)
                at += length
                if high > low:
                    yield piece if (low, high) == (0, length) else piece.slice(low, high - low)
        if at != bounds[groups[-1] + 1]:
            raise DataError(f"{self.name(file)} is damaged: rows are missing from it; write it again")

    def _rows_of_groups(self, path: str) -> tuple[int, ...]:
        with _NamedErrors(path), self._open(path) as opened:
            metadata = opened.metadata
            return tuple(metadata.row_group(g).num_rows for g in range(metadata.num_row_groups))

    def _open(self, path: str) -> Any:
        # What is mapped is not copied before it is decoded; object stores get whole row groups at once.
        local = isinstance(self.filesystem, pyarrow.fs.LocalFileSystem)
        where: dict[str, Any] = {"memory_map": True} if local else {"filesystem": self.filesystem}
        return pq.ParquetFile(path, pre_buffer=not local, page_checksum_verification=True, **where)


class _NamedErrors:
    """What Arrow says of a file that it cannot read becomes one `DataError` that names the file."""

    def __init__(self, shown: str):
        self.shown = shown

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind, error, traceback) -> None:
        if isinstance(error, DataError) or not isinstance(
            error, pa.ArrowException | OSError | UnicodeDecodeError
        ):
            return
        if isinstance(error, FileNotFoundError | PermissionError):
            raise DataError(f"{self.shown} cannot be read: {error.strerror or error}") from error
        raise DataError(f"{self.shown} is damaged or not a Parquet file; write it again") from error


def _matrix(values: Any) -> Array | None:
    """A column of lists as (N, k), or None where it holds anything but k floating-point numbers in each row."""
    flat = values.flatten() if hasattr(values, "flatten") else None
    if flat is None or flat.null_count or not pa.types.is_floating(flat.type):
        return None
    width = len(flat) // max(len(values), 1)
    if not pa.types.is_fixed_size_list(values.type) and np.any(np.diff(values.offsets.to_numpy()) != width):
        return None
    return flat.to_numpy().reshape(-1, width)


def _single(kind: pa.DataType) -> bool:
    return pa.types.is_float32(
        kind.value_type if pa.types.is_nested(kind) and hasattr(kind, "value_type") else kind
    )


def _located(source: Paths) -> tuple[Any, list[str], str]:
    """The file system, the paths in it, and what the user called them."""
    given = [source] if isinstance(source, str | os.PathLike) else list(source)
    remote = [each for each in given if isinstance(each, str) and "://" in each]
    if remote and len(remote) < len(given):
        raise DataError("give either paths or URIs, not both")
    names = [str(each) for each in given] if remote else recordings(given)
    shown = names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
    filesystem: Any = pyarrow.fs.LocalFileSystem()
    paths: list[str] = []
    for name in names:
        path = name
        try:
            if remote:
                filesystem, path = pyarrow.fs.FileSystem.from_uri(name)
            info = filesystem.get_file_info(path)
            if info.type == pyarrow.fs.FileType.NotFound:
                raise DataError(f"there is no file or folder {name}; check the path")
            if info.type == pyarrow.fs.FileType.Directory:
                found = _in_folder(filesystem, path)
                if not found:
                    raise DataError(f"there are no Parquet files in {name}")
                paths += found
            else:
                paths.append(path)
        except (OSError, pa.ArrowException) as error:
            raise DataError(f"{name} cannot be opened ({str(error).splitlines()[0]})") from error
    return filesystem, paths, shown


def _in_folder(filesystem: Any, folder: str) -> list[str]:
    selector = pyarrow.fs.FileSelector(folder, recursive=True)
    found = [
        info.path
        for info in filesystem.get_file_info(selector)
        if info.type == pyarrow.fs.FileType.File and info.path.lower().endswith(SUFFIXES)
    ]
    root = len(PurePosixPath(folder).parts)
    # Spark, Dask and the like keep their own records in names that begin with _ or a dot.
    plain = [path for path in found if not any(p[0] in "_." for p in PurePosixPath(path).parts[root:])]
    return sorted(plain, key=natural)


def natural(path: str) -> list[tuple[int, str]]:
    """A sorting key by which `part-10` comes after `part-9`."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", path)]
