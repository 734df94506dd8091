"""Demonstrations written as a LeRobot dataset of version 3.0, for programs that learn from these."""

import json
import os
import shutil
import uuid
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from unconstrain import atomic
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.recordings.formats.lerobot import ABOUT, ACTION, STATE
from unconstrain.recordings.steps import runs

if TYPE_CHECKING:
    import pyarrow as pa

Array = NDArray[np.float64]

DATA = "data/chunk-000/file-000.parquet"
EPISODES = "meta/episodes/chunk-000/file-000.parquet"
TASKS = "meta/tasks.parquet"
STATS = "meta/stats.json"
TASK = "recorded movement"
"""What the one task is called."""

EVEN = 1e-3
"""Steps that differ by less than this share are even, and are not interpolated."""


def write_lerobot(
    demos: Demonstrations, path: str | os.PathLike[str], *, fps: float | None = None, overwrite: bool = False
) -> Demonstrations:
    """Write demonstrations as a LeRobot dataset of version 3.0.

    Written are `observation.state`, `action` (which are velocities), `timestamp`, `frame_index`, `episode_index`,
    `index` and `task_index`, the description of these, one task, the list of episodes, and statistics of the whole.
    Not written are statistics of each episode, forces, flags, projections and notes.

    Parameters
    ----------
    demos : Demonstrations
    path : path
        Of the folder.
    fps : float, optional
        Samples a second, a whole number. States and actions are interpolated linearly to that rate; without times,
        samples are taken to follow each other at that rate. By default the rate that the samples have.
    overwrite : bool
        Whether a LeRobot dataset that is there is replaced.

    Returns
    -------
    Demonstrations
        As they were written.

    Raises
    ------
    DataError
        The rate is uneven or not a whole number and no `fps` is given, or the folder exists.
    """
    target = atomic.as_path(path)
    check_folder(target, overwrite=overwrite)
    rate = _rate(demos, fps)
    written = _on_grid(demos, rate)
    temporary = target.with_name(f".{target.name}.{uuid.uuid4().hex[:12]}")
    try:
        _write(written, rate, temporary)
        _move(temporary, target)
    except OSError as error:
        raise DataError(f"{path} cannot be written: {(error.strerror or str(error)).lower()}") from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return written


def check_folder(path: Path, *, overwrite: bool) -> None:
    """Raise `DataError` for a folder that must not be replaced, or cannot be made."""
    if not path.parent.is_dir():
        raise DataError(f"there is no folder {path.parent} to write {path.name} into; make it first")
    if not os.path.lexists(path) or (path.is_dir() and not any(path.iterdir())):
        return
    if not overwrite:
        raise DataError(f"{path} exists: give overwrite= to replace it, or another name with out=")
    if not (path / ABOUT).is_file():
        raise DataError(
            f"{path} is not a LeRobot dataset, so it is not replaced: choose another name with out="
        )


def _rate(demos: Demonstrations, fps: float | None) -> int:
    if fps is not None:
        if not (np.isfinite(fps) and fps >= 1 and fps == round(fps)):
            raise DataError(f"fps must be a whole number of samples a second, got {fps:g}")
        return round(fps)
    if demos.time is None:
        raise DataError("these recordings have no time: give fps=, the number of samples a second")
    steps = np.concatenate([np.diff(demos.time[own]) for own in runs(demos.episodes)])
    step = float(np.median(steps)) if len(steps) else 0.0
    even = step > 0 and bool(np.all(np.abs(steps - step) < 0.1 * step))
    if not even or abs(1 / step - round(1 / step)) > 0.02 / step:
        seen = f"about {1 / step:.6g} samples a second" if step > 0 else "no two samples in an episode"
        raise DataError(
            f"a LeRobot dataset has a whole number of samples a second, evenly, and here there are {seen}: give fps="
        )
    return round(1 / step)


def _on_grid(demos: Demonstrations, rate: int) -> Demonstrations:
    """Return demonstrations with times that are multiples of 1 / rate in each episode."""
    X, U, codes, times = [], [], [], []
    for code, own in enumerate(runs(demos.episodes)):
        states, actions = demos.states[own], demos.actions[own]
        count = len(own)
        if demos.time is not None:
            t = demos.time[own] - demos.time[own][0]
            if np.abs(t - np.arange(count) / rate).max() > EVEN / rate:
                count = int(np.floor(t[-1] * rate + 1e-6)) + 1
                grid = np.arange(count) / rate
                states, actions = (
                    np.stack([np.interp(grid, t, column) for column in values.T], axis=1)
                    for values in (states, actions)
                )
        X.append(states)
        U.append(actions)
        codes.append(np.full(count, code))
        times.append(np.arange(count) / rate)
    return Demonstrations(
        np.concatenate(X),
        np.concatenate(U),
        episodes=np.concatenate(codes),
        time=np.concatenate(times),
        state_names=demos.state_names,
        action_names=demos.action_names,
    )


