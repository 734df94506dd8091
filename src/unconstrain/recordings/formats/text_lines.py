"""The lines of a text table, how they are split into cells, and how a table is laid out in them."""

import csv
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import islice

from unconstrain.recordings.formats.text_encoding import BOM
from unconstrain.recordings.formats.text_made import Made

NUMBER = re.compile(r"\s*([+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?|[+-]?(nan|inf|infinity))\s*", re.IGNORECASE)
FLAG = re.compile(r"true|false", re.IGNORECASE)
COMMENTS = (b"#", b"%", b"//")
LONGEST_HEADER = 65_536
MOST_BREAKS = 50
"""How long a first line may be whose names have line breaks in them: bytes, and lines."""

MARKS = "\t;|,"
"""What separates cells, besides spaces; the comma comes last, as it may be a decimal mark."""


@dataclass(frozen=True)
class Layout:
    """How a table is written.

    Parameters
    ----------
    delimiter : str
        Between cells; a space stands for any number of them.
    width : int
        Cells in a line.
    names : tuple of str
        Of the columns.
    cells : tuple of int or Made
        Which cell of a line each column is, or what it is made of.
    skipped : int
        Lines of the file before the first sample.
    notes : tuple of str
        What was guessed, or what the file says of itself.
    units : tuple of str
        Of the columns, "" where the file says none; empty where it says nothing of any.
    is_padded : bool
        Whether lines may lack separators at their ends, or have too many.
    ends_at_blank : bool
        Whether an empty line ends the table.
    heading : tuple of bytes
        The lines that name the columns; where they come again, the logger began anew.
    widths : dict of int to int
        Of the columns whose cells are lists of numbers in brackets, how many numbers these hold.
    """

    delimiter: str
    width: int
    names: tuple[str, ...]
    cells: tuple[int | Made, ...]
    skipped: int
    notes: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    is_padded: bool = False
    ends_at_blank: bool = False
    heading: tuple[bytes, ...] = ()
    widths: Mapping[int, int] = field(default_factory=dict)


def lines_of(data: bytes) -> list[bytes]:
    """Return the lines of a text."""
    return data.removeprefix(BOM).replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")


def join_header(data: bytes) -> bytes:
    """Return a text whose first line is whole, where quoted names of columns have line breaks in them.

    Empty lines behind it keep the numbers of all others.
    """
    first, _, _ = data.partition(b"\n")
    if first.count(b'"') % 2 == 0:
        return data
    lines = data[:LONGEST_HEADER].split(b"\n")
    quotes = 0
    for count, line in enumerate(lines[:MOST_BREAKS], start=1):
        quotes += line.count(b'"')
        if quotes % 2 == 0:
            joined = b" ".join(line.strip() for line in lines[:count])
            return joined + b"\n" * count + data[sum(map(len, lines[:count])) + count :]
    return data


def content(data: bytes, layout: Layout | None = None) -> Iterator[tuple[int, bytes]]:
    """Return the lines that say something, with their number in the file, counted from 1.

    Parameters
    ----------
    data : bytes
    layout : Layout, optional
        Without it, what lies before the samples belongs to the lines too.
    """
    # Tabs are not stripped: a line of them is a row of empty cells, which must not go unnoticed.
    lines = lines_of(data)
    begin = 0 if layout is None else layout.skipped
    if layout is not None and layout.ends_at_blank:
        end = next((i for i, line in enumerate(lines[begin:]) if not line.strip(b" ,;\t")), len(lines))
        lines = lines[: begin + end]
    return (
        (number, line)
        for number, line in enumerate(islice(lines, begin, None), start=begin + 1)
        if line.strip(b" ") and not line.lstrip().startswith(COMMENTS)
    )


def split_line(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line. Raises `csv.Error` for a cell that is too long."""
    if delimiter == " " and '"' not in line:
        return line.split()
    line = " ".join(line.split()) if delimiter == " " else line
    return next(csv.reader([line], delimiter=delimiter), [])


def is_number(cell: str) -> bool:
    """Whether a cell is a number, with a point or a comma."""
    return NUMBER.fullmatch(cell) is not None or NUMBER.fullmatch(cell.replace(",", ".")) is not None


def is_value(cell: str) -> bool:
    """Whether a cell is a number, or true or false."""
    return is_number(cell) or FLAG.fullmatch(cell.strip()) is not None
