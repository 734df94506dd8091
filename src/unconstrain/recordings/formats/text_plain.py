"""Long text tables in which every line is a sample: read by Arrow as they lie in the file, by all processors.

What `text_rows` and `text_parsing` look for line by line is ruled out here by few looks at the bytes, or by what the
cells turned out to be. Where anything is unusual nothing is returned, and the text is read line by line.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv

from unconstrain.errors import DataError
from unconstrain.memory import check_memory
from unconstrain.recordings.files import File, named_errors
from unconstrain.recordings.formats.text_encoding import BOM, INSTEAD, begin_text
from unconstrain.recordings.formats.text_end import PIECE, Body, find_body
from unconstrain.recordings.formats.text_lines import COMMENTS, Layout, is_number, join_header, split_line
from unconstrain.recordings.formats.text_numbers import DATE, SENTINELS, cast, plain_text, without_sentinels
from unconstrain.recordings.formats.text_wanted import Wanted

LABEL = pa.dictionary(pa.int32(), pa.string())
"""What labels of episodes are read as: most of them come again."""

WHOLE = re.compile(r"\s*[+-]?\d+\s*")

SPACES = (b"  ", b" \n", b"\n ", b" \r", b"\r ", b"\t", b"\v", b"\f", b"\x1c", b"\x1d", b"\x1e", b"\x1f")
"""What is not one space between two cells, where spaces separate these."""

COMMENT = re.compile(rb"[\r\n][ \t]*(?:#|%|//)")


@dataclass(frozen=True)
class Plain:
    """What was read of a text.

    Parameters
    ----------
    columns : dict of int to pyarrow.Array
        By cell: numbers, or text as `plain_text` leaves it.
    guesses : dict of int to tuple of str
        What was guessed of each.
    notes : tuple of str
        What was left out.
    """

    columns: Mapping[int, Any]
    guesses: Mapping[int, tuple[str, ...]]
    notes: tuple[str, ...]

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(next(iter(self.columns.values())))

    @property
    def n_bytes(self) -> int:
        """The size of the columns."""
        return sum(column.nbytes for column in self.columns.values())


def read_plain(file: File, layout: Layout, wanted: Wanted) -> Plain | None:
    """Read cells of a text whose lines are all alike.

    Parameters
    ----------
    file : File
        Not compressed, and longer than what is looked at to find the layout.
    layout : Layout
        As its first lines tell.
    wanted : Wanted

    Returns
    -------
    Plain or None
        None where anything about the text is unusual.

    Raises
    ------
    DataError
        The file cannot be read, or its numbers do not fit into memory.
    """
    if layout.is_padded or layout.ends_at_blank or layout.width < 2 or not wanted.cells:
        return None
    if any(layout.widths.get(i) and cell in wanted.cells for i, cell in enumerate(layout.cells)):
        return None
    head, is_all, guesses = begin_text(file)
    if is_all or guesses or b"\0" in head or join_header(head) != head:
        return None
    with named_errors(file.shown), file.open() as opened:
        body = find_body(opened, head, len(BOM) if head.startswith(BOM) else 0, layout)
        if body is None:
            return None
        rows = (body.stop - body.start) / min(map(len, body.first))
        check_memory(16.0 * rows * len(wanted.cells), f"reading {file.shown}", INSTEAD)
        kinds = _find_kinds(body, layout, wanted)
        read = _read(opened, file.shown, body, layout, wanted, kinds)
        if read is None and any(kind != pa.string() for kind in kinds.values()):
            # Something among the numbers is none. As text it can be looked at.
            text = dict.fromkeys(kinds, pa.string())
            read = _read(opened, file.shown, body, layout, wanted, text)
        return read


def _find_kinds(body: Body, layout: Layout, wanted: Wanted) -> dict[int, pa.DataType]:
    """Find by the first lines as what the cells are read."""
    rows = [split_line(line.decode(), layout.delimiter) for line in body.first]
    kinds: dict[int, pa.DataType] = {}
    for cell in wanted.cells:
        own = [row[cell].strip() if cell < len(row) else "" for row in rows]
        if cell == wanted.label:
            kinds[cell] = LABEL
        elif cast(pa.array(own)) is None or re.match(DATE, own[0]):
            kinds[cell] = pa.string()
        else:
            # Stamps of today in nanoseconds are more than float64 resolves.
            whole = cell == wanted.time and all(map(WHOLE.fullmatch, own))
            kinds[cell] = pa.int64() if whole else pa.float64()
    return kinds


def _read(
    opened: Any, shown: str, body: Body, layout: Layout, wanted: Wanted, kinds: dict[int, pa.DataType]
) -> Plain | None:
    texts = [cell for cell, kind in kinds.items() if kind == pa.string()]
    has_quotes = False
    if texts or len(kinds) < layout.width:
        # A number or a label at the beginning of each line leaves no room for comments.
        may_be_comment = kinds.get(0, pa.string()) == pa.string()
        unusual = (*(COMMENTS if may_be_comment else ()), *(SPACES if layout.delimiter == " " else ()))
        seen = _look_through(opened, body, unusual)
        if seen is None:
            return None
        has_quotes = seen
    table = _parse(opened, body, layout, kinds)
    if table is None or not table.num_rows:
        return None
    if has_quotes and table.num_rows != _count_samples(opened, body):
        return None  # cells with line breaks in them
    if _may_hold_heading(table, layout, kinds):
        return None
    names = {cell: layout.names[i] for i, cell in enumerate(layout.cells) if isinstance(cell, int)}
    columns: dict[int, Any] = {}
    guesses: dict[int, tuple[str, ...]] = {}
    for cell, kind in kinds.items():
        # One after the other, so that no column is held twice but the one at hand.
        column = table.column(str(cell)).unify_dictionaries().combine_chunks()
        table = table.drop_columns(str(cell))
        called = f"column {names[cell]!r}" if names.get(cell) else f"column {cell} (counted from 0)"
        own: dict[str, None] = {}
        if kind == pa.string():
            may_have_commas = layout.delimiter != "," or has_quotes
            try:
                column = plain_text(
                    column, f"{shown}: {called}", called, own, may_have_commas=may_have_commas
                )
            except DataError:
                return None  # said where the text is read line by line
        elif kind == LABEL:
            if not _are_plain_labels(column.dictionary, called):
                return None
        elif not _are_plain_numbers(column, called):
            return None
        columns[cell], guesses[cell] = column, tuple(own)
    # The blocks that were parsed are gone, but Arrow would keep their memory for others.
    del column, table
    pa.default_memory_pool().release_unused()
    return Plain(columns, guesses, body.notes)


def _look_through(opened: Any, body: Body, unusual: Sequence[bytes]) -> bool | None:
    """Return whether there are quotes in a text; None where there is more that needs a look at each line."""
    has_quotes = False
    for at in range(body.start, body.stop, PIECE):
        piece = opened.read_at(min(PIECE + 1, body.stop - at), at)  # two characters may lie in two pieces
        if not piece.isascii() or b"\0" in piece:
            return None
        if any(mark in piece for mark in unusual):
            return None
        has_quotes = has_quotes or b'"' in piece
    return has_quotes


def _count_samples(opened: Any, body: Body) -> int | None:
    """Count the lines of a text; None where some end otherwise than others."""
    count, last = 0, b""
    for at in range(body.start, body.stop, PIECE):
        last = opened.read_at(min(PIECE, body.stop - at), at)
        if b"\r" in last:
            return None
        count += last.count(b"\n")
    return count + (not last.endswith(b"\n"))


def _parse(opened: Any, body: Body, layout: Layout, kinds: dict[int, pa.DataType]) -> Any:
    """Return the cells as a table; None where a line has another number of cells, or one is not of its kind."""
    types = {str(cell): kind for cell, kind in kinds.items()}
    try:
        return pyarrow.csv.read_csv(
            opened.get_stream(body.start, body.stop - body.start),
            read_options=pyarrow.csv.ReadOptions(column_names=[str(i) for i in range(layout.width)]),
            parse_options=pyarrow.csv.ParseOptions(delimiter=layout.delimiter),
            convert_options=pyarrow.csv.ConvertOptions(
                column_types=types, include_columns=list(types), null_values=[]
            ),
        )
    except pa.ArrowInvalid:
        return None


def _may_hold_heading(table: Any, layout: Layout, kinds: dict[int, pa.DataType]) -> bool:
    """Whether the header may come again among the samples: not where a name would stand among numbers."""
    for line in layout.heading:
        if line.startswith(COMMENTS):
            continue  # comments were looked for, or would stand in the first column
        cells = [cell.strip() for cell in split_line(line.decode(), layout.delimiter)]
        names = {cell: cells[cell] for cell in kinds if cell < len(cells)}
        if any(
            not is_number(name) and kinds[cell] not in (pa.string(), LABEL) for cell, name in names.items()
        ):
            continue
        if not names:
            return True
        cell, name = next(iter(names.items()))
        column = table.column(str(cell))
        column = column.cast(pa.string()) if kinds[cell] != pa.string() else column
        if pc.any(pc.equal(pc.utf8_trim_whitespace(column), name)).as_py():
            return True
    return False


def _are_plain_labels(labels: Any, called: str) -> bool:
    """Whether labels mean what is written, so that nothing would be made of a column of them."""
    numbers = cast(labels)
    if numbers is not None and any(pc.any(pc.equal(numbers, each)).as_py() for each in SENTINELS):
        return False
    guesses: dict[str, None] = {}
    try:
        made = plain_text(labels, "", called, guesses, may_have_commas=True)
    except DataError:
        return False
    every = "\n".join(labels.to_pylist())
    if guesses or not made.equals(labels) or not every.isascii() or "\0" in every or "\r" in every:
        return False
    return every.count("\n") == len(labels) - 1 and COMMENT.search(b"\n" + every.encode()) is None


def _are_plain_numbers(column: Any, called: str) -> bool:
    """Whether numbers are finite, and none of them stands for a missing one."""
    numbers = column.to_numpy()
    least, most = numbers.min(), numbers.max()
    if not np.isfinite(least) or not np.isfinite(most):
        return False
    if least > max(SENTINELS):
        return True
    guesses: dict[str, None] = {}
    column = column.cast(pa.float64(), safe=False)
    without_sentinels(column, column, called, guesses)
    return not guesses
