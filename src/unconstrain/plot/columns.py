"""What the numbers of a state are: names with units, which action is whose velocity, which of them share a scale."""

from collections.abc import Sequence

import numpy as np

from unconstrain.demonstrations import Demonstrations
from unconstrain.recordings.units import unit_in
from unconstrain.spaces import Phased, Product, Space
from unconstrain.spaces.vector import Vector

MOST_UNEQUAL = 20.0
"""Where one extent is so many times the other, axes of one scale would make a line of the picture."""


def find_velocities(space: Space, d: int) -> list[int | None]:
    """Find which action is the velocity of each number of a state.

    Parameters
    ----------
    space : Space
        What states are.
    d : int
        How many actions there are.

    Returns
    -------
    list of int or None
        A column of the actions for each of the n numbers; None for one without: a quaternion turns at an angular
        velocity, which is not the derivative of its numbers, and a phase goes by the clock.
    """
    if space.n_actions != d:
        return [None] * space.n_states
    if isinstance(space, Vector):
        return list(range(d))
    if isinstance(space, Phased):
        return [*find_velocities(space.of, d), None]
    found: list[int | None] = [None] * space.n_states
    if isinstance(space, Product):
        begin = 0
        for part, own in zip(space.parts, space.columns, strict=True):
            for column, velocity in zip(own, find_velocities(part, part.n_actions), strict=True):
                found[column] = None if velocity is None else begin + velocity
            begin += part.n_actions
    return found


def name_columns(demos: Demonstrations) -> list[str]:
    """Name the states, with "(rad)" or "(deg)" behind those that are angles and do not say so themselves.

    Parameters
    ----------
    demos : Demonstrations
        Whose states they are.

    Returns
    -------
    list of str
        A name for each state.
    """
    return [
        name if unit == "" or unit_in(name) else f"{name} ({unit})"
        for name, unit in zip(demos.state_names, _units(demos), strict=True)
    ]


def unit_of_speed(demos: Demonstrations, coordinates: Sequence[int]) -> str:
    """Return the unit of the velocities of some states, where it is one and known, else "".

    Parameters
    ----------
    demos : Demonstrations
        Whose states they are.
    coordinates : sequence of int
        Which of them.

    Returns
    -------
    str
        Such as "m/s".
    """
    units = {_units(demos)[i] for i in coordinates}
    return f"{units.pop()}/s" if len(units) == 1 and "" not in units else ""


def share_scale(demos: Demonstrations, coordinates: Sequence[int]) -> bool:
    """Whether states are drawn to one scale: they have one unit, and extents that are not very different.

    Parameters
    ----------
    demos : Demonstrations
        Whose states they are.
    coordinates : sequence of int
        Which of them.

    Returns
    -------
    bool
        False where a picture to one scale would mix units, or be no more than a line.
    """
    units = {_units(demos)[i] for i in coordinates}
    extents = np.ptp(demos.states[:, list(coordinates)], axis=0)
    extents = extents[extents > 0]
    return len(units) == 1 and (not len(extents) or extents.max() < MOST_UNEQUAL * extents.min())


def _units(demos: Demonstrations) -> list[str]:
    """Return the unit of each state: as its name has it, or as its space does for angles, else ""."""
    known = demos.space.units
    found = []
    for name, column in zip(
        demos.state_names, find_velocities(demos.space, demos.space.n_actions), strict=True
    ):
        own = "" if column is None else known[column]
        found.append(unit_in(name) or ("" if own == "1" else own))
    return found
