"""Which cells of a text will be read, by the columns that are asked for."""

from collections.abc import Mapping
from dataclasses import dataclass

from unconstrain.errors import DataError
from unconstrain.recordings.columns import Keys
from unconstrain.recordings.formats.text_lines import Layout
from unconstrain.recordings.table import Header


@dataclass(frozen=True)
class Wanted:
    """Which cells of each line are read, counted from 0, and what for.

    Parameters
    ----------
    cells : tuple of int
    label : int or None
        The one that tells episodes apart, and is nothing else.
    time : int or None
        The one that holds stamps.
    """

    cells: tuple[int, ...]
    label: int | None = None
    time: int | None = None


def find_wanted(header: Header, layout: Layout, asked: Mapping[str, Keys]) -> Wanted:
    """Find the cells that will be read.

    Parameters
    ----------
    header : Header
        With a column for each of the layout's cells.
    layout : Layout
    asked : mapping of str to column, or list of columns
        By the role they play; all are read where none are asked for.

    Returns
    -------
    Wanted
        Without cells where columns are asked for that are not there, which is said where they are looked for.
    """
    try:
        roles = {role: header.find(role, keys) for role, keys in asked.items()}
    except DataError:
        return Wanted(())
    keys = [(column.part_of or column.name, column.nth) for column in header.columns]
    places = dict(zip(dict.fromkeys(keys), layout.cells, strict=True))
    own = {role: [places[field.key] for field in fields] for role, fields in roles.items()}
    made = [cell for cell in layout.cells if not isinstance(cell, int)]
    every = [cell for cells in (own.values() if own else [layout.cells]) for cell in (*cells, *made)]
    cells = [one for cell in every for one in ([cell] if isinstance(cell, int) else cell.needs)]
    label, time = (own.get(role, [None])[0] for role in ("episode", "time"))
    return Wanted(
        tuple(dict.fromkeys(cells)),
        label if isinstance(label, int) and cells.count(label) == 1 else None,
        time if isinstance(time, int) else None,
    )
