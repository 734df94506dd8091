"""Opening a source, whatever it is: files, data frames, demonstrations in memory, or batches of arrays."""

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import fields, replace
from itertools import chain
from typing import Any

from unconstrain import demonstrations_file
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.recordings.assembling import make_recording
from unconstrain.recordings.batches import FORMS
from unconstrain.recordings.columns import GOAL, START, Columns
from unconstrain.recordings.deciding import decide_duration, decide_kind, decide_smoothing, decide_space
from unconstrain.recordings.files import label as label_files
from unconstrain.recordings.files import short_names
from unconstrain.recordings.formats.frame import Frame, is_frame
from unconstrain.recordings.formats.saved import InMemory
from unconstrain.recordings.preparation import Preparation
from unconstrain.recordings.recognizing import Found, open_formats
from unconstrain.recordings.recording import Recording
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
    found = Found("these demonstrations", [InMemory(arrays, about)])
    return _as_tables([make_recording(found, "", "", 0, True, columns, preparation)], preparation)


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
    alone = len(frames) == 1
    names = ["this frame"] if alone else [f"frame {number}" for number in range(len(frames))]
    recordings = [
        make_recording(Found(name, [Frame(frame, name)]), name, name, number, alone, columns, preparation)
        for number, (frame, name) in enumerate(zip(frames, names, strict=True))
    ]
    return _as_tables(recordings, preparation)


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
    every = open_formats(paths, columns, preparation.time_axis)
    shown = [found.shown for found in every]
    recordings = [
        make_recording(found, name, label, number, len(every) == 1, columns, preparation)
        for number, (found, name, label) in enumerate(
            zip(every, short_names(shown), label_files(shown), strict=True)
        )
    ]
    return _as_tables(recordings, preparation)


def _as_tables(recordings: Sequence[Recording], preparation: Preparation) -> Tables:
    """Make one source of recordings: where something has to be guessed, the first decides for all."""
    Tables(tuple(recordings)).check_alike()
    first = recordings[0]
    led = [first, *(replace(each, leader=first) for each in recordings[1:])]
    placed, notes = decide_space(led)
    smoothed = decide_smoothing(decide_kind(placed, preparation.action_is))
    timed, found = decide_duration(smoothed)
    return Tables(timed, (*notes, *found))
