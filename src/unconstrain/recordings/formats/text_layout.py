"""How a text table is laid out: what separates its cells, where it begins, and what its columns are called."""

import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice, pairwise

from unconstrain.errors import DataError
from unconstrain.recordings.formats.text_encoding import BOM

NUMBER = re.compile(r"\s*([+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf|infinity))\s*", re.IGNORECASE)
FLAG = re.compile(r"true|false", re.IGNORECASE)
SEPARATOR = re.compile(r'"?sep=(.)"?\s*', re.IGNORECASE)
UNIT = re.compile(
    r"[\[(<{]?\s*(-|[nuµm]?s|secs?|seconds?|[ckmuµ]?m|met(re|er)s?|inch|rad|radians?|deg|degrees?|°|[kmM]?N|N\s?[·*.]?\s?m+|"
    r"Hz|V|A|mA|%|(m|mm|cm|rad|deg|°)/s(\^?[2²])?)\s*[\])>}]?"
)
COMMENTS = (b"#", b"%", b"//")
PROBED = 20
"""Lines looked at to find what separates cells."""

SEARCHED = 200
"""Lines among which a table begins."""

YEARS = range(1900, 2101)


@dataclass(frozen=True)
class FrameTime:
    """Where the time of rows comes from that are numbered: the cell of the number, and how many there are a second.

    Parameters
    ----------
    frame : int
        Which cell holds the number of the frame, from 1.
    sub : int or None
        Which cell holds the number within the frame, from 0.
    rate : float
        Rows a second (Hz).
    """

    frame: int
    sub: int | None
    rate: float


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
    cells : tuple of int or None
        Which cell of a line each column is; None for the time that `time` tells.
    skipped : int
        Lines of the file before the first sample.
    notes : tuple of str
        What was guessed, or what the file says of itself.
    time : FrameTime, optional
    is_padded : bool
        Whether lines may lack separators at their ends, or have too many.
    ends_at_blank : bool
        Whether an empty line ends the table.
    """

    delimiter: str
    width: int
    names: tuple[str, ...]
    cells: tuple[int | None, ...]
    skipped: int
    notes: tuple[str, ...] = ()
    time: FrameTime | None = None
    is_padded: bool = False
    ends_at_blank: bool = False


def lines_of(data: bytes) -> list[bytes]:
    """Return the lines of a text."""
    return data.removeprefix(BOM).replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")


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
    return line.split() if delimiter == " " else next(csv.reader([line], delimiter=delimiter), [])


def find_layout(data: bytes, shown: str) -> Layout:
    """Find out how a table is written.

    Parameters
    ----------
    data : bytes
        Its first lines, in UTF-8.
    shown : str
        The file, as the user calls it.

    Returns
    -------
    Layout

    Raises
    ------
    DataError
        It has no samples, or cannot be split into cells.
    """
    lines = [(number, line.decode()) for number, line in islice(content(data), SEARCHED)]
    if not lines:
        raise DataError(f"{shown} is empty: there is nothing to read")
    notes: list[str] = []
    try:
        given = SEPARATOR.fullmatch(lines[0][1])
        if given and len(lines) > 1:
            lines = lines[1:]
        probe = [line for _, line in lines[:PROBED]]
        delimiter = given[1] if given else _delimiter(probe)
        rows = [split_line(line, delimiter) for line in probe]
        begin = _count_titles(rows)
        every = probe if len(rows[0]) > 1 else [line for _, line in lines]
        if not begin and len({len(split_line(line, delimiter)) for line in every}) > 1:
            delimiter, begin = _find_begin([line for _, line in lines], delimiter, given is not None)
        if begin:
            first, last = lines[0][0], lines[begin - 1][0]
            which = f"line {last} is" if begin == 1 else f"lines {first} to {last} are"
            notes.append(f"{which} taken for a title, since the table begins after, and left out")
            lines = lines[begin:]
        rows = [split_line(line, delimiter) for _, line in lines[:PROBED]]
    except csv.Error as error:
        raise DataError(f"{shown} cannot be read as a text table ({error})") from error
    numbered = _is_numbered_header(rows)
    headed = numbered or _is_header(rows)
    if len(lines) == headed:
        raise DataError(f"{shown} has a header but no samples")
    if numbered:
        shortly = ", ".join(cell.strip() for cell in rows[0][:4]) + (", ..." if len(rows[0]) > 4 else "")
        notes.append(f"the numbers {shortly} in line {lines[0][0]} are taken for the names of the columns")
    skipped = lines[0][0] if headed else lines[0][0] - 1
    names = [name.strip() for name in rows[0]] if headed else None
    body = rows[headed:]
    if headed and len(body) > 1 and _are_units(*body[:2]):
        units = dict.fromkeys(unit for cell in body[0] if (unit := cell.strip(" []()<>{}")))
        notes.append(f"line {lines[1][0]} holds units, which are not converted: {', '.join(units)}")
        skipped, body = lines[1][0], body[1:]
    width = len(body[0])
    if names is None:
        names = _header_in_comment(data, delimiter, width) or [""] * width
    ends = all(len(row) == width and not row[-1].strip() for row in body)
    if width > 1 and ends and (len(names) == width - 1 or not names[-1]):
        names = names[: width - 1]  # every line ends with a separator
    elif len(names) == width + 1 and not names[-1]:
        names = names[:width]
    elif len(names) != width:
        width = len(names)
    cells = list(range(len(names)))
    if headed and _counts_rows(names, body):
        notes.append(
            "the first column, which has no name and counts the rows, is left out: name it if it is needed"
        )
        names, cells = names[1:], cells[1:]
    return Layout(delimiter, width, tuple(names), tuple(cells), skipped, tuple(notes))


def _count_titles(rows: list[list[str]]) -> int:
    """Count the lines before the table that have as many cells: those that a spreadsheet filled up, among others."""
    if len({len(row) for row in rows}) > 1:
        return 0
    width = len(rows[0])

    def is_sparse(row: list[str]) -> bool:
        filled = [cell for cell in row if cell.strip()]
        few = len(filled) <= (2 if width > 3 else 1) and width > 2
        return few and not (filled and _is_number(filled[0]))

    begin = next((i for i, row in enumerate(rows) if not is_sparse(row)), 0)
    if begin:
        return begin if begin < len(rows) - 1 else 0
    # Pairs of a name and a value above a table of two columns.
    words = next((i for i, row in enumerate(rows) if row and _is_value(row[0])), 0)
    if width != 2 or words < 2 or any(not cell.strip() or _is_value(cell) for cell in rows[words - 1]):
        return 0
    return words - 1 if any(_is_value(row[1]) for row in rows[: words - 1]) else 0


def _find_begin(lines: list[str], delimiter: str, given: bool) -> tuple[str, int]:
    """Find the line with which a table begins that has others before it, and its delimiter."""
    best = (0, 0, delimiter, 0)
    for mark in [delimiter] if given else ["\t", ";", ",", " "]:
        rows = [split_line(line, mark) for line in lines]
        lengths = [len(row) for row in rows]
        width = max((n for n in lengths if n > 1), key=lambda n: (lengths.count(n), n), default=0)
        alike = [row for row in rows if len(row) == width]
        if not width or not any(map(_is_number, alike[-1])):
            continue
        if mark == " " and not all(_is_number(cell) or FLAG.fullmatch(cell) for cell in alike[-1]):
            continue
        begin = next((i for i, both in enumerate(pairwise(lengths)) if both == (width, width)), 0)
        if begin and not alike[-1][-1].strip() and len(rows[begin - 1]) == width - 1:
            begin -= 1  # lines end with a separator, the header does not
        if begin and len(rows[begin - 1]) == width + 1 and not rows[begin - 1][-1].strip():
            begin -= 1  # the other way round
        before = rows[:begin]
        if any(len(row) > 1 and all(map(_is_number, row)) for row in before):
            continue  # samples of another length, which is a mistake to be told
        # A short line above samples without names may be a header that another mistake cut short.
        last = len(before[-1]) if before else 0
        is_prose = (last == 1 if mark != " " else abs(last - width) > 1) and len(lines[begin - 1].split()) > 1
        if before and not is_prose and not _is_header(rows[begin:]):
            continue
        best = max(best, (len(alike), width, mark, begin), key=lambda found: found[:2])
    length, _, mark, begin = best
    return (mark, begin) if length > 1 else (delimiter, 0)


def _delimiter(probe: list[str]) -> str:
    # Comma comes last, as it may be the decimal mark of a table delimited otherwise.
    counts = {mark: [len(split_line(line, mark)) for line in probe] for mark in "\t;,"}
    for mark, count in counts.items():
        if min(count) == max(count) > 1:
            return " " if mark == "," and _has_commas_in_numbers(probe) else mark
    if _has_commas_in_numbers(probe):
        return " "
    if any(max(count) > 1 for count in counts.values()):
        return max(counts, key=lambda mark: sum(counts[mark]))
    cells = probe[-1].split()
    if len(cells) > 1 and all(NUMBER.fullmatch(cell) or FLAG.fullmatch(cell) for cell in cells):
        return " "
    widths = {len(line.split()) for line in probe}
    # Words beside numbers, such as the name of an episode.
    if len(widths) == 1 and sum(NUMBER.fullmatch(cell) is not None for cell in cells) > 1:
        return " "
    return ","


def _has_commas_in_numbers(probe: list[str]) -> bool:
    """Whether spaces separate numbers that have a comma."""
    cells = probe[-1].split()
    return (
        len(cells) > 1
        and all(_is_number(cell) or FLAG.fullmatch(cell) for cell in cells)
        and any("," in cell for cell in cells)
        and '"' not in probe[-1]
        and "\t" not in probe[-1]
    )


def _is_header(rows: list[list[str]]) -> bool:
    first = [cell.strip() for cell in rows[0]]
    numeric = [cell for cell in first if _is_number(cell)]
    if not numeric:
        return True
    if len(rows) < 2:
        return False
    # Unnamed columns are written by pandas as 0, 1, 2, ..., and its index as an empty name before them.
    numbered = numeric in ([str(i) for i in range(len(numeric))], [str(i + 1) for i in range(len(numeric))])
    if numbered and len(numeric) < len(first) and all(map(_is_number, rows[1])):
        return True
    # A word above numbers is a name, and so are the years beside it.
    words = [i for i, cell in enumerate(first) if cell and not _is_number(cell)]
    below = [row for row in rows[1:] if len(row) == len(first)]
    return (
        _are_years(numeric) and any(all(_is_number(row[i]) for row in below) for i in words) and bool(below)
    )


def _is_numbered_header(rows: list[list[str]]) -> bool:
    """Whether the first line, all of whose cells are numbers, names columns nevertheless."""
    first, below = [cell.strip() for cell in rows[0]], rows[1:]
    if len(first) < 2 or not below or not all(cell.isdecimal() for cell in first):
        return False
    others = [cell.strip() for row in below for cell in row]
    if first == [str(i) for i in range(len(first))]:
        return len(first) > 2 or not any(re.fullmatch(r"[+-]?\d+", cell) for cell in others)
    return _are_years(first) and not any(cell.isdecimal() and int(cell) in YEARS for cell in others)


def _are_years(cells: list[str]) -> bool:
    if not all(cell.isdecimal() and len(cell) == 4 and int(cell) in YEARS for cell in cells):
        return False
    steps = {int(b) - int(a) for a, b in pairwise(cells)}
    return len(steps) < 2 and 0 not in steps


def _are_units(row: list[str], following: list[str]) -> bool:
    cells = [cell.strip() for cell in row]
    return (
        any(cells)
        and all(not cell or UNIT.fullmatch(cell) for cell in cells)
        # Letters above letters may be the names of episodes.
        and all(not cell or re.search(r"\d", below) for cell, below in zip(cells, following, strict=False))
    )


def _counts_rows(names: list[str], body: list[list[str]]) -> bool:
    if len(names) < 2 or names[0] or not all(names[1:]) or len(body) < 2:
        return False
    return [row[0].strip() if row else "" for row in body] == [str(i) for i in range(len(body))]


def _is_number(cell: str) -> bool:
    return NUMBER.fullmatch(cell) is not None or NUMBER.fullmatch(cell.replace(",", ".")) is not None


def _is_value(cell: str) -> bool:
    return _is_number(cell) or FLAG.fullmatch(cell.strip()) is not None


def _header_in_comment(data: bytes, delimiter: str, width: int) -> list[str] | None:
    header = b""
    for line in lines_of(data):
        if line.lstrip().startswith(COMMENTS):
            header = line
        elif line.strip():
            break
    text = header.decode().lstrip(" #%/")
    names = text.split() if delimiter == " " else [name.strip() for name in text.split(delimiter)]
    if len(names) != width and delimiter == " ":
        names = [name.strip() for name in text.split(",")]
    return names if len(names) == width > 1 and not any(map(_is_number, names)) else None
