"""Text that LabVIEW writes as measurement files (.lvm): a header of the file, and one of each segment."""

from collections.abc import Sequence

from unconstrain.recordings.formats.text_lines import Layout, is_number
from unconstrain.recordings.formats.text_made import Made, RowTime
from unconstrain.recordings.units import plain_unit

END = "***End_of_Header***"
TIME = "X_Value"

LARGEST_HEADER = 200
"""Lines among which samples begin."""


def find_labview(lines: Sequence[str]) -> Layout | None:
    """Find the layout of a measurement file of LabVIEW.

    Where the time is left out, it is made of the step that the header of the segment tells. Another segment begins
    another episode.

    Parameters
    ----------
    lines : sequence of str

    Returns
    -------
    Layout or None
        None where another program wrote the text.
    """
    if not lines or not lines[0].startswith("LabVIEW Measurement"):
        return None
    ends = [i for i, line in enumerate(lines[:LARGEST_HEADER]) if line.startswith(END)]
    at = ends[min(1, len(ends) - 1)] + 1 if ends else len(lines)
    if at >= len(lines):
        return None
    head = {row[0]: row[1:] for line in lines[: at - 1] if len(row := line.split("\t")) > 1}
    marks = {"Tab": "\t", "Comma": ","}
    mark = marks.get(next(iter(head.get("Separator", ())), "Tab").strip(), "\t")
    names = [name.strip() for name in lines[at].split(mark)]
    if names[0] != TIME:
        return None
    width = len(names)
    columns: tuple[int | Made, ...] = tuple(range(width))
    units = ["s", *(plain_unit(unit) for unit in head.get("Y_Unit_Label", ()))]
    units = (units + [""] * width)[:width]
    notes = []
    step = next(iter(head.get("Delta_X", ())), "").strip()
    if next(iter(head.get("X_Columns", ())), "One").strip() == "No" and is_number(step):
        seconds = float(step.replace(",", "."))
        if seconds > 0:
            names, columns, units = names[1:], (*columns[1:], RowTime(1.0 / seconds)), [*units[1:], "s"]
            names.append("time")
            notes.append(f"time is made of the step of the header, {seconds:g} s")
    return Layout(
        mark, width, tuple(names), columns, at + 1, tuple(notes),
        tuple(units), is_padded=True, heading=(lines[at].strip().encode(),),
    )  # fmt: skip
