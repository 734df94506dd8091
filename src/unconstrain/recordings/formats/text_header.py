"""What the columns of a text table are called, and in which units they are."""

import re
from collections.abc import Sequence
from itertools import pairwise

from unconstrain.recordings.formats.text_lines import COMMENTS, is_number, lines_of
from unconstrain.recordings.formats.text_numbers import MISSING
from unconstrain.recordings.units import UNIT

BRACKETED = re.compile(r"\[[^\[\]]{0,12}\]|\([^()]{0,12}\)")

YEARS = range(1900, 2101)

FEWEST = 4
"""Lines, at least, by which further lines of names are told from samples."""


def is_header(rows: Sequence[Sequence[str]]) -> bool:
    """Whether the first line names the columns."""
    first = [cell.strip() for cell in rows[0]]
    numeric = [cell for cell in first if is_number(cell)]
    if not numeric:
        return True
    if len(rows) < 2:
        return False
    # Unnamed columns are written by pandas as 0, 1, 2, ..., and its index as an empty name before them.
    numbered = numeric in ([str(i) for i in range(len(numeric))], [str(i + 1) for i in range(len(numeric))])
    if numbered and len(numeric) < len(first) and all(map(is_number, rows[1])):
        return True
    # A word above numbers is a name, and so are the years beside it.
    words = [i for i, cell in enumerate(first) if cell and not is_number(cell)]
    below = [row for row in rows[1:] if len(row) == len(first)]
    return _are_years(numeric) and any(all(is_number(row[i]) for row in below) for i in words) and bool(below)


def is_numbered_header(rows: Sequence[Sequence[str]]) -> bool:
    """Whether the first line, all of whose cells are numbers, names columns nevertheless."""
    first, below = [cell.strip() for cell in rows[0]], rows[1:]
    if len(first) < 2 or not below or not all(cell.isdecimal() for cell in first):
        return False
    others = [cell.strip() for row in below for cell in row]
    if first == [str(i) for i in range(len(first))]:
        return len(first) > 2 or not any(re.fullmatch(r"[+-]?\d+", cell) for cell in others)
    return _are_years(first) and not any(cell.isdecimal() and int(cell) in YEARS for cell in others)


def count_header(rows: Sequence[Sequence[str]]) -> int:
    """Count the lines of names and units, of which the first is one: above columns of numbers they hold none."""
    width = len(rows[0])
    if len(rows) < FEWEST or any(len(row) != width for row in rows):
        return 1 + (len(rows) > 2 and are_units(rows[1], rows[2]))
    later = rows[len(rows) // 2 :]
    numeric = [i for i in range(width) if all(is_number(row[i]) for row in later)]

    def names(row: Sequence[str]) -> bool:
        filled = [row[i].strip() for i in numeric if row[i].strip()]
        return bool(filled) and not any(is_number(cell) or cell.lower() in MISSING for cell in filled)

    count = 1
    while count < len(rows) // 2 and (names(rows[count]) or are_units(rows[count], rows[count + 1])):
        count += 1
    return count


def are_units(row: Sequence[str], following: Sequence[str]) -> bool:
    """Whether a line holds the units of the columns."""
    cells = [cell.strip() for cell in row]
    filled = [cell for cell in cells if cell]
    known = all(UNIT.fullmatch(cell.strip("[]()<>{} ")) for cell in filled) or all(
        map(BRACKETED.fullmatch, filled)
    )
    # Letters above letters may be the names of episodes.
    return (
        bool(filled)
        and known
        and all(not cell or re.search(r"\d", below) for cell, below in zip(cells, following, strict=False))
    )


def join_names(rows: Sequence[Sequence[str]], *, is_index: bool) -> list[str]:
    """Join names that stand in several lines, as a body stands above its axes.

    A name holds for the empty cells after it, too. Of three lines or more, one that is the same in all columns is left
    out, and a line that names nothing but the first column is its name; so is the last one above a column that counts
    the rows.
    """
    lines = [[cell.strip() for cell in row] for row in rows]
    first = next((row[0] for row in reversed(lines) if row[0]), "")
    lines = [row for row in lines if any(row[1:])]
    parts: list[list[str]] = []
    for number, row in enumerate(lines):
        filled = row if number == len(lines) - 1 else _carried(row)
        if len(lines) < 3 or len(set(filled[1:])) > 1 or len(filled) < 3:
            parts.append(filled)
    joined = [".".join(filter(None, (part[i] for part in parts))) for i in range(len(rows[0]))]
    return [first if is_index or not joined[0] else joined[0], *joined[1:]]


def counts_rows(names: Sequence[str], body: Sequence[Sequence[str]]) -> bool:
    """Whether the first column has no name and counts the rows, as pandas and R write it."""
    return len(names) > 1 and not names[0] and all(names[1:]) and is_counted(body)


def is_counted(body: Sequence[Sequence[str]]) -> bool:
    """Whether the first cells of samples count them, from 0 or from 1."""
    if len(body) < 2:
        return False
    own = [row[0].strip() if row else "" for row in body]
    return own in ([str(i) for i in range(len(body))], [str(i + 1) for i in range(len(body))])


def header_in_comment(data: bytes, delimiter: str, width: int) -> tuple[list[str], bytes] | None:
    """Return the names in the last comment before the samples, where it has as many, and the comment."""
    header = b""
    for line in lines_of(data):
        if line.lstrip().startswith(COMMENTS):
            header = line.strip()
        elif line.strip():
            break
    text = header.decode().lstrip(" #%/")
    names = text.split() if delimiter == " " else [name.strip() for name in text.split(delimiter)]
    if len(names) != width and delimiter == " ":
        names = [name.strip() for name in text.split(",")]
    return (names, header) if len(names) == width > 1 and not any(map(is_number, names)) else None


def _carried(row: Sequence[str]) -> list[str]:
    """Return a line in which empty cells after the first hold what stands before them."""
    carried = [row[0]]
    held = ""
    for cell in row[1:]:
        held = cell or held
        carried.append(held)
    return carried


def _are_years(cells: Sequence[str]) -> bool:
    if not all(cell.isdecimal() and len(cell) == 4 and int(cell) in YEARS for cell in cells):
        return False
    steps = {int(b) - int(a) for a, b in pairwise(cells)}
    return len(steps) < 2 and 0 not in steps
