"""LeRobot datasets: a folder with `meta/info.json`, and samples in Parquet files under `data/`.

Since v3.0 a file holds many episodes, `data/chunk-000/file-000.parquet`; in v2.0 and v2.1 one,
`data/chunk-000/episode_000000.parquet`. The columns used here are the same: `observation.state` and `action`, lists
whose components may have names in `info.json`, `episode_index`, and `timestamp` in seconds. Videos are not touched.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import pyarrow.fs

from unconstrain.errors import DataError
from unconstrain.recordings.columns import DIFFERENTIATE, Columns, Key, Keys
from unconstrain.recordings.files import File, Folder, named_errors

STATE, ACTION, EPISODE, TIME = "observation.state", "action", "episode_index", "timestamp"
ABOUT = "meta/info.json"
REVISION = "refs/main"
"""In the cache of the hub, the file that names the folder, below `snapshots`, in which a dataset is."""

VERSIONS = ("v2.0", "v2.1", "v3.0")
LONGEST_REVISION = 100

LARGEST_ABOUT = 64_000_000
"""Bytes of an `info.json` that is none."""


@dataclass(frozen=True)
class LeRobot:
    """A dataset: its files, and what `meta/info.json` says.

    Parameters
    ----------
    files : tuple of File
    n_samples : int or None
        How many samples there should be.
    features : mapping of str to dict
        What the columns are.
    """

    files: tuple[File, ...]
    n_samples: int | None
    features: Mapping[str, Any]

    def component_names(self, column: str) -> list[str]:
        """Return the names of a column's components, where there is one each."""
        about = self.features.get(column)
        about = about if isinstance(about, dict) else {}
        names, shape = about.get("names"), about.get("shape")
        if isinstance(names, dict):  # {"motors": [...]}, {"axes": [...]}
            names = [name for group in names.values() if isinstance(group, list) for name in group]
        if isinstance(names, list) and len(names) == 1 and isinstance(names[0], list):
            names = names[0]
        fits = isinstance(names, list) and isinstance(shape, list) and shape == [len(names)]
        return [str(name) for name in names] if fits and isinstance(names, list) else []

    def assign(self, given: Columns) -> Columns:
        """Return the dataset's own columns in the roles that are not given; components by place, not by name."""
        action = ACTION if given.action is None else given.action
        return replace(
            given,
            state=self._by_place(STATE, STATE if given.state is None else given.state),
            action=action if action == DIFFERENTIATE else self._by_place(ACTION, action),
            episode=EPISODE if given.episode is None else given.episode,
            time=TIME if given.time is None else given.time,
        )

    def _by_place(self, column: str, keys: Keys) -> Keys:
        names = self.component_names(column)

        def by_place(key: Key) -> Key:
            # A column of that name comes first, as everywhere else.
            return f"{column}[{names.index(key)}]" if key in names and key not in self.features else key

        return by_place(keys) if isinstance(keys, Key) else [by_place(key) for key in keys]


def find_snapshot(folder: Folder) -> Folder:
    """Return the dataset that a folder of the hub's cache holds, or the folder itself where it is another.

    Parameters
    ----------
    folder : Folder

    Returns
    -------
    Folder
    """
    revision = folder.file(REVISION)
    with named_errors(folder.shown):
        if revision.info.type != pyarrow.fs.FileType.File:
            return folder
        name = revision.begin(LONGEST_REVISION).decode(errors="replace").strip()
    inner = folder.file(f"snapshots/{name}")
    with named_errors(folder.shown):
        is_there = name.isalnum() and inner.info.type == pyarrow.fs.FileType.Directory
    return Folder(inner.shown, inner.path, inner.filesystem) if is_there else folder


def recognize(folder: Folder) -> LeRobot | None:
    """Open the dataset in a folder.

    Parameters
    ----------
    folder : Folder

    Returns
    -------
    LeRobot or None
        None where the folder is not of this kind.

    Raises
    ------
    DataError
        The version is not known, or the description is damaged.
    """
    about = folder.file(ABOUT)
    with named_errors(folder.shown):
        if about.info.type != pyarrow.fs.FileType.File:
            return None
    damaged = DataError(f"{about.shown} is damaged or not of a LeRobot dataset; download the dataset again")
    if about.info.size > LARGEST_ABOUT:
        raise damaged
    try:
        info = json.loads(about.read())
        version, features = str(info["codebase_version"]), dict(info["features"])
        expected = int(info["total_frames"]) if "total_frames" in info else None
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
        if isinstance(error, DataError):
            raise
        raise damaged from error
    if version not in VERSIONS:
        raise DataError(
            f"{folder.shown} is a LeRobot dataset of version {version}, and those known are {', '.join(VERSIONS)}; "
            "convert it with LeRobot's own tools"
        )
    return LeRobot(folder.parquet_files("data"), expected, features)
