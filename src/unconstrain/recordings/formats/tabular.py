"""What formats share that are read as a whole into one Arrow table."""

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any, ClassVar

import pyarrow as pa

from unconstrain.errors import DataError
from unconstrain.recordings.files import File
from unconstrain.recordings.formats.base import ColumnKey, Declared, note_guesses
from unconstrain.recordings.formats.parquet import describe_columns
from unconstrain.recordings.table import Header, row


class Tabular:
    """A file that is read as a whole into one Arrow table; a subclass says how, in `load_table`.

    Parameters
    ----------
    file : File
    """

    suffixes: ClassVar[tuple[str, ...]] = ()
    at_once: ClassVar[bool] = True

    def __init__(self, file: File) -> None:
        self.file = file

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the content is of this format, as its first bytes tell."""
        return False

    def load_table(self) -> tuple[Any, tuple[str, ...]]:
        """Return all columns as a `pyarrow.Table`, and notes on them. Raises `DataError` for a damaged file."""
        raise NotImplementedError

    def columns(self) -> Header:
        """Return the columns, lists of k numbers as k of them; components of records are called `name.component`."""
        table, _ = self._loaded
        if not len(table):
            raise DataError(f"{self.file.shown} has no samples")
        return describe_columns(table.slice(0, 1).combine_chunks(), self.file.shown, len(table))

    def declared(self) -> Declared | None:
        """Return nothing: such files say nothing of their columns but their names."""
        return None

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
        for name, nth in columns:
            where = [i for i, other in enumerate(table.column_names) if other == name]
            if nth >= len(where):
                raise DataError(
                    f"{self.file.shown} has no column {name!r}; leave it out, or choose other columns"
                )
            column = table.column(where[nth]).slice(start, None if stop is None else stop - start)
            arrays.append(_as_one(column))
        named = [name for name, _ in columns]
        yield start, pa.RecordBatch.from_arrays(arrays, names=named, metadata=note_guesses(notes))

    def place(self, index: int) -> str:
        """Say where in the file a row is."""
        return row(index)

    def in_one_thread(self) -> "Tabular":
        """Return the same file."""
        return self

    def identity(self) -> str:
        """Say what tells the file from others."""
        return repr(self.file.identity())

    @cached_property
    def _loaded(self) -> tuple[Any, tuple[str, ...]]:
        table, notes = self.load_table()
        while any(pa.types.is_struct(field.type) for field in table.schema):
            table = table.flatten()
        # Polars hands out text as views, which other columns of text do not know.
        views = {i: field for i, field in enumerate(table.schema) if pa.types.is_string_view(field.type)}
        for i, field in views.items():
            table = table.set_column(i, field.name, table.column(i).cast(pa.string()))
        return table, notes


def _as_one(column: Any) -> Any:
    chunk = column.combine_chunks()
    return chunk.combine_chunks() if isinstance(chunk, pa.ChunkedArray) else chunk
