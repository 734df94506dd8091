"""Finding out what there is in a source: which files, in which formats, and which of their columns is what."""

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace
from itertools import chain
from typing import Any

from unconstrain import demonstrations_file
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.recordings.actions import ActionKind
from unconstrain.recordings.batches import FORMS
from unconstrain.recordings.columns import DIFFERENTIATE, GOAL, START, Columns
from unconstrain.recordings.files import File, Folder, label, locate, short_names
from unconstrain.recordings.formats import lerobot, recognize, rosbag_reading
from unconstrain.recordings.formats.base import Declared, Format, narrow
from unconstrain.recordings.formats.frame import Frame, is_frame
from unconstrain.recordings.formats.lerobot import LeRobot
from unconstrain.recordings.formats.nested import Nested
from unconstrain.recordings.formats.npy import Npy, NpyFolder, belong_together
from unconstrain.recordings.formats.parquet import Parquet
from unconstrain.recordings.formats.saved import InMemory
from unconstrain.recordings.preparation import Preparation
from unconstrain.recordings.recording import Recording
from unconstrain.recordings.roles import assign_roles
from unconstrain.recordings.table import Field
from unconstrain.recordings.tables import Tables


def tell_apart(
    source: str | os.PathLike[str] | Iterable | Callable[[], Iterable],
) -> tuple[list[str | os.PathLike[str]], Iterable | Callable[[], Iterable]]:
    """Tell paths from batches of arrays; one of the two is empty."""
    if isinstance(source, str | os.PathLike):
        return [source], ()
    if isinstance(source, list | tuple):
        if not source:
            raise DataError("nothing was given to open: give files, or at least one batch (X, U)")
        are_paths = any(isinstance(each, str | os.PathLike) for each in source)
        return (list(source), ()) if are_paths else ([], source)
    if isinstance(source, Iterator):  # a pattern's matches, for example
        first = next(source, None)
        if isinstance(first, str | os.PathLike):
            return [first, *source], ()
        return [], chain([first], source) if first is not None else iter(())
    if not callable(source) and not isinstance(source, Iterable):
        raise DataError(
            f"source must be a path or several, demonstrations, data frames, or an iterable of {FORMS}, "
            f"got {source!r:.80}"
        )
    return [], source


def find_frames(source: Any) -> list[Any]:
    """Return the data frames that a source is; none where it is something else."""
    each = list(source) if isinstance(source, list | tuple) else [source]
    return each if each and all(map(is_frame, each)) else []


def check_plain(columns: Columns, preparation: Preparation) -> None:
    """Refuse options about the columns of files, where the source is arrays.

    Parameters
    ----------
    columns : Columns
        As given.
    preparation : Preparation
        As given.

    Raises
    ------
    DataError
        One of them was given that arrays have no use for.
    """
    for carrier, default in ((columns, Columns()), (preparation, Preparation())):
        for field in fields(carrier):
            if field.name == "min_speed" or getattr(carrier, field.name) == getattr(default, field.name):
                continue
            what = "chooses a column of files" if carrier is columns else "is about columns of files"
            raise DataError(f"{field.name}= {what}, but the source is not a path")


def open_demonstrations(demos: Demonstrations, columns: Columns, preparation: Preparation) -> Tables:
    """Open demonstrations in memory as if they lay in a file.

    Parameters
    ----------
    demos : Demonstrations
        They know their own columns.
    columns : Columns
        As given; nothing but `action` may be, and the start or goal that states are relative to.
    preparation : Preparation
        As given.

    Returns
    -------
    Tables
        One recording.

    Raises
    ------
    DataError
        Columns are given.
    """
    ends = columns.relative_to if columns.relative_to in (START, GOAL) else None
    if columns != replace(Columns(), action=columns.action, relative_to=ends):
        raise DataError("demonstrations know their columns: choose among them with select, or give a file")
    arrays = demonstrations_file.arrays_of(demos)
    about = demonstrations_file.describe(demos, {name: name for name in arrays})
    held = InMemory(arrays, about)
    return Tables((_recording([held], "these demonstrations", "", "", 0, True, columns, preparation, None),))


def open_frames(frames: Sequence[Any], columns: Columns, preparation: Preparation) -> Tables:
    """Open data frames in memory as if each lay in a file.

    Parameters
    ----------
    frames : sequence of pandas, Polars or Arrow tables
    columns : Columns
        As given.
    preparation : Preparation
        As given.

    Returns
    -------
    Tables
        A recording each.

    Raises
    ------
    DataError
        There are no such columns, or they cannot be used.
    """
    several = len(frames) > 1
    names = [f"frame {number}" if several else "this frame" for number in range(len(frames))]
    recordings = tuple(
        _recording([Frame(frame, name)], name, name, name, number, not several, columns, preparation, None)
        for number, (frame, name) in enumerate(zip(frames, names, strict=True))
    )
    tables = Tables(recordings)
    tables.check_alike()
    return tables


