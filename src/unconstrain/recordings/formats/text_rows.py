"""Which lines of a text are samples: not those where a logger began anew or broke off, nor what stands below."""

import csv
from bisect import bisect_left
from dataclasses import dataclass

from unconstrain.recordings.formats.text_lines import (
    COMMENTS,
    Layout,
    content,
    is_number,
    lines_of,
    split_line,
)
from unconstrain.recordings.formats.text_numbers import MISSING

FEWEST = 5
"""Samples that a table must have for lines below it to be taken for something else."""

LONGEST_FOOTER = 20
"""Lines below a table."""

FEWEST_DIGITS = 2
"""Digits behind the points of all numbers by which one that lacks some is told to be cut."""

PROBED = 20
"""Lines by which others are judged."""


@dataclass(frozen=True)
class Rows:
    """The samples of a text.

    Parameters
    ----------
    lines : list of bytes
    numbers : list of int
        Of each line in the file, counted from 1.
    begins : tuple of int
        The samples before which the header comes again.
    notes : tuple of str
        What was left out.
    """

    lines: list[bytes]
    numbers: list[int]
    begins: tuple[int, ...]
    notes: tuple[str, ...]


def find_rows(data: bytes, layout: Layout) -> Rows:
    """Find the samples of a text.

    Parameters
    ----------
    data : bytes
        The whole text, in UTF-8.
    layout : Layout

    Returns
    -------
    Rows
    """
    entries = list(content(data, layout))
    notes: list[str] = []
    if b"\0" in data:
        whole = [entry for entry in entries if b"\0" not in entry[1]]
        left = len(entries) - len(whole)
        entries = whole
        if left:
            lines = "line" if left == 1 else "lines"
            notes.append(
                f"left out {left} {lines} with bytes that are zero, as a logger that crashed leaves them"
            )
    entries, begins = _without_headings(data, entries, layout, notes)
    if len(entries) >= FEWEST and begins[-1:] != [len(entries)]:
        leave_out_end(data, entries, layout, notes)
    return Rows(
        [line for _, line in entries],
        [number for number, _ in entries],
        tuple(begin for begin in begins if 0 < begin < len(entries)),
        tuple(notes),
    )


def leave_out_end(data: bytes, entries: list[tuple[int, bytes]], layout: Layout, notes: list[str]) -> None:
    """Leave out lines below the table, or a last line that was cut, and note it.

    Parameters
    ----------
    data : bytes
        The text, or its end.
    entries : list of (int, bytes)
        Its lines with their numbers, from which those at the end are taken. Only the first and the last ones matter.
    layout : Layout
    notes : list of str
        To which notes are added.
    """
    count = len(entries)
    _leave_out_footer(entries, layout, notes)
    if len(entries) == count:
        _leave_out_half(data, entries, layout, notes)


def begins_anew(data: bytes, layout: Layout) -> bool:
    """Whether the header of a text comes again in it."""
    if not layout.heading or data.count(layout.heading[0]) < 2:
        return False
    return bool(find_rows(data, layout).begins)


def _without_headings(
    data: bytes, entries: list[tuple[int, bytes]], layout: Layout, notes: list[str]
) -> tuple[list[tuple[int, bytes]], list[int]]:
    """Leave out headers that come again, with the titles above them; return what is left, and where they were."""
    if not layout.heading or data.count(layout.heading[0]) < 2:
        return entries, []
    if layout.heading[0].startswith(COMMENTS):
        lines = [i for i, line in enumerate(lines_of(data), start=1) if line.strip() == layout.heading[0]]
        begins = [bisect_left([number for number, _ in entries], number) for number in lines]
        _note_again(lines[1:], begins[1:], len(entries), notes)
        return entries, begins
    heading = set(layout.heading)
    kept: list[tuple[int, bytes]] = []
    begins, lines = [], []
    for number, line in entries:
        if line.strip() not in heading:
            kept.append((number, line))
            continue
        if line.strip() != layout.heading[0]:
            continue
        lines.append(number)
        while kept and (not begins or len(kept) > begins[-1]) and _is_title(kept[-1][1], layout):
            kept.pop()
        begins.append(len(kept))
    _note_again(lines, begins, len(kept), notes)
    return kept, begins


