"""Which recordings there are in a source, and of what formats their files are."""

import os
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import pyarrow.fs

from unconstrain.errors import DataError
from unconstrain.recordings.columns import Columns
from unconstrain.recordings.files import File, Folder, locate
from unconstrain.recordings.formats import FORMATS, lerobot, recognize, rosbag_reading
from unconstrain.recordings.formats.base import Format, foresee, narrow, narrow_to_part
from unconstrain.recordings.formats.lerobot import LeRobot
from unconstrain.recordings.formats.nested import Nested
from unconstrain.recordings.formats.npy import Npy, NpyFolder, belong_together
from unconstrain.recordings.formats.parquet import Parquet

ZARR = (".zgroup", ".zarray", "zarr.json")
"""Files by which a folder is a Zarr store."""


class Found(NamedTuple):
    """A recording of which it is not asked yet which column is what.

    Parameters
    ----------
    shown : str
        What the user calls it.
    formats : list of Format
        Its files, opened.
    robot : LeRobot or None
        The dataset that it is, if any.
    """

    shown: str
    formats: list[Format]
    robot: LeRobot | None = None


class _Located(NamedTuple):
    """The same, before its files are opened."""

    shown: str
    files: list[File]
    robot: LeRobot | None = None


def open_formats(
    paths: list[str | os.PathLike[str]], columns: Columns, time_axis: str | None = None
) -> list[Found]:
    """Find the files of each recording and their formats, without asking which column is what.

    Parameters
    ----------
    paths : list of path
        Files, folders, patterns and URIs.
    columns : Columns
        As given; they decide whether a folder of saved demonstrations is one recording, and name the topics of bags.
    time_axis : {"first", "last"}, optional
        Which axis of arrays is time; see `Preparation`.

    Returns
    -------
    list of Found
        In the order of the paths.

    Raises
    ------
    DataError
        There are no such files, or they are of no known format.
    """
    located = [each for place in locate(paths) for each in _recordings_of(place, columns)]
    every = [(file, each.robot is not None or len(each.files) > 1) for each in located for file in each.files]
    with ThreadPoolExecutor(16) as pool:  # footers are small and far apart
        opened = iter(list(pool.map(_open_file, every)))
    return [
        Found(
            shown,
            _joined(shown, [narrow(next(opened), columns.topics) for _ in files], time_axis, columns),
            robot,
        )
        for shown, files, robot in located
    ]


def _recordings_of(place: File | Folder, columns: Columns) -> list[_Located]:
    if isinstance(place, File):
        return [_Located(place.shown, [place])]
    if rosbag_reading.is_bag(place):
        return [_Located(place.shown, [rosbag_reading.as_file(place)])]
    place = lerobot.find_snapshot(place)
    robot = lerobot.recognize(place)
    files = list(robot.files if robot else place.parquet_files())
    arrays = [] if files or robot else list(place.files(Npy.suffixes))
    if arrays and not belong_together(arrays):
        return [_Located(file.shown, [file]) for file in arrays]
    if arrays:
        return [_Located(place.shown, arrays)]
    if not files:
        return [_Located(file.shown, [file]) for file in _files_of_one_kind(place)]
    if robot is None and columns.state is None and Parquet(files[0]).declared() is not None:
        return [_Located(file.shown, [file]) for file in files]  # each counts its episodes by itself
    return [_Located(place.shown, files, robot)]


def _files_of_one_kind(folder: Folder) -> list[File]:
    """Return the files of a folder, which are a recording each, as a pattern for them would."""
    if any(folder.file(name).info.type == pyarrow.fs.FileType.File for name in ZARR):
        raise DataError(
            f"{folder.shown} is a Zarr store, which is not read: save its arrays with numpy.savez or as HDF5, by the "
            "same names"
        )
    suffixes = tuple(suffix for kind in FORMATS for suffix in kind.suffixes)
    kinds = Counter(file.suffix for file in folder.files(suffixes))
    pattern = os.path.join(folder.shown, f"*{next(iter(kinds), '.csv')}")
    if len(kinds) == 1:
        return list(folder.files(next(iter(kinds))))
    holds = (
        f" ({', '.join(f'{number} {suffix}' for suffix, number in kinds.items())} are there)" if kinds else ""
    )
    raise DataError(
        f"{folder.shown} is a folder without Parquet files: give its files, or a pattern such as {pattern}{holds}"
    )


def _open_file(about: tuple[File, bool]) -> Format:
    file, in_folder = about
    opened = recognize(file)
    if in_folder and not isinstance(opened, Parquet | Npy):
        raise DataError(f"{file.shown} is damaged or not a Parquet file; write it again")
    if isinstance(opened, Parquet):
        opened.row_groups  # noqa: B018 - read here, side by side with those of other files
    return opened


def _joined(shown: str, formats: list[Format], time_axis: str | None, columns: Columns) -> list[Format]:
    """Make one format of the arrays of a folder, and say what is read of it; other files are read in turn."""
    arrays = [each for each in formats if isinstance(each, Npy)]
    joined: list[Format] = [NpyFolder(shown, arrays)] if len(arrays) == len(formats) > 1 else formats
    joined = [foresee(narrow_to_part(each, columns.part), columns) for each in joined]
    if time_axis is None:
        return joined
    if not all(isinstance(each, Nested) for each in joined):
        raise DataError(
            f"{shown}: time_axis= is for arrays in MATLAB, HDF5, .npz and .npy files; leave it out"
        )
    return [each.with_time_axis(time_axis) for each in joined if isinstance(each, Nested)]
