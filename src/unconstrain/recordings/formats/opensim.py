"""Text of OpenSim: `.trc` files of markers, and storage (`.mot`, `.sto`) of coordinates and forces."""

from collections.abc import Sequence

from unconstrain.recordings.formats.text_lines import Layout, split_line
from unconstrain.recordings.units import plain_unit

LARGEST_HEADER = 200
"""Lines among which the header ends."""


def find_trc(lines: Sequence[str]) -> Layout | None:
    """Find the layout of a file of markers, which has tabs between cells and three cells a marker.

    Parameters
    ----------
    lines : sequence of str

    Returns
    -------
    Layout or None
        None where the text is something else.
    """
    if len(lines) < 6 or not lines[0].startswith("PathFileType"):
        return None
    said = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=False))
    named, axes = lines[3].rstrip().split("\t"), lines[4].rstrip().split("\t")
    width = max(len(axes), len(named))
    names = ["Frame", "Time"]
    owner = ""
    for i in range(2, width):
        owner = (named[i].strip() if i < len(named) else "") or owner
        names.append(f"{owner}.{'XYZ'[(i - 2) % 3]}")
    unit = plain_unit(said.get("Units", ""))
    units = ("", "s", *[unit] * (width - 2))
    return Layout("\t", width, tuple(names), tuple(range(width)), 5, (), units, is_padded=True)


def find_storage(lines: Sequence[str]) -> Layout | None:
    """Find the layout of a storage file, whose names stand after a line `endheader`.

    Parameters
    ----------
    lines : sequence of str

    Returns
    -------
    Layout or None
        None where the text is something else.
    """
    header = [line.strip().lower() for line in lines[:LARGEST_HEADER]]
    if "endheader" not in header:
        return None
    at = next((i for i in range(header.index("endheader") + 1, len(header)) if header[i]), None)
    if at is None:
        return None
    delimiter = "\t" if "\t" in lines[at].strip() else " "
    names = [name.strip() for name in split_line(lines[at].strip(), delimiter)]
    said = dict(line.replace(" ", "").split("=", 1) for line in header[:at] if "=" in line)
    words = {"yes": "degrees", "no": "radians"}
    unit = words.get(said.get("indegrees", ""))
    notes = (f"angles are in {unit}, as the header says, and not converted",) if unit else ()
    return Layout(
        delimiter,
        len(names),
        tuple(names),
        tuple(range(len(names))),
        at + 1,
        notes,
        is_padded=delimiter == "\t",
    )