def _write(demos: Demonstrations, rate: int, folder: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    assert demos.time is not None
    lengths = np.bincount(demos.episodes).astype(np.int64)
    ends = np.cumsum(lengths)
    index = np.arange(len(demos))
    frames = index - np.repeat(ends - lengths, lengths)
    columns: dict[str, Any] = {
        STATE: _lists(demos.states),
        ACTION: _lists(demos.actions),
        "timestamp": pa.array(demos.time.astype(np.float32)),
        "frame_index": pa.array(frames),
        "episode_index": pa.array(demos.episodes.astype(np.int64)),
        "index": pa.array(index),
        "task_index": pa.array(np.zeros(len(demos), np.int64)),
    }
    count = len(lengths)
    zeros = pa.array(np.zeros(count, np.int64))
    episodes = {
        "episode_index": pa.array(np.arange(count)),
        "tasks": pa.array([[TASK]] * count),
        "length": pa.array(lengths),
        "data/chunk_index": zeros,
        "data/file_index": zeros,
        "dataset_from_index": pa.array(ends - lengths),
        "dataset_to_index": pa.array(ends),
        "meta/episodes/chunk_index": zeros,
        "meta/episodes/file_index": zeros,
    }
    for name in (DATA, EPISODES):
        (folder / name).parent.mkdir(parents=True)
    pq.write_table(pa.table(columns), folder / DATA)
    pq.write_table(pa.table(episodes), folder / EPISODES)
    pq.write_table(_tasks(), folder / TASKS)
    numbers = {STATE: demos.states, ACTION: demos.actions, "timestamp": demos.time[:, None]}
    stats = {name: _statistics(values) for name, values in numbers.items()}
    (folder / STATS).write_text(json.dumps(stats, indent=4), encoding="utf-8")
    about = _describe(demos, rate, count)
    (folder / ABOUT).write_text(json.dumps(about, indent=4), encoding="utf-8")


def _describe(demos: Demonstrations, rate: int, n_episodes: int) -> dict[str, Any]:
    def feature(kind: str, names: Sequence[str] | None) -> dict[str, Any]:
        listed = None if names is None else list(names)
        return {"dtype": kind, "shape": [1 if names is None else len(names)], "names": listed}

    return {
        "codebase_version": "v3.0",
        "robot_type": None,
        "total_episodes": n_episodes,
        "total_frames": len(demos),
        "total_tasks": 1,
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": rate,
        "splits": {"train": f"0:{n_episodes}"},
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "video_path": None,
        "features": {
            STATE: feature("float32", demos.state_names),
            ACTION: feature("float32", demos.action_names),
            "timestamp": feature("float32", None),
            "frame_index": feature("int64", None),
            "episode_index": feature("int64", None),
            "index": feature("int64", None),
            "task_index": feature("int64", None),
        },
    }


def _tasks() -> "pa.Table":
    """Make the table of tasks, whose index LeRobot reads by pandas."""
    import pyarrow as pa

    table = pa.table({"task_index": pa.array([0], pa.int64()), "task": pa.array([TASK])})

    def column(name: str, kind: str, stored: str) -> dict[str, Any]:
        return {
            "name": name, "field_name": name, "pandas_type": kind, "numpy_type": stored, "metadata": None,
        }  # fmt: skip

    about = {
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": [column("task_index", "int64", "int64"), column("task", "unicode", "object")],
        "creator": {"library": "pyarrow", "version": pa.__version__},
        "pandas_version": "2.0.0",
    }
    return table.replace_schema_metadata({"pandas": json.dumps(about)})


def _statistics(values: Array) -> dict[str, list]:
    return {
        "min": values.min(axis=0).tolist(),
        "max": values.max(axis=0).tolist(),
        "mean": values.mean(axis=0).tolist(),
        "std": values.std(axis=0).tolist(),
        "count": [len(values)],
    }


def _lists(values: Array) -> "pa.Array":
    import pyarrow as pa

    flat = pa.array(np.ascontiguousarray(values, dtype=np.float32).reshape(-1))
    return pa.FixedSizeListArray.from_arrays(flat, values.shape[1])


def _move(temporary: Path, target: Path) -> None:
    """Move a folder over another, which comes back if that fails."""
    with suppress(OSError):
        target.rmdir()  # an empty one
    if not target.exists():
        temporary.rename(target)
        return
    old = temporary.with_name(f"{temporary.name}.old")
    target.rename(old)
    try:
        temporary.rename(target)
    except BaseException:
        old.rename(target)
        raise
    shutil.rmtree(old, ignore_errors=True)
