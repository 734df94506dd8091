"""Text tables: CSV, TSV and the like, with or without a header."""

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from itertools import islice
from typing import ClassVar

import pyarrow as pa

from unconstrain.recordings.columns import Columns
from unconstrain.recordings.files import File
from unconstrain.recordings.formats import kept, labview, motion_capture, opensim, qualisys
from unconstrain.recordings.formats.base import (
    ColumnKey,
    Declared,
    OneFile,
    damage_named,
    find_part,
    note_guesses,
)
from unconstrain.recordings.formats.text_encoding import (
    begin_text,
    find_codec,
    is_compressed,
    members,
    read_text,
)
from unconstrain.recordings.formats.text_layout import PROBED, find_layout
from unconstrain.recordings.formats.text_lines import Layout, content, join_header, lines_of
from unconstrain.recordings.formats.text_made import Part, cells_of
from unconstrain.recordings.formats.text_parsing import parse
from unconstrain.recordings.formats.text_plain import Plain, read_plain
from unconstrain.recordings.formats.text_rows import Rows, begins_anew, find_rows
from unconstrain.recordings.formats.text_wanted import find_wanted
from unconstrain.recordings.table import Column, Header
from unconstrain.recordings.units import said_of_units, unit_in

PROGRAMS = (
    motion_capture.find_motive, qualisys.find_qualisys, labview.find_labview, opensim.find_trc, opensim.find_storage,
)  # fmt: skip
"""Programs that write header blocks of their own: each finds the layout where it wrote the text."""

CACHED = ("_begun", "_layout", "_sheet", "row_groups", "_is_unusual")
"""What was found of one part of a file, or for one choice of columns."""

LONG = 1 << 18
"""Bytes of a text that is worth reading as it lies in the file."""

EPISODE = ("episode", "run", "restart")
"""What the column is called that counts where the header comes again: the first of these that is free."""