def open_files(paths: list[str | os.PathLike[str]], columns: Columns, preparation: Preparation) -> Tables:
    """Find the files, their formats, and which of their columns is what.

    Parameters
    ----------
    paths : list of path
        Files, folders, patterns and URIs.
    columns : Columns
        As given.
    preparation : Preparation
        As given.

    Returns
    -------
    Tables
        The recordings, in the order of the paths.

    Raises
    ------
    DataError
        There are no such files or columns, or they cannot be used.
    """
    located: list[tuple[str, list[File], LeRobot | None]] = []
    for place in locate(paths):
        located += _recordings_of(place, columns)
    shown = [name for name, _, _ in located]
    several = len(located) > 1
    every = [(file, robot is not None or len(files) > 1) for _, files, robot in located for file in files]
    with ThreadPoolExecutor(16) as pool:  # footers are small and far apart
        formats = iter(list(pool.map(_open_file, every)))
    opened = [
        _joined(name, [narrow(next(formats), columns.topics) for _ in files], preparation.time_axis)
        for name, files, _ in located
    ]
    recordings = tuple(
        _recording(own, name, short, stem, number, not several, columns, preparation, robot)
        for number, (own, (name, _, robot), short, stem) in enumerate(
            zip(opened, located, short_names(shown), label(shown), strict=True)
        )
    )
    tables = Tables(recordings)
    tables.check_alike()
    first = recordings[0]
    recordings = (first, *(replace(each, leader=first) for each in recordings[1:]))
    return Tables(_with_kind(recordings, preparation.action_is))


def _with_kind(recordings: tuple[Recording, ...], given: str | None) -> tuple[Recording, ...]:
    """Decide what the actions are, once for all: by the first recording where it is not given."""
    first = recordings[0]
    if first.differentiates or first.saves:
        if given not in (None, "velocity"):
            raise DataError(
                f"action_is={given} is about recorded actions, and there are none in {first.shown}: name their columns "
                "with action=, or leave it out"
            )
        return recordings
    kind = ActionKind(given or first.find_kind(), given is None, first.timed)
    if kind.kind == "velocity":
        return recordings
    if given is not None and not kind.timed:
        raise DataError(
            f"{first.shown}: action_is={given} needs to know the time of each sample; give time= or rate= too"
        )
    if kind.kind == "increment" or not kind.timed:
        return tuple(replace(each, kind=kind) for each in recordings)
    every = []
    for each in recordings:
        names = tuple(f"{name}_dot" for name in each.roles.state_names)
        roles = replace(each.roles, action=(), policy=(), action_names=names)
        every.append(
            replace(each, kind=kind, roles=roles, columns=replace(each.columns, action=DIFFERENTIATE))
        )
    return tuple(every)


def open_formats(
    paths: list[str | os.PathLike[str]], columns: Columns
) -> list[tuple[str, list[Format], LeRobot | None]]:
    """Find the files of each recording and their formats, without asking which column is what.

    Parameters
    ----------
    paths : list of path
        Files, folders, patterns and URIs.
    columns : Columns
        As given; they decide whether a folder of saved demonstrations is one recording.

    Returns
    -------
    list of (str, list of Format, LeRobot or None)
        What the user calls it, its files, and the dataset that it is, if any.

    Raises
    ------
    DataError
        There are no such files, or they are of no known format.
    """
    return [
        (
            shown,
            _joined(shown, [_open_file((file, robot is not None or len(files) > 1)) for file in files], None),
            robot,
        )
        for place in locate(paths)
        for shown, files, robot in _recordings_of(place, columns)
    ]


def _open_file(about: tuple[File, bool]) -> Format:
    file, in_folder = about
    opened = recognize(file)
    if in_folder and not isinstance(opened, Parquet | Npy):
        raise DataError(f"{file.shown} is damaged or not a Parquet file; write it again")
    if isinstance(opened, Parquet):
        opened.row_groups  # noqa: B018 - read here, side by side with those of other files
    return opened


