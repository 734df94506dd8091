"""What formats share that are read as a whole into one Arrow table."""

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any

import pyarrow as pa

from unconstrain.errors import DataError
from unconstrain.recordings.formats.base import ColumnKey, OneFile, note_guesses
from unconstrain.recordings.formats.parquet import UNIT, describe_columns, flatten
from unconstrain.recordings.formats.seconds import with_time
from unconstrain.recordings.table import Header
from unconstrain.recordings.units import said_of_units, unit_in


class Tabular(OneFile):
    """A file that is read as a whole into one Arrow table; a subclass says how, in `load_table`.

    Parameters
    ----------
    file : File
    """

    def load_table(self) -> tuple[Any, tuple[str, ...]]:
        """Return all columns as a `pyarrow.Table`, and notes on them. Raises `DataError` for a damaged file."""
        raise NotImplementedError

    def columns(self) -> Header:
        """Return the columns, lists of k numbers as k of them; components of records are called `name.component`."""
        table, _ = self._loaded
        if not len(table):
            raise DataError(f"{self.file.shown} has no samples")
        return describe_columns(table.slice(0, 1).combine_chunks(), self.file.shown, len(table))

    @property
    def row_groups(self) -> tuple[int, ...]:
        """The number of rows."""
        return (len(self._loaded[0]),)

    def read(
        self, columns: Sequence[ColumnKey], start: int = 0, stop: int | None = None
    ) -> Iterator[tuple[int, pa.RecordBatch]]:
        """Read rows of these columns as one piece, with its first row."""
        table, notes = self._loaded
        arrays = []
        units: dict[str, str] = {}
        for name, nth in columns:
            where = [i for i, other in enumerate(table.column_names) if other == name]
            if nth >= len(where):
                raise DataError(
                    f"{self.file.shown} has no column {name!r}; leave it out, or choose other columns"
                )
            column = table.column(where[nth]).slice(start, None if stop is None else stop - start)
            arrays.append(_as_one(column))
            units[name] = (table.schema.field(where[nth]).metadata or {}).get(UNIT, b"").decode()
        named = [name for name, _ in columns]
        notes = (*notes, *said_of_units({name: unit or unit_in(name) for name, unit in units.items()}))
        yield start, pa.RecordBatch.from_arrays(arrays, names=named, metadata=note_guesses(notes))

    @cached_property
    def _loaded(self) -> tuple[Any, tuple[str, ...]]:
        table, notes = self.load_table()
        table, joined = with_time(flatten(table))
        notes = (*notes, *joined)
        # Polars hands out text as views, which other columns of text do not know.
        views = {i: field for i, field in enumerate(table.schema) if pa.types.is_string_view(field.type)}
        for i, field in views.items():
            table = table.set_column(i, field.name, table.column(i).cast(pa.string()))
        return table, notes


def _as_one(column: Any) -> Any:
    chunk = column.combine_chunks()
    return chunk.combine_chunks() if isinstance(chunk, pa.ChunkedArray) else chunk
