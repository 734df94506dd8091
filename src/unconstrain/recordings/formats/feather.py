"""Feather and other files of Arrow's own format."""

from typing import Any, ClassVar

import pyarrow as pa

from unconstrain.memory import check_memory
from unconstrain.recordings.files import File
from unconstrain.recordings.formats.base import damage_named
from unconstrain.recordings.formats.tabular import Tabular


class Feather(Tabular):
    """A table that pandas or Polars wrote as Feather, or as an Arrow file.

    Parameters
    ----------
    file : File
    """

    suffixes: ClassVar[tuple[str, ...]] = (".feather", ".arrow", ".ipc")

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the content is of this format, as its first bytes tell."""
        return file.magic[:6] == b"ARROW1" or file.magic[:4] == b"FEA1"

    def load_table(self) -> tuple[Any, tuple[str, ...]]:
        """Return all columns."""
        import pyarrow.feather

        check_memory(8.0 * self.file.info.size, f"reading {self.file.shown}", "write it as Parquet")
        with damage_named(self.file.shown, "a Feather or Arrow file"):
            table = pyarrow.feather.read_table(pa.BufferReader(self.file.read()))
            table.validate(full=True)
        return table.replace_schema_metadata(None), ()
