"""LeRobot datasets: a folder with `meta/info.json`, and samples in Parquet files under `data/`.

Since v3.0 a file holds many episodes, `data/chunk-000/file-000.parquet`; in v2.0 and v2.1 one,
`data/chunk-000/episode_000000.parquet`. The columns used here are the same: `observation.state` and `action`, lists
whose components may have names in `info.json`, `episode_index`, and `timestamp` in seconds. Videos are not touched.
"""

import json
import os
from dataclasses import dataclass, replace
from typing import Any

import pyarrow as pa
import pyarrow.fs

from unconstrain.errors import DataError
from unconstrain.recordings.roles import Keys, Roles
from unconstrain.recordings.shards import Shards
from unconstrain.recordings.table import Key

STATE, ACTION, EPISODE, TIME = "observation.state", "action", "episode_index", "timestamp"
ABOUT = "meta/info.json"
VERSIONS = ("v2.0", "v2.1", "v3.0")


@dataclass(frozen=True)
class LeRobot:
    """What `meta/info.json` says, and the dataset's files."""

    shards: Shards
    features: dict[str, Any]

    def component_names(self, column: str) -> list[str]:
        """Names of a column's components, where there is one each."""
        about = self.features.get(column)
        about = about if isinstance(about, dict) else {}
        names, shape = about.get("names"), about.get("shape")
        if isinstance(names, dict):  # {"motors": [...]}, {"axes": [...]}
            names = [name for group in names.values() if isinstance(group, list) for name in group]
        fits = isinstance(names, list) and isinstance(shape, list) and shape == [len(names)]
        return [str(name) for name in names] if fits and isinstance(names, list) else []

    def roles(self, given: Roles) -> Roles:
        """The dataset's own columns in the roles that are not given; components that go by their names, by place."""
        return replace(
            given,
            state=self._by_place(STATE, STATE if given.state is None else given.state),
            action=self._by_place(ACTION, ACTION if given.action is None else given.action),
            episode=EPISODE if given.episode is None else given.episode,
            time=TIME if given.time is None else given.time,
        )

    def _by_place(self, column: str, keys: Keys) -> Keys:
        names = self.component_names(column)

        def by_place(key: Key) -> Key:
            # A column of that name comes first, as everywhere else.
            return f"{column}[{names.index(key)}]" if key in names and key not in self.features else key

        return by_place(keys) if isinstance(keys, Key) else [by_place(key) for key in keys]


def is_meant(folder: str | os.PathLike[str]) -> bool:
    """Whether a folder of this machine is a dataset of this kind."""
    return os.path.isfile(os.path.join(folder, ABOUT))


def opened(folder: str | os.PathLike[str]) -> LeRobot | None:
    """The dataset in a folder (or URI), or None where the folder is not of this kind.

    Raises `DataError` for a version not known, and for a dataset of which samples are missing.
    """
    shown = os.path.expanduser(os.fspath(folder))
    try:
        filesystem, path = (
            pyarrow.fs.FileSystem.from_uri(shown) if "://" in shown else (pyarrow.fs.LocalFileSystem(), shown)
        )
        meta = f"{path.rstrip('/')}/{ABOUT}"
        if filesystem.get_file_info(meta).type != pyarrow.fs.FileType.File:
            return None
        with filesystem.open_input_stream(meta) as file:
            text = file.read()
    except (OSError, pa.ArrowException) as error:
        raise DataError(f"{shown} cannot be opened ({str(error).splitlines()[0]})") from error
    try:
        info = json.loads(text)
        version, features = str(info["codebase_version"]), dict(info["features"])
        expected = int(info["total_frames"]) if "total_frames" in info else None
    except (ValueError, KeyError, TypeError) as error:
        raise DataError(
            f"{meta} is damaged or not of a LeRobot dataset; download the dataset again"
        ) from error
    if version not in VERSIONS:
        raise DataError(
            f"{shown} is a LeRobot dataset of version {version}, and those known are {', '.join(VERSIONS)}; "
            "convert it with LeRobot's own tools"
        )
    shards = Shards.find(f"{shown.rstrip('/')}/data")
    if expected is not None and shards.n_rows != expected:
        raise DataError(
            f"{shown} holds {shards.n_rows} samples where its meta/info.json says {expected}; "
            "download the dataset again, or give its Parquet files themselves"
        )
    return LeRobot(shards, features)
