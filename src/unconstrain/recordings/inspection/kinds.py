"""What a column of numbers is, judged by its name and by its values."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from unconstrain.recordings.units import UNITS

Array = NDArray[np.float64]

TIME = {
    "t", "time", "timestamp", "timestamps", "stamp", "clock", "elapsed", "datetime", "secs", "sec", "seconds",
}  # fmt: skip
EPISODE = {
    "episode", "episodes", "run", "trial", "demo", "demonstration", "traj", "trajectory", "sequence", "rep",
    "repetition",
}  # fmt: skip
REST = {"nsec", "nsecs", "nanosec", "nanosecs", "nanoseconds", "usec", "usecs"}
INDEX = {"frame", "frames", "index", "idx", "seq", "sample", "id", "count", "row", "number", "no", "sub"}
FORCE = {"force", "forces", "wrench", "torque", "torques", "effort", "tau", "fx", "fy", "fz", "ft", "f"}
VELOCITY = {
    "vel", "velocity", "velocities", "speed", "twist", "dot", "xd", "yd", "zd", "vx", "vy", "vz", "wx", "wy",
    "wz", "dx", "dy", "dz", "xdot", "ydot", "zdot", "qd", "dq", "qdot", "omega", "v",
}  # fmt: skip
ACCELERATION = {"acc", "accel", "acceleration", "ax", "ay", "az", "ddx", "ddy", "ddz", "ddot", "qdd"}
ANGLE = {
    "yaw", "roll", "pitch", "angle", "angles", "theta", "phi", "psi", "heading", "joint", "joints", "euler",
    "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "rx", "ry", "rz", "q",
}  # fmt: skip
POSITION = {"x", "y", "z", "tx", "ty", "tz", "px", "py", "pz", "pos", "position", "positions", "xyz"}
EARTH = {"latitude", "longitude", "lat", "lon", "lng"}
STATE = {"state", "states"}
ROTATION = {"quat", "quaternion", "orientation", "rotation"}
ACTIONS = {"action", "actions", "acs", "u", "cmd", "command", "control", "ctrl"}
NEXT = {"next"}
NEITHER = {
    "covariance",
    "error",
    "err",
    "std",
    "var",
    "residual",
    "temperature",
    "temp",
    "current",
    "voltage",
}
"""Words in the names of columns that say what these are, in small letters."""

FITTING = {
    "time": ("s", "ms", "us", "ns"),
    "angle": ("rad", "deg"),
    "position": ("m", "mm", "cm", "km"),
    "force": ("N", "Nm"),
}
"""The units that a kind of column may have."""

EPOCHS = ((1e9, 4e9, "s"), (1e12, 4e12, "ms"), (1e15, 4e15, "us"), (1e18, 4e18, "ns"))
"""Seconds since 1970 of the years 2001 to 2096, in each unit."""

SELDOM = 0.34
"""Columns that change at a larger share of the steps do not tell episodes apart."""

UNIT_NORM = 0.02
"""How far from one the norm of a recorded quaternion may be."""


@dataclass(frozen=True)
class ColumnReport:
    """What one column was found to be.

    Parameters
    ----------
    name : str
        The name, or "" where the file has none.
    kind : str
        "position", "velocity", "acceleration", "angle", "quaternion", "rotation", "force", "time", "episode", "index",
        "flag", "text", "constant", "empty", or "number" where nothing more is known.
    unit : str or None
        The unit, where it is known.
    low, high : float or None
        The smallest and the largest value.
    missing : int
        How many values are missing.
    detail : str
        What else there is to say, such as the order of a quaternion, or that an angle wraps.
    """

    name: str
    kind: str
    unit: str | None = None
    low: float | None = None
    high: float | None = None
    missing: int = 0
    detail: str = ""


def words(name: str) -> list[str]:
    """Split the name of a column into its words, in small letters.

    >>> words("pose.position.x"), words("rosbagTimestamp"), words("Time (Seconds)"), words("obs/eef_pos[2]")
    (['pose', 'position', 'x'], ['rosbag', 'timestamp'], ['time', 'seconds'], ['obs', 'eef', 'pos', '2'])
    """
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    return [part.lower() for part in re.findall(r"[A-Za-z]+|\d+", spaced)]


def unit_of(name: str, kind: str) -> str | None:
    """Return the unit that a name ends in or has in brackets, where such columns can have it.

    >>> unit_of("x [mm]", "position"), unit_of("yaw_deg", "angle"), unit_of("t", "time")
    ('mm', 'deg', None)
    """
    found = re.findall(r"[\[(]\s*([A-Za-z]+)\s*[\])]", name) or words(name)[1:][-1:]
    unit = UNITS.get(found[-1].lower()) if found else None
    return unit if unit in FITTING.get(kind, ()) else None


def judge(
    names: Sequence[str], columns: Sequence[Array | None], units: Sequence[str | None] | None = None
) -> list[ColumnReport]:
    """Judge all columns of a file.

    Parameters
    ----------
    names : sequence of str
        May repeat, or be empty.
    columns : sequence of ndarray of shape (N,), or None
        The values, NaN where one is missing; None for a column of text.
    units : sequence of str or None, optional
        The unit of columns that are stamps by their type.

    Returns
    -------
    list of ColumnReport
        One for each column, in order.
    """
    units = units or [None] * len(names)
    found = [
        ColumnReport(name, "text") if values is None else _judge_one(name, values, unit)
        for name, values, unit in zip(names, columns, units, strict=True)
    ]
    for start in poses(names, columns):
        for i in range(start, start + 12):
            is_position = (i - start) % 4 == 3
            found[i] = replace(found[i], kind="position" if is_position else "rotation", unit=None)
    if are_tracks(names, columns):
        found[0], found[1] = replace(found[0], kind="time"), replace(found[1], kind="episode")
    for start, order in quaternions(names, columns):
        for i in range(start, start + 4):
            values = columns[i]
            assert values is not None
            found[i] = replace(found[i], kind="quaternion", unit=None, detail=f"order {order}")
        for i in _after(start + 4, names):
            # A pose ends with its quaternion; what follows in the same array is a wrench, or anything else.
            if found[i].kind == "position":
                found[i] = replace(found[i], kind="number", unit=None)
    return found


def _after(start: int, names: Sequence[str]) -> list[int]:
    """Return the components that follow a quaternion in the array that it is part of."""
    array = words(names[start - 1])[:-1]
    after = []
    for i in range(start, len(names)):
        own = words(names[i])
        if not own or not own[-1].isdecimal() or own[:-1] != array:
            break
        after.append(i)
    return after


def with_unit(report: ColumnReport, unit: str, values: Array | None) -> ColumnReport:
    """Return a report of a column whose unit the file tells, which may say of what kind it is.

    Parameters
    ----------
    report : ColumnReport
    unit : str
        As the file has it; "" where it says nothing.
    values : ndarray of shape (N,) or None

    Returns
    -------
    ColumnReport
    """
    if not unit or values is None or report.kind in ("text", "empty", "quaternion", "episode", "flag"):
        return report
    kind = next((kind for kind, own in FITTING.items() if unit in own), None)
    if kind == "time":
        here = values[np.isfinite(values)]
        rises = len(here) > 1 and float(np.mean(np.diff(here) > 0)) > 0.8
        return replace(report, kind="time", unit=unit) if rises or report.kind == "time" else report
    if EARTH & set(words(report.name)):
        return replace(report, kind="position", unit=unit)
    unknown = report.kind in ("number", "position", "angle") and not NEITHER & set(words(report.name))
    return replace(report, kind=kind if unknown and kind is not None else report.kind, unit=unit)


def quaternions(names: Sequence[str], columns: Sequence[Array | None]) -> list[tuple[int, str]]:
    """Find four neighbouring columns of unit norm.

    Parameters
    ----------
    names : sequence of str
    columns : sequence of ndarray of shape (N,), or None

    Returns
    -------
    list of (int, str)
        The first of the four, and "xyzw" or "wxyz". Where the names do not tell the order, it is the one whose scalar
        part has the larger magnitude, as that of a small rotation has.
    """
    found: list[tuple[int, str]] = []
    start = 0
    while start + 4 <= len(columns):
        four = [values for values in columns[start : start + 4] if values is not None]
        called = [words(name) or [""] for name in names[start : start + 4]]
        letters = "".join(own[-1][-1:] for own in called)
        if len(four) == 4 and _may_be_one(called, letters) and _is_unit(np.array(four)):
            order = letters if letters in ("xyzw", "wxyz") else None
            if order is None:
                order = "wxyz" if np.nanmean(np.abs(four[0])) > np.nanmean(np.abs(four[3])) else "xyzw"
            found.append((start, order))
            start += 4
        else:
            start += 1
    return found


def poses(names: Sequence[str], columns: Sequence[Array | None]) -> list[int]:
    """Find the rows of pose matrices: twelve neighbouring columns without names of which nine are a rotation.

    Parameters
    ----------
    names : sequence of str
    columns : sequence of ndarray of shape (N,), or None

    Returns
    -------
    list of int
        The first column of each matrix [R p], written row by row, as KITTI does.
    """
    found: list[int] = []
    start = 0
    while start + 12 <= len(columns):
        own = [values for values in columns[start : start + 12] if values is not None]
        if len(own) == 12 and not any(names[start : start + 12]) and len(own[0]):
            R = np.stack(own, axis=1).reshape(-1, 3, 4)[:, :, :3]
            if np.allclose(R @ R.transpose(0, 2, 1), np.eye(3), atol=UNIT_NORM):
                found.append(start)
                start += 12
                continue
        start += 1
    return found


def are_tracks(names: Sequence[str], columns: Sequence[Array | None]) -> bool:
    """Whether the first two columns, without names, number frames and those that are seen in them.

    Parameters
    ----------
    names : sequence of str
    columns : sequence of ndarray of shape (N,), or None

    Returns
    -------
    bool
        Whether frames rise for each number, and several numbers share frames.
    """
    first = [values for values in columns[:2] if values is not None]
    if any(names) or len(columns) < 4 or len(first) < 2 or len(first[0]) < 4:
        return False
    frames, tracks = first
    if not all(np.isfinite(each).all() and np.all(each == np.round(each)) for each in first):
        return False
    order = np.lexsort((frames, tracks))
    steps, same = np.diff(frames[order]), np.diff(tracks[order]) == 0
    shared = len(np.unique(frames)) < len(frames)
    return shared and bool(np.mean(same) > 0.5) and bool(np.all(steps[same] > 0))


def sign_flips(quaternion: Array, episodes: NDArray[np.int64]) -> int:
    """Count the steps within episodes (N,) at which a quaternion (N, 4) changes its sign and hardly turns."""
    cosines = np.sum(quaternion[:-1] * quaternion[1:], axis=1)
    return int(np.sum((cosines < -0.5) & (np.diff(episodes) == 0)))


def wraps(values: Array) -> tuple[int, float]:
    """Count how often an angle jumps by a whole turn, and say how long a turn is.

    Parameters
    ----------
    values : ndarray of shape (N,)

    Returns
    -------
    count : int
    turn : float
        2π or 360; 0 where it never wraps.
    """
    here = values[np.isfinite(values)]
    if len(here) < 3:
        return 0, 0.0
    steps = np.abs(np.diff(here))
    extent = float(np.ptp(here))
    for turn in (2 * np.pi, 360.0):
        jumps = np.abs(steps - turn) < 0.1 * turn
        # All other steps are small: numbers that scatter over the same range are no angle.
        if 0.8 * turn < extent <= 1.01 * turn and jumps.any() and np.all(steps[~jumps] < 0.4 * turn):
            return int(jumps.sum()), turn
    return 0, 0.0


def is_smooth(values: Array) -> bool:
    """Whether neighbouring values (N,) resemble each other, as those of a movement do and those of noise do not."""
    here = values[np.isfinite(values)]
    spread = float(np.var(here)) if len(here) > 4 else 0.0
    return spread > 0 and float(np.mean(np.diff(here) ** 2)) < 0.5 * 2 * spread


def epoch_unit(values: Array) -> str | None:
    """Return the unit in which values (N,) are times since 1970, by their size; None where they are not."""
    middle = float(np.nanmedian(values)) if np.isfinite(values).any() else 0.0
    return next((unit for low, high, unit in EPOCHS if low <= middle < high), None)


def tells_episodes(name: str, texts: NDArray[np.str_]) -> bool:
    """Whether a column of text is called after episodes and changes seldom."""
    return bool(EPISODE & set(words(name))) and bool(
        np.mean(texts[1:] != texts[:-1]) < SELDOM if len(texts) > 1 else True
    )


def _may_be_one(called: Sequence[Sequence[str]], letters: str) -> bool:
    """Whether the names of four columns allow that they are a quaternion; `x, y, vx, vy` do not, nor do actions."""
    if any(ACTIONS & set(own) for own in called):
        return False
    alike = all(own[:-1] == called[0][:-1] for own in called)
    numbered = alike and all(own[-1].isdecimal() or not own[-1] for own in called)
    lettered = alike and sorted(letters) == sorted("wxyz")
    return lettered or numbered or all(ROTATION & set(own) for own in called)


def _is_unit(four: Array) -> bool:
    whole = four[:, np.isfinite(four).all(axis=0)]
    if whole.shape[1] < 3 or np.isin(whole, (-1.0, 0.0, 1.0)).all():  # flags of which one is set
        return False
    close = np.abs(np.linalg.norm(whole, axis=0) - 1.0) < UNIT_NORM
    return bool(np.mean(close) > 0.99) and np.abs(whole).max() <= 1.0 + UNIT_NORM


def _judge_one(name: str, values: Array, unit: str | None) -> ColumnReport:
    here = values[np.isfinite(values)]
    missing = len(values) - len(here)
    if not len(here):
        return ColumnReport(name, "empty", missing=missing)
    report = ColumnReport(name, "number", None, float(here.min()), float(here.max()), missing)
    if unit is not None:
        return replace(report, kind="time", unit=unit)
    called = words(name)
    steps = np.diff(here)
    forward = float(np.mean(steps >= 0)) if len(steps) else 0.0
    whole = bool(np.all(here == np.round(here)))
    epoch = epoch_unit(here)
    if epoch is not None and forward > 0.9 and (np.any(steps) or TIME & set(called)):
        return replace(report, kind="time", unit=unit_of(name, "time") or epoch)
    if EPISODE & set(called) and whole and not np.any(steps == 0.5) and _is_piecewise(here):
        return replace(report, kind="episode")
    if report.low == report.high:
        return replace(report, kind="constant")
    if TIME & set(called) and forward > 0.8:
        return replace(report, kind="time", unit=unit_of(name, "time"))
    if whole and REST & set(called):  # what is left of a second
        return replace(report, kind="index")
    counts = whole and len(steps) > 1 and float(np.mean(steps == 1)) > 0.9
    if counts or (whole and INDEX & set(called)):
        return replace(report, kind="index")
    if np.isin(here, (0.0, 1.0)).all():
        return replace(report, kind="flag")
    if NEITHER & set(called):
        return report
    count, turn = wraps(values)
    kind = "angle" if count else _kind_by_name(called)
    if kind == "angle":
        known = unit_of(name, "angle")
        by_turn = {0.0: None, 360.0: "deg"}.get(turn, "rad")
        by_size = "deg" if max(abs(report.low or 0.0), abs(report.high or 0.0)) > 4 * np.pi else "rad"
        detail = f"wraps {count} time{'s' if count != 1 else ''}" if count else ""
        return replace(report, kind=kind, unit=known or by_turn or by_size, detail=detail)
    return replace(report, kind=kind, unit=unit_of(name, kind))


def _is_piecewise(here: Array) -> bool:
    """Whether values change seldom, so that they can tell episodes apart."""
    return len(here) < 3 or float(np.mean(np.diff(here) != 0)) < SELDOM


def _kind_by_name(called: Sequence[str]) -> str:
    """Judge by the words of a name; of `linear.velocity.x` and `pose.position.x` the words before the axis decide."""
    letters = [word for word in called if not word.isdecimal()]
    if len(letters) > 1 and letters[-1] in UNITS:
        letters.pop()
    for kind, known in (
        ("acceleration", ACCELERATION),
        ("velocity", VELOCITY),
        ("force", FORCE),
    ):
        if known & set(letters):
            return kind
    if ROTATION & set(letters):
        return "number"
    if {"pos", "position", "positions"} & set(letters):
        return "angle" if {"joint", "joints"} & set(letters) else "position"
    if letters and letters[-1] in POSITION:
        return "position"
    return "angle" if ANGLE & set(letters) else "number"
