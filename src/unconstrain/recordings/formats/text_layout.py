"""How a text table is laid out: what separates its cells, where it begins, and what its columns are called."""

import csv
import re
from collections.abc import Sequence
from itertools import islice, pairwise

from unconstrain.errors import DataError
from unconstrain.recordings.formats.text_header import (
    are_units,
    count_header,
    counts_rows,
    header_in_comment,
    is_counted,
    is_header,
    is_numbered_header,
    join_names,
)
from unconstrain.recordings.formats.text_lines import (
    FLAG,
    MARKS,
    NUMBER,
    Layout,
    content,
    is_number,
    is_value,
    lines_of,
    split_line,
)
from unconstrain.recordings.formats.text_made import JoinedTime, Made
from unconstrain.recordings.formats.text_stamps import make_time
from unconstrain.recordings.units import plain_unit

SEPARATOR = re.compile(r'"?sep=(.)"?\s*', re.IGNORECASE)
LIST = re.compile(r"[\[(]((?:\s*[+-]?[\d.]+(?:[eE][+-]?\d+)?[,\s]*){2,})[\])]")
PROBED = 20
"""Lines looked at to find what separates cells."""

SEARCHED = 200
"""Lines among which a table begins."""

TIME = "time"
"""What the time is called that is made."""


def find_layout(data: bytes, shown: str, beside: Sequence[str] = ()) -> Layout:
    """Find out how a table is written.

    Parameters
    ----------
    data : bytes
        Its first lines, in UTF-8.
    shown : str
        The file, as the user calls it.
    beside : sequence of str
        Lines from elsewhere that may tell the rate.

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
        lines, delimiter, lacks_name = _find_table(lines, notes)
        rows = [split_line(line, delimiter) for _, line in lines[:PROBED]]
    except csv.Error as error:
        raise DataError(f"{shown} cannot be read as a text table ({error})") from error
    numbered = is_numbered_header(rows)
    headed = 1 if numbered else count_header(rows) if is_header(rows) else 0
    if len(lines) <= headed:
        raise DataError(f"{shown} has a header but no samples")
    if numbered:
        shortly = ", ".join(cell.strip() for cell in rows[0][:4]) + (", ..." if len(rows[0]) > 4 else "")
        notes.append(f"the numbers {shortly} in line {lines[0][0]} are taken for the names of the columns")
    skipped = lines[headed - 1][0] if headed else lines[0][0] - 1
    body = rows[headed:]
    names, units = _name(rows[:headed], body, [number for number, _ in lines], notes)
    heading = () if lacks_name else tuple(line.strip().encode() for _, line in lines[:headed])
    if not headed:
        names, comment = header_in_comment(data, delimiter, len(body[0])) or ([""] * len(body[0]), b"")
        heading = (comment,) if comment else ()
    names, width = _fit(names, body)
    units = (units + [""] * len(names))[: len(names)]
    cells: list[int | Made] = list(range(len(names)))
    above = [*(line.decode() for line in lines_of(data)[:skipped]), *beside]
    made, note = make_time(names, body, above)
    if headed and counts_rows(names, body):
        notes.append(
            "the first column, which has no name and counts the rows, is left out: name it if it is needed"
        )
        names, units, cells = names[1:], units[1:], cells[1:]
    if isinstance(made, JoinedTime) and not any(names):
        names[made.seconds], names[made.rest] = "sec", "nanosec"
    notes += [note] if note else []
    if made is not None:
        names, units, cells = [*names, _unused(TIME, names)], [*units, ""], [*cells, made]
    widths = {
        i: own
        for i, cell in enumerate(cells)
        if isinstance(cell, int) and names[i] and (own := _list_width(body, cell))
    }
    return Layout(
        delimiter,
        width,
        tuple(names),
        tuple(cells),
        skipped,
        tuple(notes),
        tuple(units),
        heading=heading,
        widths=widths,
    )


def _find_table(lines: list[tuple[int, str]], notes: list[str]) -> tuple[list[tuple[int, str]], str, bool]:
    """Return the numbered lines of the table, what separates cells, and whether its first column lacked its name."""
    given = SEPARATOR.fullmatch(lines[0][1])
    if given and len(lines) > 1:
        lines = lines[1:]
    probe = [line for _, line in lines[:PROBED]]
    mark = None if given else _mark_of_row_names(probe)
    if mark is not None:
        probe[0] = f'""{mark}{probe[0]}'
        lines[0] = (lines[0][0], probe[0])
    delimiter = given[1] if given else mark or _delimiter(probe)
    rows = [split_line(line, delimiter) for line in probe]
    begin = _count_titles(rows)
    every = probe if len(rows[0]) > 1 else [line for _, line in lines]
    if not begin and len({len(split_line(line, delimiter)) for line in every}) > 1:
        delimiter, begin = _find_begin([line for _, line in lines], delimiter, given is not None)
    if begin:
        begin -= _names_bodies([split_line(line, delimiter) for _, line in lines[begin - 1 : begin + 2]])
    if begin:
        first, last = lines[0][0], lines[begin - 1][0]
        which = f"line {last} is" if begin == 1 else f"lines {first} to {last} are"
        notes.append(f"{which} taken for a title, since the table begins after, and left out")
        lines = lines[begin:]
    return lines, delimiter, mark is not None


def _fit(names: list[str], body: list[list[str]]) -> tuple[list[str], int]:
    """Return as many names as there are columns, and the number of cells in a line."""
    width = len(body[0])
    ends = all(len(row) == width and not row[-1].strip() for row in body)
    if width > 1 and ends and (len(names) == width - 1 or not names[-1]):
        return names[: width - 1], width  # every line ends with a separator
    if len(names) == width + 1 and not names[-1]:
        return names[:width], width
    return names, len(names)


def _name(
    header: list[list[str]], body: list[list[str]], numbers: list[int], notes: list[str]
) -> tuple[list[str], list[str]]:
    """Return the names that the lines of a header give, and the units."""
    if not header:
        return [], []
    at = next((i for i in range(1, len(header)) if are_units(header[i], body[0])), None)
    named = [row for i, row in enumerate(header) if i != at]
    names = (
        [name.strip() for name in named[0]]
        if len(named) == 1
        else join_names(named, is_index=is_counted(body))
    )
    if len(named) > 1:
        shown = ", ".join([name for name in names if name][:3])
        notes.append(
            f"lines {numbers[0]} to {numbers[len(header) - 1]} are taken for names in several lines: {shown}"
        )
    if at is None:
        return names, []
    units = [plain_unit(cell) for cell in header[at]]
    told = ", ".join(dict.fromkeys(unit for unit in units if unit))
    if told:
        notes.append(f"line {numbers[at]} is taken for units: {told}")
    return names, units


def _names_bodies(rows: list[list[str]]) -> bool:
    """Whether the line above the first of names tells of which body they are, as where cells were merged."""
    if len(rows) < 2 or len(rows[0]) != len(rows[1]):
        return False
    above, names = ([cell.strip() for cell in row] for row in rows[:2])
    filled = [cell for cell in above if cell]
    if (
        not filled
        or any(map(is_value, filled))
        or (len(filled) == 1 and above[0])
        or any(map(is_number, names))
    ):
        return False
    lacking = any(cell and not name for cell, name in zip(above, names, strict=True))
    own = [name for name in names if name]
    return lacking or len(set(own)) < len(own)


def _list_width(body: list[list[str]], cell: int) -> int:
    """Return how many numbers the cells of a column hold in brackets, as pandas writes arrays; 0 for none."""
    every = [found for row in body if (found := LIST.fullmatch(row[cell].strip() if cell < len(row) else ""))]
    lengths = {len(each[1].replace(",", " ").split()) for each in every}
    return lengths.pop() if len(every) == len(body) and len(lengths) == 1 else 0


def _mark_of_row_names(probe: list[str]) -> str | None:
    """Return what separates cells where the header lacks the name of the first column, as R writes it."""
    if len(probe) < 2 or not probe[0].startswith('"') or not probe[1].startswith('"'):
        return None
    for mark in (*MARKS, " "):
        header, *others = (split_line(line, mark) for line in probe)
        if len(header) > 1 and {len(row) for row in others} == {len(header) + 1}:
            return mark
    return None


def _unused(name: str, names: list[str]) -> str:
    """Return a name that no column has."""
    return name if name not in names else f"{name} (made)"


def _count_titles(rows: list[list[str]]) -> int:
    """Count the lines before the table that have as many cells: those that a spreadsheet filled up, among others."""
    if len({len(row) for row in rows}) > 1:
        return 0
    width = len(rows[0])

    def is_sparse(row: list[str]) -> bool:
        filled = [cell for cell in row if cell.strip()]
        few = len(filled) <= (2 if width > 3 else 1) and width > 2
        return few and not (filled and is_number(filled[0]))

    begin = next((i for i, row in enumerate(rows) if not is_sparse(row)), 0)
    if begin:
        return begin if begin < len(rows) - 1 else 0
    # Pairs of a name and a value above a table of two columns.
    words = next((i for i, row in enumerate(rows) if row and is_value(row[0])), 0)
    if width != 2 or words < 2 or any(not cell.strip() or is_value(cell) for cell in rows[words - 1]):
        return 0
    return words - 1 if any(is_value(row[1]) for row in rows[: words - 1]) else 0


def _find_begin(lines: list[str], delimiter: str, given: bool) -> tuple[str, int]:
    """Find the line with which a table begins that has others before it, and its delimiter."""
    best = (0, 0, delimiter, 0)
    for mark in [delimiter] if given else ["\t", ";", "|", ",", " "]:
        rows = [split_line(line, mark) for line in lines]
        lengths = [len(row) for row in rows]
        width = max((n for n in lengths if n > 1), key=lambda n: (lengths.count(n), n), default=0)
        alike = [row for row in rows if len(row) == width]
        if not width or not any(map(is_number, alike[-1])):
            continue
        if mark == " " and not all(is_number(cell) or FLAG.fullmatch(cell) for cell in alike[-1]):
            continue
        begin = next((i for i, both in enumerate(pairwise(lengths)) if both == (width, width)), 0)
        if begin and not alike[-1][-1].strip() and len(rows[begin - 1]) == width - 1:
            begin -= 1  # lines end with a separator, the header does not
        if begin and len(rows[begin - 1]) == width + 1 and not rows[begin - 1][-1].strip():
            begin -= 1  # the other way round
        before = rows[:begin]
        if any(len(row) > 1 and all(map(is_number, row)) for row in before):
            continue  # samples of another length, which is a mistake to be told
        # A short line above samples without names may be a header that another mistake cut short.
        last = len(before[-1]) if before else 0
        is_prose = (last == 1 if mark != " " else abs(last - width) > 1) and len(lines[begin - 1].split()) > 1
        if before and not is_prose and not is_header(rows[begin:]):
            continue
        best = max(best, (len(alike), width, mark, begin), key=lambda found: found[:2])
    length, _, mark, begin = best
    return (mark, begin) if length > 1 else (delimiter, 0)


def _delimiter(probe: list[str]) -> str:
    # Comma comes last, as it may be the decimal mark of a table delimited otherwise.
    counts = {mark: [len(split_line(line, mark)) for line in probe] for mark in MARKS}
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
        and all(is_number(cell) or FLAG.fullmatch(cell) for cell in cells)
        and any("," in cell for cell in cells)
        and '"' not in probe[-1]
        and "\t" not in probe[-1]
    )
