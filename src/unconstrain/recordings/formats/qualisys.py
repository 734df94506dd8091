"""Text that Qualisys Track Manager exports: a key and its values a line, then markers or bodies."""

from collections.abc import Sequence

from unconstrain.recordings.formats.text_lines import Layout, is_number
from unconstrain.recordings.formats.text_made import Made, RowTime

LARGEST_HEADER = 60
"""Lines among which samples begin."""

ANGLES = ("roll", "pitch", "yaw")


def find_qualisys(lines: Sequence[str]) -> Layout | None:
    """Find the layout of an export of Qualisys Track Manager, which has tabs between cells.

    Names may be left out, and are then those of the markers; so may the time, which is then made of the rate.

    Parameters
    ----------
    lines : sequence of str

    Returns
    -------
    Layout or None
        None where another program wrote the text.
    """
    if not lines or not lines[0].startswith("NO_OF_FRAMES\t"):
        return None
    rows = [line.rstrip("\t ").split("\t") for line in lines[:LARGEST_HEADER]]
    at = next((i for i, row in enumerate(rows) if all(map(is_number, row))), None)
    if at is None:
        return None
    said = {row[0]: row[1:] for row in rows[:at] if row[0].isupper()}
    above = rows[at - 1]
    owners = said.get("MARKER_NAMES") or said.get("BODY_NAMES") or []
    if above[0].isupper() and "_" in above[0]:
        axes = ("X", "Y", "Z") if "MARKER_NAMES" in said else ()
        names = [f"{owner} {axis}" for owner in owners for axis in axes]
        names += [""] * (len(rows[at]) - len(names))
    else:
        names = [name.strip() for name in above]
    if len(names) != len(rows[at]):
        return None
    names = _owned(names, owners) if "BODY_NAMES" in said else names
    units = [_unit(name) for name in names]
    columns: tuple[int | Made, ...] = tuple(range(len(names)))
    rate = next(iter(said.get("FREQUENCY", ())), "")
    notes = []
    if "Time" not in names and is_number(rate) and float(rate) > 0:
        names, columns, units = [*names, "time"], (*columns, RowTime(float(rate))), [*units, "s"]
        notes.append(f"time is made of the rate of the header, {float(rate):g} Hz")
    return Layout("\t", len(rows[at]), tuple(names), columns, at, tuple(notes), tuple(units), is_padded=True)


def _owned(names: Sequence[str], owners: Sequence[str]) -> list[str]:
    """Put the name of a body before all its columns; in the file it stands before the first of them."""
    owned, owner = [], ""
    for name in names:
        own = next((each for each in owners if name.startswith(f"{each} ")), None)
        owner = owner if own is None else own
        owned.append(name if own is not None or not owner or name in ("Frame", "Time") else f"{owner} {name}")
    return owned


def _unit(name: str) -> str:
    last = name.split(" ")[-1]
    if last == "Time":
        return "s"
    return "mm" if last in ("X", "Y", "Z") else "deg" if last.lower() in ANGLES else ""