def _note_again(lines: list[int], begins: list[int], count: int, notes: list[str]) -> None:
    """Note where the header comes again, if samples lie before and after it."""
    if any(0 < begin < count for begin in begins):
        shown = ", ".join(map(str, lines[:3])) + (f" and {len(lines) - 3} more" if len(lines) > 3 else "")
        notes.append(
            f"the header comes again at line {shown}, and what follows is taken for another episode; episode= "
            "names another column"
        )


def _is_title(line: bytes, layout: Layout) -> bool:
    cells = [cell.strip() for cell in _cells(line, layout)]
    return not cells or cells[0][:1].isalpha() or cells[0].startswith("*") or not any(map(is_number, cells))


def _leave_out_half(data: bytes, entries: list[tuple[int, bytes]], layout: Layout, notes: list[str]) -> None:
    """Leave out a last line that was cut while it was written."""
    if data.rstrip(b"\0")[-1:] in (b"\n", b"\r"):
        return
    number, line = entries[-1]
    own = _cells(line, layout)
    before = [_cells(other, layout) for _, other in entries[-PROBED:-1]]
    is_short = len(own) < layout.width and not layout.is_padded
    if len(own) == layout.width and all(len(cells) == layout.width for cells in before):
        is_short = _is_cut(own[-1].strip(), [cells[-1].strip() for cells in before])
    if is_short:
        entries.pop()
        notes.append(f"the last line, {number}, is cut off, and left out")


def _is_cut(last: str, above: list[str]) -> bool:
    """Whether the last cell of a text lacks its end, since all cells above it are longer numbers."""
    if not last:
        return all(above)
    if last in ("-", "+") or (last.endswith(".") and not any(cell.endswith(".") for cell in above)):
        return all(map(is_number, above))
    digits = {_decimals(cell) for cell in above}
    # With fewer digits it is not told from a whole number.
    return len(digits) == 1 and min(digits) >= FEWEST_DIGITS and -1 < _decimals(last) < min(digits)


def _leave_out_footer(entries: list[tuple[int, bytes]], layout: Layout, notes: list[str]) -> None:
    """Leave out lines below the table that say something of it."""
    probe = [_cells(line, layout) for _, line in entries[:PROBED]]
    # Labels of episodes may be words in the last lines alone.
    numbered = all(cells and cells[0].strip(" +-.\"'")[:1].isdigit() for cells in probe)
    kept = len(entries)
    while kept > max(FEWEST, len(entries) - LONGEST_FOOTER):
        cells = _cells(entries[kept - 1][1], layout)
        filled = [cell.strip() for cell in cells if cell.strip()]
        first = cells[0].strip() if cells else ""
        is_word = any(map(str.isalpha, first)) and not is_number(first) and first.lower() not in MISSING
        alone = len(filled) == 1 and layout.width > 1 and is_word
        foreign = is_word and len(cells) != layout.width and not layout.is_padded
        if not (alone or foreign or (numbered and is_word and not any(c.isdigit() for c in first))):
            break
        kept -= 1
    if kept < len(entries):
        top, bottom = entries[kept][0], entries[-1][0]
        which = f"line {top} is" if top == bottom else f"lines {top} to {bottom} are"
        said = " ".join(entries[kept][1].decode(errors="replace").split())
        notes.append(f"{which} taken for a footer and left out: {said:.40}")
        del entries[kept:]


def _decimals(cell: str) -> int:
    """Return how many digits a number has after its point or comma; -1 where it is no plain number."""
    cell = cell.strip().replace(",", ".")
    whole, _, rest = cell.partition(".")
    return len(rest) if whole.lstrip("+-").isdigit() and (rest.isdigit() or not rest) else -1


def _cells(line: bytes, layout: Layout) -> list[str]:
    try:
        return split_line(line.decode(errors="replace"), layout.delimiter)
    except csv.Error:
        return []
