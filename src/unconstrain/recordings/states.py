"""What the states of a recording are: numbers, angles, rotations or poses, by what is given and by the first rows."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.recordings.angles import TURNS, find_turn
from unconstrain.recordings.notes import Note
from unconstrain.recordings.preparation import Preparation
from unconstrain.recordings.roles import Roles
from unconstrain.recordings.steps import runs
from unconstrain.spaces import Angle, Numbers, Pose, Product, Rotation, Space

Array = NDArray[np.float64]

# Numbers beyond this are no radians: no joint turns round twice, and rotations end at a whole turn.
LARGEST_RADIANS, LARGEST_OF_ROTATIONS = 4 * np.pi, 2.1 * np.pi

# Angular velocities are in the frame in which they differ from how states turn by less than this share, squared, if
# they differ by more in the other.
NEAR = 0.5

EULER = ("roll", "pitch", "yaw")


@dataclass(frozen=True)
class FirstRows:
    """The first rows of a recording, sorted by episode.

    Parameters
    ----------
    X : ndarray of shape (N, n)
        States.
    U : ndarray of shape (N, d) or None
        Recorded actions.
    codes : ndarray of shape (N,)
        Episodes, as numbers from 0.
    time : ndarray of shape (N,) or None
        Seconds.
    """

    X: Array
    U: Array | None
    codes: NDArray[np.int64]
    time: Array | None


def find_space(rows: FirstRows, roles: Roles, how: Preparation, shown: str) -> tuple[Space, tuple[Note, ...]]:
    """Find what the states are.

    Parameters
    ----------
    rows : FirstRows
        Of the recording.
    roles : Roles
        Which columns were given as angles and rotations.
    how : Preparation
        Which units and frames are given.
    shown : str
        The recording, as the user calls it.

    Returns
    -------
    Space
        Numbers, where nothing is given or recognised.
    tuple of Note
        What was guessed.

    Raises
    ------
    DataError
        Columns that are given as a rotation are none.
    """
    notes: list[Note] = []
    parts: list[tuple[Space, tuple[int, ...]]] = []
    for columns in roles.rotations:
        part, ordered, found = _find_rotation(rows, columns, roles.state_names, how, shown)
        parts.append((part, ordered))
        notes += found
    rotated = {i for columns in roles.rotations for i in columns}
    for i in range(len(roles.state)) if roles.angle is None else roles.angle:
        if i not in rotated:
            angle, found = _find_angle(rows, i, roles, how)
            parts += [(angle, (i,))] if angle is not None else []
            notes += found
    space = assemble(parts, roles.state_names)
    return space, tuple(notes)


def assemble(parts: Sequence[tuple[Space, tuple[int, ...]]], names: Sequence[str]) -> Space:
    """Make one space of parts, and of the numbers that are left.

    Parameters
    ----------
    parts : sequence of (Space, tuple of int)
        Angles and rotations, and which states each consists of.
    names : sequence of str
        Of the states. A rotation with x, y and z right before it is a pose.

    Returns
    -------
    Space
        Of all states.
    """
    if not parts:
        return Numbers(len(names))
    taken = {i for _, columns in parts for i in columns}
    every: list[tuple[Space, tuple[int, ...]]] = []
    for part, columns in parts:
        first = min(columns)
        before = tuple(range(first - 3, first))
        if isinstance(part, Rotation) and first >= 3 and not taken & set(before) and _are_axes(names, before):
            taken |= set(before)
            own = tuple(range(3, 3 + part.n_states))
            every.append((Pose((Numbers(3), part), ((0, 1, 2), own)), (*before, *columns)))
        else:
            every.append((part, columns))
    left = [i for i in range(len(names)) if i not in taken]
    for run in np.split(left, np.flatnonzero(np.diff(left) != 1) + 1) if left else []:
        every.append((Numbers(len(run)), tuple(int(i) for i in run)))
    every.sort(key=lambda each: min(each[1]))
    if len(every) == 1 and every[0][1] == tuple(range(len(names))):
        return every[0][0]
    return Product(tuple(part for part, _ in every), tuple(columns for _, columns in every))


def find_frame(rows: FirstRows, space: Space) -> tuple[str, tuple[Note, ...]]:
    """Find in which frame recorded angular velocities are, by how the states turn.

    Parameters
    ----------
    rows : FirstRows
        With actions.
    space : Space
        With velocities in the world's frame.

    Returns
    -------
    {"world", "body"}
        The world's where nothing tells.
    tuple of Note
        What was found.
    """
    body = in_frame(space, "body")
    turning = [
        k for k, (a, b) in enumerate(zip(space.units, _frame_matters(space), strict=True)) if a == "rad" and b
    ]
    if rows.U is None or not turning:
        return "world", ()
    text = "the angular velocities are taken to be in the {} frame{}; angular_velocity= says otherwise"
    if rows.time is None or rows.U.shape[1] != space.n_actions:
        return "world", (Note("frame", "", text.format("world's", ", as no time tells how the states turn")),)
    misses = {}
    for name, each in (("world", space), ("body", body)):
        apart = size = 0.0
        for own in runs(rows.codes):
            passed = np.diff(rows.time[own])[:, None]
            going = passed[:, 0] > 0
            X = each.follow(rows.X[own])
            speeds = each.difference(X[:-1], X[1:])[going] / passed[going]
            given = rows.U[own][:-1][going]
            apart += float(np.sum((given - speeds)[:, turning] ** 2))
            size += float(np.sum(given[:, turning] ** 2))
        misses[name] = apart / size if size > 0 else np.inf
    best = "body" if misses["body"] < NEAR * misses["world"] else "world"
    why = f", where they differ from how the states turn by {100 * np.sqrt(misses[best]):.2g} %"
    if not np.isfinite(misses[best]):
        why = ", as nothing turns"
    return best, (Note("frame", "", text.format(f"{best}'s", why)),)


def in_frame(space: Space, frame: str) -> Space:
    """Return the same space, with angular velocities in another frame.

    Parameters
    ----------
    space : Space
        Any.
    frame : {"world", "body"}
        That of the velocities of its rotations.

    Returns
    -------
    Space
        The same states.
    """
    if isinstance(space, Rotation):
        return Rotation(space.written, frame, space.degrees)
    if isinstance(space, Product):
        return type(space)(tuple(in_frame(part, frame) for part in space.parts), space.columns)
    return space


def arrange_reference(space: Space, names: Sequence[str]) -> list[int]:
    """Find the order in which columns are what states are relative to, since quaternions may be written in two.

    Parameters
    ----------
    space : Space
        That the states belong to.
    names : sequence of str
        Of the columns, as many as states; or seven for positions.

    Returns
    -------
    list of int
        The place among the columns of each number.
    """
    order = list(range(len(names)))
    if len(names) != space.n_states:
        tail = _order_of_quaternion(names[3:])
        return [0, 1, 2, *(3 + i for i in tail or range(4))]
    for columns in _quaternions(space):
        places = sorted(columns)
        found = _order_of_quaternion([names[i] for i in places])
        if found is not None:
            for column, i in zip(columns, found, strict=True):
                order[column] = places[i]
    return order


def _quaternions(space: Space) -> list[tuple[int, ...]]:
    """List the columns x, y, z and w of each quaternion of a state."""
    if isinstance(space, Rotation):
        return [(0, 1, 2, 3)] if space.written == "xyzw" else []
    if not isinstance(space, Product):
        return []
    return [
        tuple(own[i] for i in columns)
        for part, own in zip(space.parts, space.columns, strict=True)
        for columns in _quaternions(part)
    ]


def _frame_matters(space: Space) -> list[bool]:
    """Say of each velocity whether it is one of a rotation."""
    if isinstance(space, Product):
        return [matters for part in space.parts for matters in _frame_matters(part)]
    return [isinstance(space, Rotation)] * space.n_actions


def _find_rotation(
    rows: FirstRows, columns: tuple[int, ...], names: Sequence[str], how: Preparation, shown: str
) -> tuple[Rotation, tuple[int, ...], list[Note]]:
    """Find how a rotation is written, and the order of its columns."""
    called = [names[i] for i in columns]
    listed = ", ".join(called)
    frame = how.angular_velocity or "world"
    notes: list[Note] = []
    if len(columns) == 4:
        order = _order_of_quaternion(called)
        rotation = Rotation("xyzw", frame)
        if order is None:
            text = (
                f"{listed} are taken for x, y, z and w of a quaternion; list them in that order in rotation="
            )
            notes.append(Note("rotation", "", text.replace("{}", "{ }")))
        columns = tuple(columns[i] for i in order or range(4))
    elif len(columns) == 9:
        rotation = Rotation("matrix", frame)
    else:
        angles = _order_of_euler(called)
        written = "rotvec" if angles is None else "euler"
        columns = columns if angles is None else tuple(columns[i] for i in angles)
        degrees, guessed = _in_degrees(rows.X[:, list(columns)], LARGEST_OF_ROTATIONS, called, how)
        rotation = Rotation(written, frame, degrees)
        sure = "" if not guessed else "; angle_unit= says otherwise"
        text = f"{listed} are taken for {rotation.words}{'' if degrees else ' in radians'}{sure}"
        notes.append(Note("rotation", "", text.replace("{}", "{ }")))
    faults = rotation.faults(rows.X[:, list(columns)])
    if faults.any():
        raise DataError(
            f"{shown}: {listed} are no rotation in row {int(np.argmax(faults))} (counted from 0), where they should be "
            f"{rotation.words}: choose other columns in rotation=, or leave such rows out"
        )
    return rotation, columns, notes


def _find_angle(rows: FirstRows, i: int, roles: Roles, how: Preparation) -> tuple[Angle | None, list[Note]]:
    """Find the turn of a column that is an angle; None where it was not given as one and does not wrap."""
    chosen = roles.angle is not None
    wraps = [find_turn(rows.X[own, i], chosen) for own in runs(rows.codes)]
    turns = [found[0] for found in wraps if found is not None]
    if how.angle_unit is not None and (chosen or turns):
        return Angle(360.0 if how.angle_unit == "deg" else 2 * np.pi), []
    if turns:
        return Angle(TURNS[turns[0]]), []
    if not chosen:
        return None, []
    name = roles.state_names[i]
    degrees, guessed = _in_degrees(rows.X[:, [i]], LARGEST_RADIANS, [name], how)
    text = f"the angle {name} is taken to be in {'degrees' if degrees else 'radians'}; angle_unit= says otherwise"
    note = [Note("turn", "", text.replace("{}", "{ }"))] if guessed else []
    return Angle(360.0 if degrees else 2 * np.pi), note


def _in_degrees(values: Array, most: float, names: Sequence[str], how: Preparation) -> tuple[bool, bool]:
    """Say whether angles are in degrees, and whether that is a guess by their size."""
    if how.angle_unit is not None:
        return how.angle_unit == "deg", False
    words = {word.lower() for name in names for word in re.findall(r"[A-Za-z]+", name)}
    if words & {"deg", "degree", "degrees"}:
        return True, False
    if words & {"rad", "radian", "radians"}:
        return False, False
    return bool(np.nanmax(np.abs(values), initial=0.0) > most), True


def _order_of_quaternion(names: Sequence[str]) -> list[int] | None:
    """Find the places of x, y, z and w by the last letters of names; None where these do not tell."""
    letters = [re.sub(r"[^a-z]", "", name.lower())[-1:] for name in names]
    return [letters.index(axis) for axis in "xyzw"] if sorted(letters) == sorted("wxyz") else None


def _order_of_euler(names: Sequence[str]) -> list[int] | None:
    """Find the places of roll, pitch and yaw by names; None where these do not tell."""
    found = [[i for i, name in enumerate(names) if angle in name.lower()] for angle in EULER]
    places = [each[0] for each in found if len(each) == 1]
    return places if len(set(places)) == 3 else None


def _are_axes(names: Sequence[str], columns: Sequence[int]) -> bool:
    """Whether the names of three columns end in x, y and z, or are numbered from 0."""
    letters = [re.sub(r"[^a-z]", "", names[i].lower())[-1:] for i in columns]
    numbers = [re.sub(r"^.*?(\d*)\D*$", r"\1", names[i]) for i in columns]
    return letters == ["x", "y", "z"] or numbers == ["0", "1", "2"]
