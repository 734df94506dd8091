"""Text tables: CSV, TSV and the like, with or without a header."""

from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import islice
from typing import ClassVar

import pyarrow as pa

from unconstrain.recordings.files import File
from unconstrain.recordings.formats import motion_capture, opensim
from unconstrain.recordings.formats.base import ColumnKey, Declared, note_guesses
from unconstrain.recordings.formats.text_encoding import begin_text, is_compressed, read_text
from unconstrain.recordings.formats.text_layout import PROBED, Layout, content, find_layout, lines_of
from unconstrain.recordings.formats.text_parsing import parse
from unconstrain.recordings.table import Column, Header

PROGRAMS = (motion_capture.find_vicon, motion_capture.find_motive, opensim.find_trc, opensim.find_storage)
"""Programs that write header blocks of their own: each finds the layout where it wrote the text."""


class Text:
    """A text table: CSV, TSV and the like, with or without a header, compressed or not.

    All columns are text; they become numbers only where they are used, so other columns may hold anything. Found by
    itself: the encoding, title lines, the delimiter (tab, semicolon, comma, or spaces), a decimal comma where that is
    not the delimiter, a header, a line of units, a byte-order mark. Left out: empty lines, and lines that start with
    `#`, `%` or `//`; the last of these before the data is the header if it names every column, as NumPy's `savetxt`
    writes.

    Parameters
    ----------
    file : File
    """

    suffixes: ClassVar[tuple[str, ...]] = (".csv", ".tsv", ".txt")
    at_once: ClassVar[bool] = True

    def __init__(self, file: File) -> None:
        self.file = file

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the content is of this format: text has no mark of its own, but if it is compressed."""
        return is_compressed(file)

    def columns(self) -> Header:
        """Return the columns, by the header, or without names."""
        columns: list[Column] = []
        seen: dict[str, int] = {}
        for name, cell in zip(self._layout.names, self._layout.cells, strict=True):
            seen[name] = seen.get(name, -1) + 1
            columns.append(Column(name, pa.string() if cell is not None else pa.float64(), None, seen[name]))
        return Header(self.file.shown, columns)

    def declared(self) -> Declared | None:
        """Return nothing: text says nothing of its columns but their names."""
        return None

    @cached_property
    def row_groups(self) -> tuple[int, ...]:
        """The number of samples."""
        return (sum(1 for _ in content(self._read()[0], self._layout)),)

    def read(
        self, columns: Sequence[ColumnKey], start: int = 0, stop: int | None = None
    ) -> Iterator[tuple[int, pa.RecordBatch]]:
        """Read rows of these columns as one piece, with its first row."""
        data, guesses = self._read()
        names = self._layout.names
        at = [[i for i, other in enumerate(names) if other == name][nth] for name, nth in columns]
        arrays, found = parse(data, self._layout, at, self.file.shown, self.place)
        about = note_guesses((*guesses, *self._layout.notes, *found))
        rows = pa.RecordBatch.from_arrays(arrays, names=[name for name, _ in columns], metadata=about)
        length = len(rows) if stop is None else stop - start
        yield start, rows.slice(start, length)

    def place(self, index: int) -> str:
        """Say in which line of the file a row is."""
        # Read again, because only a mistake asks for this.
        number, _ = next(islice(content(self._read()[0], self._layout), index, None))
        return f"line {number}"

    def in_one_thread(self) -> "Text":
        """Return the same file, decoded by one thread."""
        return self

    def identity(self) -> str:
        """Say what tells the file from others."""
        return repr(self.file.identity())

    def _read(self) -> tuple[bytes, tuple[str, ...]]:
        """Return the whole text in UTF-8, and what was guessed of its encoding."""
        return read_text(self.file)

    def _begin(self) -> tuple[bytes, bool]:
        """Return the first lines in UTF-8, and whether they are all there are."""
        data, is_all, _ = begin_text(self.file)
        return data, is_all

    @cached_property
    def _layout(self) -> Layout:
        data, is_all = self._begin()
        # Enough lines; lines of thousands of columns are longer than what is looked at.
        if not is_all and sum(1 for _ in islice(content(data), PROBED)) < PROBED:
            data, is_all = self._read()[0], True
        lines = [line.decode() for line in lines_of(data)]
        for find in PROGRAMS:
            layout = find(lines)
            if layout is not None and layout.ends_at_blank and not is_all:
                # Which part of the text is the one wanted, all of it tells.
                layout = find([line.decode() for line in lines_of(self._read()[0])])
            if layout is not None:
                return layout
        return find_layout(data, self.file.shown)
