"""Text tables: CSV, TSV and the like, with or without a header."""

import csv
import re
from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import islice
from typing import ClassVar, NamedTuple

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv

from unconstrain.errors import DataError
from unconstrain.memory import check_memory
from unconstrain.recordings.files import File
from unconstrain.recordings.formats.base import GUESS, ColumnKey, Declared
from unconstrain.recordings.table import Column, Header

BOM = b"\xef\xbb\xbf"
NUMBER = re.compile(r"\s*([+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf|infinity))\s*", re.IGNORECASE)
DECIMAL_COMMA = r"^\s*([+-]?\d*),(\d+(?:[eE][+-]?\d+)?)\s*$"
PROBED = 20  # lines looked at to find the delimiter


class Text:
    """A text table: CSV, TSV and the like, with or without a header.

    All columns are text; they become numbers only where they are used, so other columns may hold anything. Found by
    itself: the delimiter (tab, semicolon, comma, or spaces), a decimal comma where that is not the delimiter, a
    header, a byte-order mark. Left out: empty lines, and lines that start with `#`; the last of these before the data
    is the header if it names every column, as NumPy's `savetxt` writes.

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
        """Whether the content is of this format: text has no mark of its own, so the suffix decides."""
        return False

    def columns(self) -> Header:
        """Return the columns, by the header, or without names."""
        columns: list[Column] = []
        seen: dict[str, int] = {}
        for name in self._layout.names:
            seen[name] = seen.get(name, -1) + 1
            columns.append(Column(name, pa.string(), None, seen[name]))
        return Header(self.file.shown, columns)

    def declared(self) -> Declared | None:
        """Return nothing: text says nothing of its columns but their names."""
        return None

    @cached_property
    def row_groups(self) -> tuple[int, ...]:
        """The number of samples."""
        return (sum(1 for _ in _content(self._read())) - self._layout.headed,)

    def read(
        self, columns: Sequence[ColumnKey], start: int = 0, stop: int | None = None
    ) -> Iterator[tuple[int, pa.RecordBatch]]:
        """Read rows of these columns as one piece, with its first row."""
        rows = self._parse(columns)
        length = len(rows) if stop is None else stop - start
        yield start, rows.slice(start, length)

    def place(self, index: int) -> str:
        """Say in which line of the file a row is."""
        # Read again, because only a mistake asks for this.
        number, _ = next(islice(_content(self._read()), index + self._layout.headed, None))
        return f"line {number}"

    def in_one_thread(self) -> "Text":
        """Return the same file, decoded by one thread."""
        return self

    def identity(self) -> str:
        """Say what tells the file from others."""
        return repr(self.file.identity())

    def _read(self) -> bytes:
        shown = self.file.shown
        check_memory(
            3.0 * self.file.info.size, f"reading {shown}", "write it as Parquet, which is read in pieces"
        )
        data = self.file.read()
        _check_text(data, shown)
        return data

    @cached_property
    def _layout(self) -> "_Layout":
        data = self.file.begin()
        if len(data) < self.file.info.size:
            # Whole lines, and enough of them; lines of thousands of columns are longer than what is looked at.
            data = data[: max(data.rfind(b"\n"), data.rfind(b"\r")) + 1]
            if sum(1 for _ in _content(data)) < PROBED:
                data = self._read()
        return _lay_out(data, self.file.shown)

    def _parse(self, columns: Sequence[ColumnKey]) -> pa.RecordBatch:
        data, layout = self._read(), self._layout
        names, delimiter = layout.names, layout.delimiter
        at = [[i for i, other in enumerate(names) if other == name][nth] for name, nth in columns]
        lines = [line for _, line in _content(data)][layout.headed :]
        if delimiter == " ":
            lines = [b" ".join(line.split()) for line in lines]
        unique = [str(i) for i in range(len(names))]  # names may repeat, positions do not
        try:
            table = pyarrow.csv.read_csv(
                pa.BufferReader(b"\n".join(lines)),
                read_options=pyarrow.csv.ReadOptions(column_names=unique, block_size=1 << 24),
                parse_options=pyarrow.csv.ParseOptions(delimiter=delimiter),
                convert_options=pyarrow.csv.ConvertOptions(
                    column_types={name: pa.string() for name in unique},
                    include_columns=list(dict.fromkeys(unique[i] for i in at)),
                ),
            )
        except pa.ArrowInvalid as error:
            raise _ragged(data, delimiter, len(names), self.file.shown, error) from error
        found = [table.column(unique[i]).combine_chunks() for i in at]
        guess = None
        if delimiter in "\t;":
            given = found
            found = [pc.replace_substring_regex(column, DECIMAL_COMMA, r"\1.\2") for column in given]
            if any(not a.equals(b) for a, b in zip(given, found, strict=True)):
                guess = {GUESS: "commas in numbers are read as decimal marks"}
        return pa.RecordBatch.from_arrays(found, names=[name for name, _ in columns], metadata=guess)


class _Layout(NamedTuple):
    """How a table is written: its delimiter, the names of its columns, and whether its first line is a header."""

    delimiter: str
    names: list[str]
    headed: bool


def _lay_out(data: bytes, shown: str) -> _Layout:
    _check_text(data, shown)
    lines = [line for _, line in islice(_content(data), PROBED)]
    if not lines:
        raise DataError(f"{shown} is empty: there is nothing to read")
    probe = [line.decode() for line in lines]
    try:
        delimiter = _delimiter(probe)
        if delimiter == " ":
            probe = [" ".join(line.split()) for line in probe]
        cells = list(csv.reader(probe, delimiter=delimiter))
    except csv.Error as error:
        raise DataError(f"{shown} cannot be read as a text table ({error})") from error
    width = len(cells[0])
    headed = _is_header(cells)
    if len(lines) == headed:
        raise DataError(f"{shown} has a header but no samples")
    if headed:
        names = [name.strip() for name in cells[0]]
    else:
        names = _header_in_comment(data, delimiter, width) or [""] * width
    return _Layout(delimiter, names, headed)


def _check_text(data: bytes, shown: str) -> None:
    if b"\0" in data[: 1 << 16]:
        raise DataError(f"{shown} is not a text table: save it as UTF-8 text, or correct its suffix")
    try:
        data.decode()
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise DataError(f"{shown} is not UTF-8 text at line {line}: save it as UTF-8") from error


def _lines(data: bytes) -> list[bytes]:
    return data.removeprefix(BOM).replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")


def _content(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Return the lines that say something, with their number in the file, counted from 1."""
    # Tabs are not stripped: a line of them is a row of empty cells, which must not go unnoticed.
    return (
        (number, line)
        for number, line in enumerate(_lines(data), start=1)
        if line.strip(b" ") and not line.lstrip().startswith(b"#")
    )


