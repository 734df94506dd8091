"""The cells of a text table as Arrow arrays, once its layout is known."""

import csv
from collections.abc import Callable, Sequence

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv

from unconstrain.errors import DataError
from unconstrain.recordings.formats.text_layout import Layout, content, split_line
from unconstrain.recordings.table import Cells

DECIMAL_COMMA = r"^\s*([+-]?\d*),(\d+(?:[eE][+-]?\d+)?)\s*$"
COMMAS_TELL = "commas in numbers are read as decimal marks"
POINTS_TOO = "in numbers such as 1.050,5 points set off thousands and commas are read as decimal marks"

# Each begins with a sign, if any. A number that begins with 0 has nothing to set off.
THOUSANDS = r"^\s*[+-]?[1-9]\d{0,2}(,\d{3})+(\.\d*)?\s*$"
SURE_THOUSANDS = r"^\s*[+-]?[1-9]\d{0,2}((,\d{3}){2,}(\.\d*)?|,\d{3}\.\d*)\s*$"
BOTH = r"^\s*[+-]?[1-9]\d{0,2}(\.\d{3})+,\d+\s*$"
PLAIN_SMALL = r"^\s*[+-]?\d{1,3}(\.\d*)?\s*$"
HUNDREDS = r"^\s*[+-]?[1-9]\d{2}(\.\d*)?\s*$"
PLAIN = r"^\s*[+-]?\d+(\.\d*)?\s*$"

SLASHES = r"^\s*(\d{4})/(\d{1,2})/(\d{1,2})[ T]+(\d{1,2}:\d{2}:\d{2}(?:\.\d{1,9})?)\s*$"
POINTS = r"^\s*(\d{1,2})\.(\d{1,2})\.(\d{4})[ T]+(\d{1,2}:\d{2}:\d{2}(?:\.\d{1,9})?)\s*$"
OF_DAY = r"^\s*(\d{1,2}:\d{2}:\d{2}(?:[.,]\d{1,9})?)\s*$"
NO_DAY = "times of day are taken for those of one day"


def parse(
    data: bytes, layout: Layout, wanted: Sequence[int], shown: str, place: Callable[[int], str]
) -> tuple[list[pa.Array], tuple[str, ...]]:
    """Return columns of a table, and what was guessed of their numbers.

    Parameters
    ----------
    data : bytes
        The whole text, in UTF-8.
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
        Text; the time of frames is numbers (s).
    guesses : tuple of str

    Raises
    ------
    DataError
        A line has another number of cells, or it cannot be told what commas in numbers mean.
    """
    made = layout.time
    cells = [layout.cells[i] for i in wanted]
    needed = [cell for cell in cells if cell is not None]
    if made is not None and None in cells:
        needed += [made.frame] if made.sub is None else [made.frame, made.sub]
    lines = [line for _, line in content(data, layout)]
    if layout.delimiter == " ":
        lines = [b" ".join(line.split()) for line in lines]
    if layout.is_padded:
        lines = [_fill(line, layout.width, layout.delimiter.encode()) for line in lines]
    if not lines:
        raise DataError(f"{shown} has a header but no samples")
    read = _read(lines, layout, needed, shown, data)
    guesses: dict[str, None] = {}
    columns = []
    for index, cell in zip(wanted, cells, strict=True):
        if cell is None:
            columns.append(_time(layout, read, shown, place))
            continue
        column = read[cell]
        name = layout.names[index]
        called = f"column {name!r}" if name else f"column {index} (counted from 0)"
        if layout.delimiter != "," or b'"' in data:
            column = _without_commas(column, f"{shown}: {called}", called, guesses)
        columns.append(_iso_times(column, called, guesses))
    return columns, tuple(guesses)


def _read(
    lines: list[bytes], layout: Layout, needed: Sequence[int], shown: str, data: bytes
) -> dict[int, pa.Array]:
    unique = [str(i) for i in range(layout.width)]  # names may repeat, positions do not
    try:
        table = pyarrow.csv.read_csv(
            pa.BufferReader(b"\n".join(lines)),
            read_options=pyarrow.csv.ReadOptions(column_names=unique, block_size=1 << 24),
            parse_options=pyarrow.csv.ParseOptions(delimiter=layout.delimiter),
            convert_options=pyarrow.csv.ConvertOptions(
                column_types={name: pa.string() for name in unique},
                include_columns=list(dict.fromkeys(unique[i] for i in needed)),
            ),
        )
    except pa.ArrowInvalid as error:
        raise _ragged(data, layout, shown, error) from error
    return {i: table.column(unique[i]).combine_chunks() for i in needed}


