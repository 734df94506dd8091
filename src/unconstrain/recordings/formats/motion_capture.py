"""Text that motion capture programs export: Vicon Nexus and OptiTrack Motive, with their header blocks."""

import csv
from collections.abc import Sequence

from unconstrain.recordings.formats.base import note_part
from unconstrain.recordings.formats.text_lines import NUMBER, Layout, split_line
from unconstrain.recordings.formats.text_made import FrameTime, Made
from unconstrain.recordings.units import plain_unit

WANTED = "Trajectories"
"""The part of a Vicon export that holds where markers are."""

LARGEST_HEADER = 40
"""Lines among which the names of columns stand."""


def sections(lines: Sequence[str]) -> tuple[str, ...]:
    """Return the titles of the parts of an export of Vicon Nexus; none where another program wrote the text.

    Parameters
    ----------
    lines : sequence of str

    Returns
    -------
    tuple of str
    """
    heads = _heads(lines)
    return tuple(_title(lines, i) for i in heads) if heads and heads[0] <= LARGEST_HEADER else ()


def find_vicon(lines: Sequence[str], part: str | None = None) -> Layout | None:
    """Find the layout of an export of Vicon Nexus.

    Each part of it has a title, the rate (Hz), the names of markers or devices, the names of their components, units,
    and samples up to an empty line. Frames are numbered; the time is made of them and the rate.

    Parameters
    ----------
    lines : sequence of str
    part : str, optional
        The title of the part that is read, in whatever case; by default the trajectories, or else the first.

    Returns
    -------
    Layout or None
        None where another program wrote the text, or there is no such part.
    """
    titles = sections(lines)
    if not titles:
        return None
    heads = _heads(lines)
    wanted = [title for title in titles if title.lower() == (part or WANTED).lower()]
    if part is not None and not wanted:
        return None
    chosen = titles.index(wanted[0]) if wanted else 0
    at = heads[chosen]
    delimiter = next((mark for mark in "\t;," if mark in lines[at]), ",")
    try:
        rate, named, called, units = (
            split_line(line, delimiter) for line in (*lines[at - 2 : at + 1], *lines[at + 1 : at + 2])
        )
        per_second = float(rate[0].replace(",", "."))
    except (ValueError, IndexError, csv.Error):
        return None
    if not per_second > 0:
        return None
    width = max(len(called), len(units))
    called, named = (row[:width] + [""] * (width - len(row)) for row in (called, named))
    names = ["Frame", "Sub Frame"]
    owner = ""
    for name, component in zip(named[2:], called[2:], strict=True):
        owner = name.strip() or owner
        names.append(_join(owner, component.strip()))
    has_units = not any(NUMBER.fullmatch(cell) for cell in units)
    notes = [f"time is made of the frame numbers and the rate of the header, {per_second:g} Hz"]
    if len(titles) > 1 and part is None:
        notes.append(note_part(titles[chosen], titles))
    own = [plain_unit(cell) for cell in units] if has_units else []
    own = (own + [""] * width)[:width]
    return Layout(
        delimiter, width, (*names, "time"), (*range(width), FrameTime(0, 1, per_second)), at + 1 + has_units,
        tuple(notes), (*own, "s"), is_padded=True, ends_at_blank=True,
    )  # fmt: skip


def find_motive(lines: Sequence[str]) -> Layout | None:
    """Find the layout of an export of OptiTrack Motive.

    Its first line describes the recording. Later ones name the type, the body or marker, and what of it each column
    is. A position is called `NAME.X`, a quaternion `NAME.QX`, and Euler angles `NAME.RX`.

    Parameters
    ----------
    lines : sequence of str

    Returns
    -------
    Layout or None
        None where another program wrote the text.
    """
    if not lines or not lines[0].lstrip('"').startswith("Format Version"):
        return None
    try:
        about = split_line(lines[0], ",")
        said = dict(zip(about[::2], about[1::2], strict=False))
        rows = [split_line(line, ",") for line in lines[:LARGEST_HEADER]]
    except csv.Error:
        return None
    at = next((i for i, row in enumerate(rows) if i > 2 and row[:1] == ["Frame"]), None)
    if at is None:
        return None
    width = max(map(len, rows[at - 1 : at + 1]))

    def cells(row: Sequence[str]) -> list[str]:
        return [cell.strip() for cell in row] + [""] * (width - len(row))

    named = next((cells(row) for row in rows[1:at] if row[1:2] == ["Name"]), None)
    kinds, axes = cells(rows[at - 1]), cells(rows[at])
    if named is None:
        return None
    letter = {"Rotation": "Q" if said.get("Rotation Type", "Quaternion") == "Quaternion" else "R"}
    names = ["Frame"]
    for name, kind, axis in zip(named[1:], kinds[1:], axes[1:], strict=True):
        own = letter.get(kind, "") + axis if axis else kind
        names.append(_join(name, own) if name and name != "Name" else axis)
    lengths, angle = plain_unit(said.get("Length Units", "")), "" if letter["Rotation"] == "Q" else "deg"
    of_kind = {
        "Position": lengths,
        "Rotation": angle,
        "Mean Marker Error": lengths,
        "Error Per Marker": lengths,
    }
    units = ["", *(of_kind.get(kind, "") for kind in kinds[1:])]
    notes = []
    if angle:
        notes.append(f"rotations are Euler angles in the order {said['Rotation Type']}, as the header says")
    columns: tuple[int | Made, ...] = tuple(range(width))
    rate = said.get("Export Frame Rate") or said.get("Capture Frame Rate") or ""
    if not any(name.startswith("Time") for name in names) and NUMBER.fullmatch(rate) and float(rate) > 0:
        names, columns = [*names, "time"], (*columns, FrameTime(0, None, float(rate)))
        units.append("s")
        notes.append(f"time is made of the frame numbers and the rate of the header, {float(rate):g} Hz")
    return Layout(",", width, tuple(names), columns, at + 1, tuple(notes), tuple(units), is_padded=True)


def _heads(lines: Sequence[str]) -> list[int]:
    """Return the lines that name the columns of a part."""
    return [i for i, line in enumerate(lines) if i > 2 and _bare(line).startswith("framesubframe")]


def _title(lines: Sequence[str], head: int) -> str:
    return lines[head - 3].strip(' ",;\t')


def _bare(line: str) -> str:
    return line[:40].translate(_NOTHING).lower()


_NOTHING = str.maketrans("", "", ' ",;\t')


def _join(owner: str, component: str) -> str:
    return f"{owner}.{component}" if owner and component else owner or component