def _delimiter(probe: list[str]) -> str:
    # Comma comes last, as it may be the decimal mark of a table delimited otherwise.
    counts = {mark: [len(next(csv.reader([line], delimiter=mark))) for line in probe] for mark in "\t;,"}
    for mark, count in counts.items():
        if min(count) == max(count) > 1:
            return mark
    if any(max(count) > 1 for count in counts.values()):
        return max(counts, key=lambda mark: sum(counts[mark]))
    if len(probe[-1].split()) > 1 and all(NUMBER.fullmatch(cell) for cell in probe[-1].split()):
        return " "
    return ","


def _is_header(cells: list[list[str]]) -> bool:
    first = [cell.strip() for cell in cells[0]]
    numeric = [cell for cell in first if _is_number(cell)]
    if not numeric:
        return True
    # Unnamed columns are written by pandas as 0, 1, 2, ..., and its index as an empty name before them.
    numbered = numeric in ([str(i) for i in range(len(numeric))], [str(i + 1) for i in range(len(numeric))])
    return numbered and len(numeric) < len(first) and len(cells) > 1 and all(map(_is_number, cells[1]))


def _is_number(cell: str) -> bool:
    return NUMBER.fullmatch(cell.replace(",", ".")) is not None


def _header_in_comment(data: bytes, delimiter: str, width: int) -> list[str] | None:
    header = b""
    for line in _lines(data):
        if line.lstrip().startswith(b"#"):
            header = line
        elif line.strip():
            break
    text = header.decode().lstrip(" #")
    names = text.split() if delimiter == " " else [name.strip() for name in text.split(delimiter)]
    return names if len(names) == width > 1 and not any(map(_is_number, names)) else None


def _ragged(data: bytes, delimiter: str, width: int, shown: str, error: Exception) -> DataError:
    for number, line in _content(data):
        text = line.decode()
        try:
            count = len(text.split() if delimiter == " " else next(csv.reader([text], delimiter=delimiter)))
        except csv.Error:
            break
        if count != width:
            return DataError(
                f"{shown}: line {number} has {count} {'cell' if count == 1 else 'cells'} "
                f"where the first line has {width}; "
                "every line must have as many"
            )
    reason = str(error).splitlines()[0]
    return DataError(f"{shown} cannot be read as a text table ({reason})")
