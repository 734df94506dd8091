"""Data frames of pandas and Polars, and Arrow tables: recordings that are in memory already."""

import hashlib
from typing import Any

import pyarrow as pa

from unconstrain.errors import DataError
from unconstrain.recordings.files import File
from unconstrain.recordings.formats.tabular import Tabular

INDEX = "__index_level_0__"
"""What Arrow calls an index of pandas that has no name."""


class Frame(Tabular):
    """A data frame, read as a file would be.

    Parameters
    ----------
    frame : pandas.DataFrame, polars.DataFrame, pyarrow.Table, or what else has Arrow's C stream
        An index of pandas that does more than count rows is a column, too.
    shown : str
        What sentences call it.

    Raises
    ------
    DataError
        A column holds what Arrow has no type for, or it is no table.
    """

    def __init__(self, frame: Any, shown: str) -> None:
        super().__init__(File(shown, shown, None))
        self._table = _to_arrow(frame, shown)

    def load_table(self) -> tuple[Any, tuple[str, ...]]:
        """Return all columns, without a note."""
        return self._table, ()

    def identity(self) -> str:
        """Say what tells this frame from others: a digest of its values."""
        digest = hashlib.blake2b(digest_size=16)
        for name, column in zip(self._table.column_names, self._table.columns, strict=True):
            digest.update(f"{name} {column.type}".encode())
            for chunk in column.chunks:
                digest.update(f"{len(chunk)} {chunk.offset}".encode())
                for buffer in chunk.buffers():
                    digest.update(b"" if buffer is None else buffer)
        return digest.hexdigest()


def is_frame(source: Any) -> bool:
    """Whether something is a data frame, without importing what makes them."""
    return hasattr(source, "__arrow_c_stream__")


def _to_arrow(frame: Any, shown: str) -> Any:
    try:
        of_pandas = type(frame).__module__.split(".")[0] == "pandas"
        table = pa.Table.from_pandas(frame) if of_pandas else pa.table(frame)
    except (pa.ArrowException, TypeError, ValueError, AttributeError) as error:
        reason = " ".join(" ".join(map(str, error.args)).split())
        raise DataError(f"{shown} cannot be read as a table ({reason:.200}); give a data frame") from error
    names = table.column_names
    if INDEX in names and "index" not in names:
        table = table.rename_columns(["index" if name == INDEX else name for name in names])
    return table.replace_schema_metadata(None)
