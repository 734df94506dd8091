"""Which columns of a recording are worth trying as states, actions, time and episodes, best first."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unconstrain.recordings.columns import Key
from unconstrain.recordings.inspection.kinds import (
    ACTIONS,
    NEXT,
    STATE,
    ColumnReport,
    epoch_unit,
    is_smooth,
    words,
)
from unconstrain.recordings.table import Column

Array = NDArray[np.float64]

UNEVEN, EVEN = 0.2, 1e-6
"""Steps that scatter by a smaller share are those of a clock: of plain numbers, and of what is called a position."""

MOST_STATES = 40
"""Columns that are proposed together without names that say so."""


@dataclass(frozen=True)
class Group:
    """Columns that belong together.

    Parameters
    ----------
    kind : str
        As in `ColumnReport`.
    places : tuple of int
        Where among the columns they are.
    called : str
        What they have in common.
    """

    kind: str
    places: tuple[int, ...]
    called: str


def choose_time(
    reports: Sequence[ColumnReport], values: Sequence[Array | None], episodes: NDArray[np.int64]
) -> list[int]:
    """Find the columns that may be the time, best first.

    Names and sizes decide; where neither does, the first column that always increases evenly within episodes is a
    guess.

    Parameters
    ----------
    reports : sequence of ColumnReport
    values : sequence of ndarray of shape (N,), or None
    episodes : ndarray of shape (N,)
        The episode of each row, as far as a column or the files tell it.

    Returns
    -------
    list of int
    """
    stamps = [i for i, report in enumerate(reports) if report.kind == "time" and not report.missing]
    received = {"receive", "received", "recv", "log", "wall"}

    def rank(i: int) -> tuple[bool, int, bool]:
        own = values[i]
        steps = np.diff(own) if own is not None else np.zeros(0)
        return (
            bool(received & set(words(reports[i].name))),
            int(np.sum(steps <= 0)),
            own is None or epoch_unit(own) is None,
        )

    if stamps:
        return sorted(stamps, key=rank)
    for i, report in enumerate(reports):
        if report.kind in ("number", "position") and rises_evenly(
            values[i], episodes, UNEVEN if report.kind == "number" else EVEN
        ):
            return [i]
    return []


def rises_evenly(values: Array | None, episodes: NDArray[np.int64], scatter: float = EVEN) -> bool:
    """Whether a column goes up in steps of one size within each episode, as a clock does.

    Parameters
    ----------
    values : ndarray of shape (N,), or None
    episodes : ndarray of shape (N,)
    scatter : float
        How much the typical step may differ from the median one, of which it is a share.

    Returns
    -------
    bool
    """
    if values is None or len(values) < 3 or not np.isfinite(values).all():
        return False
    steps = np.diff(values)[np.diff(episodes) == 0]
    if not len(steps) or not np.all(steps > 0):
        return False
    middle = float(np.median(steps))
    return float(np.median(np.abs(steps - middle))) < scatter * middle


def choose_episodes(
    reports: Sequence[ColumnReport], values: Sequence[Array | None], time: Array | None
) -> tuple[list[int], bool]:
    """Find the columns that may tell episodes apart, best first.

    Parameters
    ----------
    reports : sequence of ColumnReport
    values : sequence of ndarray of shape (N,), or None
    time : ndarray of shape (N,), or None

    Returns
    -------
    columns : list of int
    is_guess : bool
        Whether only the time that starts anew where the column changes says so.
    """
    named = [i for i, report in enumerate(reports) if report.kind == "episode" and not report.missing]
    if named or time is None:
        return named, False
    restarts = np.flatnonzero(np.diff(time) < 0)
    if not len(restarts):
        return [], False
    for i, column in enumerate(values):
        if column is None or reports[i].kind in ("time", "constant", "empty"):
            continue
        changes = np.flatnonzero(np.diff(column) != 0)
        if len(changes) <= 2 * len(restarts) and np.isin(restarts, changes).all():
            return [i], True
    return [], False


def choose_states(
    reports: Sequence[ColumnReport],
    columns: Sequence[Column],
    values: Sequence[Array | None],
    taken: set[int],
) -> list[Group]:
    """Find the groups of columns that may be the state, best first.

    Positions come first, then what is called a state, angles, rotations, and last numbers that change smoothly. Of
    alike groups those without missing values come first, and then the order of the file decides.

    Parameters
    ----------
    reports : sequence of ColumnReport
    columns : sequence of Column
    values : sequence of ndarray of shape (N,), or None
    taken : set of int
        Columns that play another role.

    Returns
    -------
    list of Group
    """
    groups: list[Group] = []
    for kind in ("position", "state", "angle"):
        found: dict[str, list[int]] = {}
        for i, report in enumerate(reports):
            called = set(words(report.name))
            is_state = report.kind in ("number", "angle", "position") and bool(STATE & called)
            judged = "state" if is_state else report.kind
            if judged == kind and i not in taken and not (ACTIONS | NEXT) & called:
                found.setdefault(_stem(columns[i], kind), []).append(i)
        groups += _in_order(kind, _runs(found, columns), reports)
    groups += [Group("rotation", places, "") for places in choose_rotations(reports)]
    numbers = [
        i
        for i, report in enumerate(reports)
        if report.kind == "number"
        and i not in taken
        and not (ACTIONS | NEXT) & set(words(report.name))
        and (own := values[i]) is not None
        and is_smooth(own)
    ]
    found = {}
    for i in numbers:
        found.setdefault(columns[i].part_of, []).append(i)
    return groups + _in_order("number", found, reports)


def choose_rotations(reports: Sequence[ColumnReport]) -> list[tuple[int, ...]]:
    """Find the quaternions.

    Parameters
    ----------
    reports : sequence of ColumnReport

    Returns
    -------
    list of tuple of int
        Where x, y, z and w of each are among the columns.
    """
    places = [i for i, report in enumerate(reports) if report.kind == "quaternion" and not report.missing]
    found = []
    for start in range(0, len(places) - 3, 4):
        four = places[start : start + 4]
        order = reports[four[0]].detail.removeprefix("order ")
        found.append(tuple(four[order.index(axis)] for axis in "xyzw"))
    return found


def choose_actions(state: Group, reports: Sequence[ColumnReport], columns: Sequence[Column]) -> list[Group]:
    """Find the groups of as many columns that may be the velocity of a state.

    Parameters
    ----------
    state : Group
    reports : sequence of ColumnReport
    columns : sequence of Column

    Returns
    -------
    list of Group
    """
    found: dict[str, list[int]] = {}
    for i, report in enumerate(reports):
        named = ACTIONS & set(words(report.name))
        if NEXT & set(words(report.name)):
            continue
        if i not in state.places and report.missing == 0 and (report.kind == "velocity" or named):
            kind = "action" if named else "velocity"
            found.setdefault(f"{kind} {_stem(columns[i], 'velocity')}", []).append(i)
    n = len(state.places)
    exact = [Group("velocity", tuple(places), stem) for stem, places in found.items() if len(places) == n]
    longer = [places for places in found.values() if len(places) > n]
    # Of a twist the first three are the velocity of the position.
    return exact + [Group("velocity", tuple(places[:n]), "") for places in longer]


def key_of(i: int, columns: Sequence[Column], positions: Sequence[int]) -> Key:
    """Return what a column is chosen by: its name, or its position where a name would not tell or not be typed."""
    name = columns[i].name
    repeated = sum(other.name == name for other in columns) > 1
    hidden = any(other.part_of == name for other in columns)
    odd = not name or name != name.strip() or name.isdecimal() or any(c in name for c in ',"\r\n')
    return positions[i] if repeated or hidden or odd or name.startswith("-") else name


def keys_of(group: Sequence[int], columns: Sequence[Column], positions: Sequence[int]) -> list[Key]:
    """Return what columns are chosen by; the name of an array stands for all of its columns."""
    whole = {columns[i].part_of for i in group}
    part = whole.pop() if len(whole) == 1 else ""
    every = [i for i, column in enumerate(columns) if part and column.part_of == part]
    names = [column.name for column in columns]
    plain = part == part.strip() and not part.isdecimal() and not any(c in part for c in ',"\r\n')
    if every == list(group) and plain and part not in names and not part.startswith("-"):
        return [part]
    return [key_of(i, columns, positions) for i in group]


def _stem(column: Column, kind: str) -> str:
    """Return what the names of columns that belong together have in common."""
    if column.part_of:
        return column.part_of
    if kind == "angle":
        return ""
    called = words(column.name)
    while called and (called[-1].isdecimal() or (len(called[-1]) <= 2 and len(called) > 1)):
        called = called[:-1]
    return " ".join(called) if len(called) > 1 else ""


def _runs(found: dict[str, list[int]], columns: Sequence[Column]) -> dict[str, list[int]]:
    """Split the columns of an array where others lie between them, as a quaternion between a position and a force."""
    runs: dict[str, list[int]] = {}
    for stem, places in found.items():
        last = None
        for i in places:
            if last is None or (columns[i].part_of and i != last + 1):
                run = f"{stem} from {i}"
            runs.setdefault(run, []).append(i)
            last = i
    return runs


def _in_order(kind: str, found: dict[str, list[int]], reports: Sequence[ColumnReport]) -> list[Group]:
    """Make groups of columns: whole ones first, then those with missing values, then what is left of these without."""
    limit = MOST_STATES if kind == "number" else None
    ranked: list[tuple[int, Group]] = []
    for stem, places in found.items():
        own = _axes(places, reports)[:limit]
        whole = [i for i in own if not reports[i].missing]
        ranked.append((0 if len(whole) == len(own) else 1, Group(kind, tuple(own), stem)))
        if 0 < len(whole) < len(own):
            ranked.append((2, Group(kind, tuple(whole), stem)))
    return [group for _, group in sorted(ranked, key=lambda pair: pair[0])]


def _axes(places: list[int], reports: Sequence[ColumnReport]) -> list[int]:
    """Keep the first of columns that are called alike, as of `x,y,z,x,y,z` of two bodies."""
    seen: set[str] = set()
    kept = []
    for i in places:
        name = reports[i].name
        if name and name in seen:
            continue
        seen.add(name)
        kept.append(i)
    return kept