class Text(OneFile):
    """A text table: CSV, TSV and the like, with or without a header, compressed or not.

    All columns are text; they become numbers only where they are used, so other columns may hold anything. Found by
    itself: the encoding, title lines, the delimiter (tab, semicolon, bar, comma, or spaces), a decimal comma where that
    is not the delimiter, a header of one line or several, a line of units, a byte-order mark. Left out: empty lines
    and lines that start with `#`, `%` or `//`; the last of these before the data is the header if it names every
    column, as NumPy's `savetxt` writes. Where the header comes again, another episode begins.

    Parameters
    ----------
    file : File
    """

    suffixes: ClassVar[tuple[str, ...]] = (".csv", ".tsv", ".txt")
    part: str | None = None
    """The part that is read, where the user names one."""
    wanted: Columns = Columns()
    """Which columns will be read; all of them where it names no states."""
    _is_unusual = False

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the content is of this format: text has no mark of its own, but if it is compressed."""
        return is_compressed(file)

    def parts(self) -> tuple[str, ...]:
        """Return the parts of the file, one of which is read: files of an archive, or sections of an export."""
        return members(self.file) or motion_capture.sections(self._all_lines())

    def for_part(self, name: str) -> "Text":
        """Return the same file, of which this part is read. That it is not there, `columns` says."""
        alike = copy(self)
        for known in CACHED:
            alike.__dict__.pop(known, None)
        alike.part = name
        return alike

    def for_columns(self, wanted: Columns) -> "Text":
        """Return the same file, of which these columns will be read, by whatever role they play."""
        alike = copy(self)
        for known in CACHED:
            alike.__dict__.pop(known, None)
        alike.wanted = wanted
        return alike

    def columns(self) -> Header:
        """Return the columns, by the header, or without names."""
        plain = self._plain()
        return self._header(self._layout, {} if plain is None else plain.columns)

    def _header(self, layout: Layout, read: Mapping[int, pa.Array]) -> Header:
        """Return the columns of a layout; those that were read are known to be numbers or text."""
        columns: list[Column] = []
        seen: dict[str, int] = {}
        lists: dict[str, tuple[pa.DataType, int | None]] = {}
        units = _units(layout)
        for place, (name, cell, unit) in enumerate(zip(layout.names, layout.cells, units, strict=True)):
            nth = seen[name] = seen.get(name, -1) + 1
            kind = (
                cell.kind if not isinstance(cell, int) else read[cell].type if cell in read else pa.string()
            )
            width = layout.widths.get(place, 0)
            if not width or not name:
                columns.append(Column(name, kind, None, nth, unit=unit))
                continue
            lists[name] = pa.list_(pa.float64()), None
            columns += [
                Column(f"{name}[{i}]", pa.float64(), None, nth, name, i, width, unit) for i in range(width)
            ]
        return Header(self.file.shown, columns, lists)

    def declared(self) -> Declared | None:
        """Return the columns that are made: the time, and the episodes of a logger that began anew."""
        made = {
            "episode" if isinstance(cell, Part) else "time": name
            for name, cell in zip(self._layout.names, self._layout.cells, strict=True)
            if not isinstance(cell, int)
        }
        return Declared(Columns(**made)) if made else None

    @cached_property
    def row_groups(self) -> tuple[int, ...]:
        """The number of samples."""
        plain = self._plain()
        return (len(self._rows()[0].lines) if plain is None else len(plain),)

    def read(
        self, columns: Sequence[ColumnKey], start: int = 0, stop: int | None = None
    ) -> Iterator[tuple[int, pa.RecordBatch]]:
        """Read rows of these columns as one piece, with its first row."""
        layout = self._layout
        names, units = layout.names, _units(layout)
        at = [[i for i, other in enumerate(names) if other == name][nth] for name, nth in columns]
        read = self._read_plain(at)
        if read is None:
            rows, guesses = self._rows()
            arrays, found = parse(rows, layout, at, self.file.shown, self.place)
            left_out = rows.notes
        else:
            arrays, found, left_out = read
            guesses = ()
        said = said_of_units({names[i] or f"column {i}": units[i] for i in at})
        about = note_guesses((*guesses, *layout.notes, *left_out, *found, *said))
        batch = pa.RecordBatch.from_arrays(arrays, names=[name for name, _ in columns], metadata=about)
        length = len(batch) if stop is None else stop - start
        yield start, batch.slice(start, length)

    def place(self, index: int) -> str:
        """Say in which line of the file a row is."""
        # Read again, because only a mistake asks for this.
        return f"line {self._rows()[0].numbers[index]}"

    def identity(self) -> str:
        """Say what tells the part that is read from others."""
        return repr((self.file.identity(), self.part)) if self.part else super().identity()

    @property
    def _beside(self) -> list[str]:
        """Lines from elsewhere in the file that may tell the rate."""
        return []

    @property
    def _has_tables(self) -> bool:
        """Whether a part is a table by itself."""
        return bool(members(self.file))

    def _rows(self) -> tuple[Rows, tuple[str, ...]]:
        """Return the samples, and what was guessed of the encoding."""
        data, guesses = self._read()
        return find_rows(data, self._layout), guesses

    def _read(self) -> tuple[bytes, tuple[str, ...]]:
        """Return the whole text in UTF-8, and what was guessed of its encoding."""
        data, guesses = read_text(self.file, self.part)
        return join_header(data), guesses

    def _begin(self) -> tuple[bytes, bool]:
        """Return the first lines in UTF-8, and whether they are all there are."""
        data, is_all, _ = begin_text(self.file, self.part)
        return join_header(data), is_all

    def _all_lines(self) -> list[str]:
        return [line.decode() for line in lines_of(self._read()[0])]

    @cached_property
    def _layout(self) -> Layout:
        layout = self._begun
        if not layout.heading or self._plain() is not None or not begins_anew(self._read()[0], layout):
            return layout
        name = next(name for name in EPISODE if name not in layout.names)
        units = (*layout.units, "") if layout.units else ()
        return replace(layout, names=(*layout.names, name), cells=(*layout.cells, Part()), units=units)

    @cached_property
    def _begun(self) -> Layout:
        """The layout as the first lines tell it."""
        data, is_all = self._begin()
        # Enough lines; lines of thousands of columns are longer than what is looked at.
        if not is_all and sum(1 for _ in islice(content(data), PROBED)) < PROBED:
            data, is_all = self._read()[0], True
        lines = [line.decode() for line in lines_of(data)]
        section = None if self._has_tables else self.part
        if motion_capture.sections(lines):
            # Which part of the text is the one wanted, all of it tells.
            lines = lines if is_all else self._all_lines()
            titles = motion_capture.sections(lines)
            layout = motion_capture.find_vicon(lines, find_part(section, titles, self.file.shown))
            if layout is not None:
                self._is_unusual = True
                return layout
        find_part(section, (), self.file.shown)
        for find in PROGRAMS:
            with damage_named(self.file.shown, "a text table"):
                layout = find(lines)
            if layout is not None:
                return layout
        return find_layout(data, self.file.shown, self._beside)

    @property
    def _may_be_plain(self) -> bool:
        """Whether the text is worth reading as it lies in the file."""
        return self.part is None and self.file.info.size > LONG and find_codec(self.file) is None

    def _plain(self) -> Plain | None:
        """Return the columns that are wanted as Arrow reads them, where the text is plain."""
        if self._is_unusual:
            return None
        plain: Plain | None = kept.find(self)
        if plain is not None:
            return plain
        if self._may_be_plain:
            layout = self._begun
            plain = read_plain(
                self.file, layout, find_wanted(self._header(layout, {}), layout, self.wanted.read)
            )
        if plain is None:
            self._is_unusual = True
        else:
            kept.keep(self, plain, plain.n_bytes)
        return plain

    def _read_plain(
        self, at: Sequence[int]
    ) -> tuple[list[pa.Array], tuple[str, ...], tuple[str, ...]] | None:
        """Return columns of a plain text, what was guessed of them, and what was left out."""
        plain = self._plain()
        if plain is None:
            return None
        layout = self._layout
        names = {cell: layout.names[i] for i, cell in enumerate(layout.cells) if isinstance(cell, int)}
        cells = [layout.cells[i] for i in at]
        needed = [one for cell in cells for one in ([cell] if isinstance(cell, int) else cell.needs)]
        if not plain.columns.keys() >= set(needed):
            return None
        arrays = [
            plain.columns[cell]
            if isinstance(cell, int)
            else cell.make(
                cells_of(cell, dict(plain.columns), names, self.file.shown, self.place), len(plain), ()
            )
            for cell in cells
        ]
        return (
            arrays,
            tuple(guess for one in dict.fromkeys(needed) for guess in plain.guesses[one]),
            plain.notes,
        )


def _units(layout: Layout) -> tuple[str, ...]:
    return tuple(
        unit or unit_in(name)
        for name, unit in zip(layout.names, layout.units or [""] * len(layout.names), strict=True)
    )
