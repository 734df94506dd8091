"""JSON Lines: an object a line, whose members are the columns."""

import json
from typing import Any, ClassVar

import pyarrow as pa
import pyarrow.json

from unconstrain.errors import DataError
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

    suffixes: ClassVar[tuple[str, ...]] = (".jsonl", ".ndjson")

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the text begins with an object on a line of its own."""
        try:
            text, _, _ = begin_text(file)
            return isinstance(json.loads(text.strip().split(b"\n")[0]), dict)
        except (DataError, ValueError, RecursionError):
            return False

    def load_table(self) -> tuple[Any, tuple[str, ...]]:
        """Return all columns, and what was guessed of the encoding."""
        text, notes = read_text(self.file)
        text = text.removeprefix(b"\xef\xbb\xbf")
        lines = text.rstrip(b"\r\n").rsplit(b"\n", 1)
        if len(lines) > 1 and not text.endswith(b"\n") and not _is_object(lines[1]):
            text = lines[0]
            notes = (*notes, "the last line is cut off, and left out")
        with damage_named(self.file.shown, "JSON Lines, with an object of the same members a line"):
            try:
                table = pyarrow.json.read_json(
                    pa.BufferReader(text), read_options=pyarrow.json.ReadOptions(block_size=LONGEST_LINE)
                )
            except pa.ArrowInvalid as error:
                reason = " ".join(str(error).split())
                raise DataError(
                    f"{self.file.shown} cannot be read as JSON Lines ({reason:.200}); write one object a line, with "
                    "members of the same types"
                ) from error
        return table, notes


def _is_object(line: bytes) -> bool:
    try:
        return isinstance(json.loads(line), dict)
    except (ValueError, RecursionError):
        return False
