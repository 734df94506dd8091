"""JSON Lines: an object a line, whose members are the columns; also one array of such objects."""

import json
from typing import Any, ClassVar

import pyarrow as pa
import pyarrow.json

from unconstrain.errors import DataError
from unconstrain.memory import check_memory
from unconstrain.recordings.files import File
from unconstrain.recordings.formats.base import damage_named
from unconstrain.recordings.formats.tabular import Tabular
from unconstrain.recordings.formats.text_encoding import begin_text, read_text

LONGEST_LINE = 1 << 26
"""Bytes of a line at most, as many are parsed at a time."""


class JsonLines(Tabular):
    """Objects, one a line; members of objects within them are called by path, such as `pose.x`.

    Parameters
    ----------
    file : File
    """

    suffixes: ClassVar[tuple[str, ...]] = (".jsonl", ".ndjson", ".json")

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the text begins with an object."""
        if file.magic.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] not in (b"{", b"["):
            return False
        try:
            text, is_all, _ = begin_text(file)
        except DataError:
            return False
        text = text.strip()
        if text[:1] == b"[":
            return text[1:].lstrip()[:1] == b"{"
        first = text if is_all and b"\n" not in text else text.split(b"\n")[0]
        try:
            return isinstance(json.loads(first), dict)
        except (ValueError, RecursionError):
            return False

    def load_table(self) -> tuple[Any, tuple[str, ...]]:
        """Return all columns, and what was guessed of the encoding."""
        text, notes = read_text(self.file)
        with damage_named(self.file.shown, "JSON Lines, with an object of the same members a line"):
            if text.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"[":
                check_memory(30.0 * len(text), f"reading {self.file.shown}", "write it as Parquet")
                return pa.Table.from_pylist(json.loads(text.decode("utf-8-sig"))), notes
            try:
                table = pyarrow.json.read_json(
                    pa.BufferReader(text.removeprefix(b"\xef\xbb\xbf")),
                    read_options=pyarrow.json.ReadOptions(block_size=LONGEST_LINE),
                )
            except pa.ArrowInvalid as error:
                reason = " ".join(str(error).split())
                raise DataError(
                    f"{self.file.shown} cannot be read as JSON Lines ({reason:.200}); write one object a line, with "
                    "members of the same types"
                ) from error
        return table, notes
