"""Parquet files: flat columns, and lists of one length, as LeRobot's `observation.state`."""

import json
from collections.abc import Iterator, Sequence
from copy import copy
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from unconstrain import demonstrations_file
from unconstrain.errors import DataError
from unconstrain.recordings.files import File
from unconstrain.recordings.formats.base import ColumnKey, Declared, OneFile, damage_named
from unconstrain.recordings.formats.saved import declare
from unconstrain.recordings.table import Column, Header, is_list, row

DECODED = 131_072
"""Rows decoded at a time: as many as cost little memory, since every start on a column costs time."""

UNIT = b"unit"
"""Where, in the metadata of a field, a format says what its unit is."""

BUFFERED = 1 << 20
"""Bytes read at a time of each column of a local file."""


class Parquet(OneFile):
    """A Parquet file, of which only the columns and the row groups asked for are read.

    Parameters
    ----------
    file : File
    """

    suffixes: ClassVar[tuple[str, ...]] = (".parquet", ".pq")
    at_once: ClassVar[bool] = False
    threads = True
    """Whether columns are decoded side by side."""

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the content is of this format, as its first bytes tell."""
        return file.magic[:4] in (b"PAR1", b"PARE")

    def columns(self) -> Header:
        """Return the columns, lists of k numbers as k of them, as the first row has them."""
        return self._header

    def declared(self) -> Declared | None:
        """Return the roles of the columns where this package wrote the file."""
        text = self._metadata.get(demonstrations_file.KEY.encode())
        if text is None:
            return None
        with damage_named(self.file.shown, "saved demonstrations"):
            about = json.loads(text)
        return declare(about, self.file.shown)

    @property
    def row_groups(self) -> tuple[int, ...]:
        """The numbers of rows in the row groups."""
        return self._footer[0]

    def read(
        self, columns: Sequence[ColumnKey], start: int = 0, stop: int | None = None
    ) -> Iterator[tuple[int, pa.RecordBatch]]:
        """Read rows of these columns, in order, some at a time, each with its first row."""
        bounds = np.cumsum((0, *self.row_groups))
        stop = int(bounds[-1]) if stop is None else stop
        groups = [g for g in range(len(bounds) - 1) if bounds[g] < stop and bounds[g + 1] > start]
        if not groups:
            return
        at = int(bounds[groups[0]])
        names = list(dict.fromkeys(name for name, _ in columns))
        order: list[int] | None = None
        with damage_named(self.file.shown, "a Parquet file"), self._open() as opened:
            batches = opened.iter_batches(DECODED, row_groups=groups, columns=names, use_threads=self.threads)
            while at < stop and (rows := next(batches, None)) is not None:
                rows = _flat(rows)
                if order is None:
                    order = self._order(rows.schema, columns)
                length, first = len(rows), at
                at += length
                low, high = max(start - first, 0), min(stop - first, length)
                if high > low:
                    rows = rows if order == list(range(rows.num_columns)) else rows.select(order)
                    yield first + low, rows if (low, high) == (0, length) else rows.slice(low, high - low)
        if at < min(stop, int(bounds[groups[-1] + 1])):
            raise DataError(f"{self.file.shown} is damaged: rows are missing from it; write it again")

    def in_one_thread(self) -> "Parquet":
        """Return the same file, decoded by one thread."""
        alike = copy(self)
        alike.threads = False
        return alike

    def _order(self, schema: pa.Schema, columns: Sequence[ColumnKey]) -> list[int]:
        order = []
        for name, nth in columns:
            where = schema.get_all_field_indices(name)
            if nth >= len(where):
                raise DataError(
                    f"{self.file.shown} has no column {name!r}, but other files of the recording have it; leave the "
                    "file out, or choose other columns"
                )
            order.append(where[nth])
        return order

    @cached_property
    def _footer(self) -> tuple[tuple[int, ...], dict[bytes, bytes]]:
        with damage_named(self.file.shown, "a Parquet file"), self._open() as opened:
            metadata = opened.metadata
            groups = tuple(metadata.row_group(g).num_rows for g in range(metadata.num_row_groups))
            about = dict(opened.schema_arrow.metadata or {})
        if min(groups, default=0) < 0:
            raise DataError(f"{self.file.shown} is damaged or not a Parquet file; write it again")
        return groups, {key: text for key, text in about.items() if key == demonstrations_file.KEY.encode()}

    @property
    def _metadata(self) -> dict[bytes, bytes]:
        return self._footer[1]

    @cached_property
    def _header(self) -> Header:
        if not sum(self.row_groups):
            raise DataError(f"{self.file.shown} has no samples")
        with damage_named(self.file.shown, "a Parquet file"), self._open() as opened:
            first = _flat(next(opened.iter_batches(1)))
            return describe_columns(first, self.file.shown, sum(self.row_groups))

    def _open(self) -> Any:
        # Object stores get whole row groups at once. Nothing is mapped: a file that is cut while it is mapped ends
        # the process.
        if not self.file.local:
            return pq.ParquetFile(
                self.file.path,
                filesystem=self.file.filesystem,
                pre_buffer=True,
                page_checksum_verification=True,
            )
        return pq.ParquetFile(self.file.path, buffer_size=BUFFERED, page_checksum_verification=True)


def flatten(table: Any) -> Any:
    """Return a table without records: their components are called `name.component`."""
    while any(pa.types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    return table


def _flat(rows: Any) -> Any:
    """Return a batch without records."""
    if not any(pa.types.is_struct(field.type) for field in rows.schema):
        return rows
    return flatten(pa.Table.from_batches([rows])).combine_chunks().to_batches()[0]


def describe_columns(first: Any, shown: str, length: int) -> Header:
    """Describe the columns of Arrow rows, lists of k numbers as k of them, as the first row has them.

    Parameters
    ----------
    first : pyarrow.RecordBatch or pyarrow.Table
        At least the first row.
    shown : str
        Where it is from, as the user calls it.
    length : int
        The number of rows there are.

    Returns
    -------
    Header
    """
    columns: list[Column] = []
    lists: dict[str, tuple[pa.DataType, int | None]] = {}
    unusable: dict[str, str] = {}
    seen: dict[str, int] = {}
    for field, values in zip(first.schema, first.columns, strict=True):
        name, unit = field.name, (field.metadata or {}).get(UNIT, b"").decode(errors="replace")
        nth = seen[name] = seen.get(name, -1) + 1
        kind = values.type
        if not pa.types.is_nested(kind):
            columns.append(Column(name, kind, length, nth, unit=unit))
            if pa.types.is_null(kind):
                lists[name] = kind, length
            continue
        lists[name] = kind, length
        if not is_list(kind) or pa.types.is_nested(kind.value_type):
            unusable[name] = f"holds {kind} values"
        elif not values[0].is_valid or not len(values[0].as_py()):
            unusable[name] = f"holds lists that are missing or differ in length, first at {row(0)}"
        else:
            width = len(values[0].as_py())
            columns += [
                Column(f"{name}[{i}]", kind.value_type, length, nth, name, i, width) for i in range(width)
            ]
    return Header(shown, columns, lists, unusable)