def _fill(line: bytes, width: int, delimiter: bytes) -> bytes:
    """Give a line the separators that it lacks at its end, or take those away that are too many."""
    missing = width - 1 - line.count(delimiter)
    if missing >= 0:
        return line + delimiter * missing
    bare = line.rstrip(delimiter + b" ")
    return bare + delimiter * max(width - 1 - bare.count(delimiter), 0)


def _time(layout: Layout, read: dict[int, pa.Array], shown: str, place: Callable[[int], str]) -> pa.Array:
    """Return the time (s) of rows that are numbered, zero at the first frame there could be."""
    made = layout.time
    assert made is not None
    numbers = Cells(read[made.frame], shown, f"column {layout.names[made.frame]!r}", place).numbers() - 1
    if made.sub is not None:
        sub = Cells(read[made.sub], shown, f"column {layout.names[made.sub]!r}", place).numbers()
        numbers = numbers * (np.max(sub) + 1) + sub
    return pa.array(numbers / made.rate)


def _without_commas(column: pa.Array, where: str, called: str, guesses: dict[str, None]) -> pa.Array:
    """Return text whose numbers have neither decimal commas nor thousands set off."""
    has_comma = pc.match_substring(column, ",")
    if not pc.any(has_comma).as_py():
        return column
    with_comma, others = column.filter(has_comma), column.filter(pc.invert(has_comma))
    if _any(with_comma, BOTH):
        column = pc.replace_substring_regex(column, r"(\d)\.(\d{3})", r"\1\2")
        guesses[POINTS_TOO] = None
        return pc.replace_substring_regex(column, DECIMAL_COMMA, r"\1.\2")
    numbers = with_comma.filter(pc.or_(_matches(with_comma, DECIMAL_COMMA), _matches(with_comma, THOUSANDS)))
    if not len(numbers):
        return column
    is_decimal = not pc.all(_matches(numbers, THOUSANDS)).as_py()
    plain = others.filter(_matches(others, PLAIN))
    # 950 beside 1,050: a decimal that always has three digits would be 950,000.
    beside = len(plain) > 0 and pc.all(_matches(plain, PLAIN_SMALL)).as_py()
    is_thousands = _any(numbers, SURE_THOUSANDS) or (not is_decimal and beside and _any(plain, HUNDREDS))
    if beside and not is_decimal and not is_thousands:
        raise DataError(
            f"{where} holds {numbers[0].as_py().strip()!r} beside {plain[0].as_py().strip()!r}, so its comma may be a "
            "decimal mark or set off thousands; write numbers with points and without anything between thousands"
        )
    if is_decimal and is_thousands:
        odd = numbers.filter(pc.invert(_matches(numbers, THOUSANDS)))[0].as_py().strip()
        sure = numbers.filter(_matches(numbers, SURE_THOUSANDS))[0].as_py().strip()
        raise DataError(
            f"{where} holds {sure!r} and {odd!r}, so its commas mean two things; write numbers with points and "
            "without anything between thousands"
        )
    if is_thousands:
        guesses[f"commas in numbers of {called} are read as setting off thousands"] = None
        return pc.if_else(_matches(column, THOUSANDS), pc.replace_substring(column, ",", ""), column)
    guesses[COMMAS_TELL] = None
    return pc.replace_substring_regex(column, DECIMAL_COMMA, r"\1.\2")


def _iso_times(column: pa.Array, called: str, guesses: dict[str, None]) -> pa.Array:
    """Return stamps as ISO 8601 has them: a date with slashes or points, or only the time of day."""
    first = column[:1]
    if _any(first, SLASHES):
        return pc.replace_substring_regex(column, SLASHES, r"\1-\2-\3 \4")
    if _any(first, POINTS):
        return pc.replace_substring_regex(column, POINTS, r"\3-\2-\1 \4")
    if _any(first, OF_DAY):
        guesses[f"{called}: {NO_DAY}"] = None
        return pc.replace_substring_regex(pc.replace_substring(column, ",", "."), OF_DAY, r"1970-01-01 \1")
    return column


def _matches(column: pa.Array, pattern: str) -> pa.Array:
    return pc.match_substring_regex(column, pattern)


def _any(column: pa.Array, pattern: str) -> bool:
    return bool(pc.any(_matches(column, pattern)).as_py())


def _ragged(data: bytes, layout: Layout, shown: str, error: Exception) -> DataError:
    for number, line in content(data, layout):
        try:
            count = len(split_line(line.decode(), layout.delimiter))
        except csv.Error:
            break
        if count != layout.width:
            return DataError(
                f"{shown}: line {number} has {count} {'cell' if count == 1 else 'cells'} "
                f"where the first line has {layout.width}; "
                "every line must have as many"
            )
    reason = str(error).splitlines()[0]
    return DataError(f"{shown} cannot be read as a text table ({reason})")
