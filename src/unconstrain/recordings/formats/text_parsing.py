"""The cells of a text table as Arrow arrays, once its layout is known."""

import csv
from collections.abc import Callable, Sequence

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv

from unconstrain.errors import DataError
from unconstrain.recordings.formats.text_lines import Layout, split_line
from unconstrain.recordings.formats.text_made import cells_of
from unconstrain.recordings.formats.text_numbers import plain_text
from unconstrain.recordings.formats.text_rows import Rows


def parse(
    rows: Rows, layout: Layout, wanted: Sequence[int], shown: str, place: Callable[[int], str]
) -> tuple[list[pa.Array], tuple[str, ...]]:
    """Return columns of a table, and what was guessed of their numbers.

    Parameters
    ----------
    rows : Rows
    layout : Layout
    wanted : sequence of int
        Which of the layout's columns.
    shown : str
        The file, as the user calls it.
    place : function
        Where in the file the i-th row is.

    Returns
    -------
    columns : list of pyarrow.Array
        Text; what is made is numbers.
    guesses : tuple of str

    Raises
    ------
    DataError
        A line has another number of cells, or it cannot be told what commas in numbers mean.
    """
    if not rows.lines:
        raise DataError(f"{shown} has a header but no samples")
    cells = [layout.cells[i] for i in wanted]
    names = {cell: layout.names[i] for i, cell in enumerate(layout.cells) if isinstance(cell, int)}
    needed = [i for cell in cells for i in ([cell] if isinstance(cell, int) else cell.needs)]
    lines = rows.lines
    if layout.delimiter == " ":
        lines = [b" ".join(line.split()) for line in lines]
    if layout.is_padded:
        lines = [_fill(line, layout.width, layout.delimiter.encode()) for line in lines]
    text = b"\n".join(lines)
    read = _read(text, layout, needed, shown, rows)
    may_have_commas = layout.delimiter != "," or b'"' in text
    guesses: dict[str, None] = {}
    for cell, column in read.items():
        name = names.get(cell)
        called = f"column {name!r}" if name else f"column {cell} (counted from 0)"
        read[cell] = plain_text(
            column, f"{shown}: {called}", called, guesses, may_have_commas=may_have_commas
        )
    columns = [
        _lists(read[cell], layout.widths.get(index, 0), shown, layout.names[index], place)
        if isinstance(cell, int)
        else cell.make(cells_of(cell, read, names, shown, place), len(lines), rows.begins)
        for index, cell in zip(wanted, cells, strict=True)
    ]
    return columns, tuple(guesses)


def _read(text: bytes, layout: Layout, needed: Sequence[int], shown: str, rows: Rows) -> dict[int, pa.Array]:
    unique = [str(i) for i in range(layout.width)]  # names may repeat, positions do not
    try:
        table = pyarrow.csv.read_csv(
            pa.BufferReader(text),
            read_options=pyarrow.csv.ReadOptions(column_names=unique, block_size=1 << 24),
            parse_options=pyarrow.csv.ParseOptions(delimiter=layout.delimiter),
            convert_options=pyarrow.csv.ConvertOptions(
                column_types={name: pa.string() for name in unique},
                include_columns=list(dict.fromkeys(unique[i] for i in needed)),
            ),
        )
    except pa.ArrowInvalid as error:
        raise _ragged(rows, layout, shown, error) from error
    return {i: table.column(unique[i]).combine_chunks() for i in dict.fromkeys(needed)}


def _fill(line: bytes, width: int, delimiter: bytes) -> bytes:
    """Give a line the separators that it lacks at its end, or take those away that are too many."""
    missing = width - 1 - line.count(delimiter)
    if missing >= 0:
        return line + delimiter * missing
    bare = line.rstrip(delimiter + b" ")
    return bare + delimiter * max(width - 1 - bare.count(delimiter), 0)


def _lists(column: pa.Array, width: int, shown: str, name: str, place: Callable[[int], str]) -> pa.Array:
    """Return cells that hold numbers in brackets as lists of these; other columns, of no width, as they are."""
    if not width:
        return column
    bare = pc.utf8_trim(pc.utf8_trim_whitespace(column), "[]()")
    parts = pc.split_pattern_regex(pc.utf8_trim(bare, " ,"), r"[,\s]+")
    try:
        return parts.cast(pa.list_(pa.float64()))
    except pa.ArrowInvalid as error:
        odd = pc.invert(pc.match_substring_regex(bare, r"^[\d\s,.eE+-]*$"))
        at = f", first at {place(pc.index(odd, True).as_py())}" if pc.any(odd).as_py() else ""
        raise DataError(f"{shown}: column {name!r} holds lists of something else than numbers{at}") from error


def _ragged(rows: Rows, layout: Layout, shown: str, error: Exception) -> DataError:
    for number, line in zip(rows.numbers, rows.lines, strict=True):
        try:
            count = len(split_line(line.decode(), layout.delimiter))
        except csv.Error:
            break
        if count != layout.width:
            if layout.delimiter == "," and count == 2 * layout.width:
                return DataError(
                    f"{shown}: line {number} has {count} cells where the first line has {layout.width}, so commas may "
                    "be decimal marks there as well as separate cells; write it with points, or semicolons in between"
                )
            return DataError(
                f"{shown}: line {number} has {count} {'cell' if count == 1 else 'cells'} "
                f"where the first line has {layout.width}; "
                "every line must have as many"
            )
    reason = str(error).splitlines()[0]
    return DataError(f"{shown} cannot be read as a text table ({reason})")
