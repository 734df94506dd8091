"""States that come back to where they were: angles that wrap, and quaternions that change their sign."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from unconstrain.recordings.notes import Note

Array = NDArray[np.float64]

TURNS = {"2π": 2 * np.pi, "360": 360.0}
"""A turn, in the units that angles are recorded in."""

# How far beyond half a turn or a whole one recorded angles may lie, as a share of a turn.
MARGIN = 0.01

# A wrap is a step of a turn and some motion: at most this share of a turn, and at most twice the motion between others,
# unless that is nothing beside a turn.
LEFT = 0.25
REST = 1e-3

# How far the norm of a recorded quaternion may be from 1.
UNIT = 0.02


def unwrap(
    X: Array, names: Sequence[str], chosen: Sequence[int] | None, file: str, rotations: Sequence[int] = ()
) -> tuple[Array, tuple[Note, ...]]:
    """Count the turns of angles on, and give quaternions the sign of the one before, in one episode.

    Parameters
    ----------
    X : ndarray of shape (N, n)
        The states of the episode.
    names : sequence of str
        Of the states.
    chosen : sequence of int or None
        Which states are angles; None to recognise angles and quaternions by their jumps.
    file : str
        The file, as notes call it.
    rotations : sequence of int
        Which states are known to be parts of rotations, and are left alone.

    Returns
    -------
    ndarray of shape (N, n)
        `X` itself where nothing jumps.
    tuple of Note
    """
    notes: list[Note] = []
    result = X
    for i in range(X.shape[1]) if chosen is None else chosen:
        if i in rotations:
            continue
        found = find_turn(X[:, i], chosen is not None)
        if found is None:
            continue
        turn, wraps = found
        result = result.copy() if result is X else result
        result[:, i] = np.unwrap(X[:, i], period=TURNS[turn])
        remedy = "" if chosen is not None else '; if it is no angle, give angle="none"'
        text = f"the angle {_plain(names[i])} wraps {{}} at {turn}, where its turns are counted on{remedy}"
        notes.append(Note("angle", file, text, (wraps,), ("time",)))
    if chosen is not None:
        return result, tuple(notes)
    for first in quaternions(X):
        if any(i in rotations for i in range(first, first + 4)):
            continue
        part = slice(first, first + 4)
        turned = np.sum(X[1:, part] * X[:-1, part], axis=1) < 0
        result = result.copy() if result is X else result
        result[1:, part] *= np.where(np.cumsum(turned) % 2, -1.0, 1.0)[:, None]
        called = ",".join(names[part])
        text = (
            f"the quaternion {_plain(called)} changes its sign {{}}, and is given that of the one before; "
            f'rotation="{_plain(called)}" takes it for a rotation, and if it is none, give angle="none"'
        )
        notes.append(Note("angle", file, text, (int(turned.sum()),), ("time",)))
    return result, tuple(notes)


def _plain(name: str) -> str:
    return name.replace("{}", "{ }")  # which is where a note puts its counts


def quaternions(X: Array) -> list[int]:
    """Find four neighbouring states of unit norm that change their sign from one sample to the next.

    Returns
    -------
    list of int
        The first state of each.
    """
    if len(X) < 2:
        return []
    squares = X**2
    near: list[tuple[float, int]] = []
    for i in range(X.shape[1] - 3):
        apart = float(np.abs(np.sqrt(squares[:, i : i + 4].sum(axis=1)) - 1.0).max())
        if apart <= UNIT and np.any(np.sum(X[1:, i : i + 4] * X[:-1, i : i + 4], axis=1) < -0.5):
            near.append((apart, i))
    found: list[int] = []
    # Three numbers near zero beside a scalar part near 1 look like a quaternion too, but less so than the real one.
    for _, i in sorted(near):
        if all(abs(i - other) >= 4 for other in found):
            found.append(i)
    return sorted(found)


def find_turn(x: Array, certain: bool) -> tuple[str, int] | None:
    """Find at what numbers wrap, and how often.

    Parameters
    ----------
    x : ndarray of shape (N,)
        Of one episode.
    certain : bool
        Whether it is certain that they are an angle. Otherwise all of them have to lie within one turn, and each jump
        has to lead from one end of that turn to the other.

    Returns
    -------
    (str, int) or None
        A key of `TURNS`, and how often; None where they do not wrap.
    """
    if len(x) < 2:
        return None
    steps = np.abs(np.diff(x))
    low, high = float(x.min()), float(x.max())
    for name, turn in TURNS.items():
        jumps = steps > turn / 2
        if not jumps.any():
            return None  # none of 360 either
        margin = MARGIN * turn
        within = any(low >= start - margin and high <= start + turn + margin for start in (-turn / 2, 0.0))
        usual = max(2.0 * float(steps[~jumps].max(initial=0.0)), REST * turn)
        across = np.abs(steps[jumps] - turn) <= min(LEFT * turn, usual)
        if within and (certain or across.all()):
            return name, int(jumps.sum())
    return None