def _joined(shown: str, formats: list[Format], time_axis: str | None) -> list[Format]:
    """Make one format of the arrays of a folder, and say which axis is time; other files are read in turn."""
    arrays = [each for each in formats if isinstance(each, Npy)]
    joined: list[Format] = [NpyFolder(shown, arrays)] if len(arrays) == len(formats) > 1 else formats
    if time_axis is None:
        return joined
    if not all(isinstance(each, Nested) for each in joined):
        raise DataError(f"{shown}: time_axis= is for arrays in MATLAB, HDF5 and .npy files; leave it out")
    return [each.with_time_axis(time_axis) for each in joined if isinstance(each, Nested)]


def _recordings_of(place: File | Folder, columns: Columns) -> list[tuple[str, list[File], LeRobot | None]]:
    if isinstance(place, File):
        return [(place.shown, [place], None)]
    if rosbag_reading.is_bag(place):
        return [(place.shown, [rosbag_reading.as_file(place)], None)]
    robot = lerobot.recognize(place)
    files = list(robot.files if robot else place.parquet_files())
    arrays = [] if files or robot else list(place.files(Npy.suffixes))
    if arrays and not belong_together(arrays):
        return [(file.shown, [file], None) for file in arrays]
    if arrays:
        return [(place.shown, arrays, None)]
    if not files:
        where = os.path.join(place.shown, "*.csv")
        raise DataError(
            f"{place.shown} is a folder without Parquet files: give its files, or a pattern such as {where}"
        )
    if robot is None and columns.state is None and Parquet(files[0]).declared() is not None:
        return [(file.shown, [file], None) for file in files]  # each counts its episodes by itself
    return [(place.shown, files, robot)]


def _recording(
    formats: list[Format],
    shown: str,
    name: str,
    stem: str,
    number: int,
    alone: bool,
    columns: Columns,
    preparation: Preparation,
    robot: LeRobot | None,
) -> Recording:
    filled = [each for each in formats if each.at_once or sum(each.row_groups) > 0]
    if not filled:
        raise DataError(f"{shown} has no samples")
    if robot is not None:
        count = sum(sum(each.row_groups) for each in formats)
        if robot.n_samples is not None and count != robot.n_samples:
            raise DataError(
                f"{shown} holds {count} samples where its meta/info.json says {robot.n_samples}; "
                "download the dataset again, or give its Parquet files themselves"
            )
        columns = _by_rate(columns, robot.assign(columns), preparation)
    header = filled[0].columns()
    declared = _declared(filled[0], columns)
    own = columns
    if declared is not None:
        own = _by_rate(columns, _with_declared(columns, declared), preparation)
        if not declared.saved:  # its notes are on what it takes for time
            notes = declared.notes if columns.time is None else ()
            declared = replace(declared, notes=tuple(f"{name}: {note}" for note in notes))
    if (
        columns.state is None
        and columns != Columns(topic=columns.topic)
        and (declared is None or not declared.saved)
    ):
        raise DataError(f"give state= too: other columns were given for {shown}, but no state columns")
    try:
        roles = assign_roles(header, own, declared, preparation, shown)
    except DataError as error:
        if declared is None or not declared.saved or columns != Columns():
            raise
        raise DataError(
            f"{shown} is damaged and cannot be read as saved demonstrations ({error!s:.300})"
        ) from error
    if robot is not None:
        roles = replace(
            roles,
            state_names=_robot_names(robot, roles.state, roles.state_names),
            action_names=_robot_names(robot, roles.action or roles.state, roles.action_names),
        )
    return Recording(shown, name, stem, number, alone, tuple(filled), roles, own, preparation, declared)


def _by_rate(given: Columns, found: Columns, preparation: Preparation) -> Columns:
    """Leave out the time that a file has of its own where a rate is given instead."""
    return replace(found, time=given.time) if preparation.rate is not None else found


def _declared(file: Format, columns: Columns) -> Declared | None:
    """Return what a file says of its columns, where that still matters beside what the user says."""
    try:
        declared = file.declared()
    except DataError:
        if columns.state is None:
            raise
        return None
    return declared if declared is None or columns.state is None or declared.columns.state is None else None


def _with_declared(columns: Columns, declared: Declared) -> Columns:
    own = declared.columns
    return replace(
        columns,
        state=columns.state if own.state is None else own.state,
        action=own.action if columns.action is None else columns.action,
        time=own.time if columns.time is None else columns.time,
        episode=own.episode if columns.episode is None else columns.episode,
    )


def _robot_names(robot: LeRobot, fields: Sequence[Field], names: tuple[str, ...]) -> tuple[str, ...]:
    """Call components as the dataset calls them."""
    called = []
    for field, name in zip(fields, names, strict=True):
        own = robot.component_names(field.column)
        derived = "_dot" if name.endswith("_dot") else ""
        called.append(own[field.component] + derived if own and field.component is not None else name)
    return tuple(called)
