"""Demonstrations written to a file and read back, exactly: what simulation knows and CSV cannot hold."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from unconstrain import atomic
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.recordings.formats import npz, parquet

FORMAT = 1
KEY = "unconstrain"  # of the JSON text, in NPZ as an array, in Parquet as schema metadata
ARRAYS = ("states", "actions", "episodes", "time", "policy", "projections", "forces", "free")
NAMES = ("state_names", "action_names", "episode_labels", "notes")


def save(demos: Demonstrations, path: str | os.PathLike[str]) -> None:
    """Write demonstrations to an NPZ or Parquet file, by suffix; `load(path)` gives them back exactly.

    NPZ holds the arrays under the names of the fields. Parquet holds one column per state, action and
    true-policy dimension, forces and free flags likewise, the projections as lists of d², row by row, and in its
    schema metadata, as JSON, which columns play which role.

    Raises
    ------
    UnconstrainError
        Another suffix, or a place that cannot be written to.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (".npz", ".parquet", ".pq"):
        raise DataError(f"cannot save {path}: choose a name that ends in .npz or .parquet")
    about: dict[str, Any] = {"format": FORMAT} | {name: list(getattr(demos, name)) for name in NAMES}
    with atomic.replacing(path) as temporary:
        if suffix == ".npz":
            arrays = {name: getattr(demos, name) for name in ARRAYS}
            found: dict[str, Any] = {name: array for name, array in arrays.items() if array is not None}
            with temporary.open("wb") as file:
                np.savez(file, **found | {KEY: np.array(json.dumps(about))})
        else:
            pq.write_table(_table(demos, about), temporary, write_page_checksum=True)


def read_saved(path: Path, shown: str) -> Demonstrations | None:
    """What `save` wrote, or None where the file is not of its making.

    Raises
    ------
    DataError
        The file is damaged, or written by a newer release.
    """
    if path.suffix.lower() == ".npz":
        found, _ = npz.arrays(path, shown)
        text = str(found[KEY]) if KEY in found and found[KEY].shape == () else None
        source: Any = found
    elif path.suffix.lower() in (".parquet", ".pq"):
        source = parquet.whole(path, shown)
        text = (source.schema.metadata or {}).get(KEY.encode())
    else:
        return None
    if text is None:
        return None
    try:
        about = json.loads(text)
        if about["format"] > FORMAT:
            raise DataError(f"{shown} was written by a newer release of unconstrain; upgrade to read it")
        arrays = source if isinstance(source, dict) else _columns(source, about["roles"])
        used, codes = np.unique(arrays["episodes"], return_inverse=True)  # rows may have been filtered since
        names: dict[str, Any] = {name: tuple(about[name]) for name in NAMES}
        names["episode_labels"] = tuple(names["episode_labels"][code] for code in used)
        given: dict[str, Any] = {
            name: arrays[name] for name in ARRAYS if name in arrays and name != "episodes"
        }
        return Demonstrations(episodes=codes, **given, **names)
    except (KeyError, IndexError, TypeError, AttributeError, ValueError) as error:
        if isinstance(error, DataError) and "newer release" in str(error):
            raise
        reason = f" ({error})" if isinstance(error, DataError) else ""
        raise DataError(f"{shown} is damaged and cannot be read as saved demonstrations{reason}") from error


def roles(schema: pa.Schema) -> dict[str, Any] | None:
    """Which columns of a Parquet file that `save` wrote play which role, or None where it is not of its making.

    "states" and "actions" are lists of names, "episodes" and "time" (where there is one) names.
    """
    try:
        about = json.loads((schema.metadata or {})[KEY.encode()])
        found: dict[str, Any] = about["roles"]
        return (
            found if about["format"] <= FORMAT and {"states", "actions", "episodes"} <= set(found) else None
        )
    except (KeyError, TypeError, ValueError):
        return None


def _table(demos: Demonstrations, about: dict[str, Any]) -> pa.Table:
    columns: dict[str, pa.Array] = {}

    def add(wanted: str, values: pa.Array) -> str:
        name, number = wanted, 1
        while name in columns:  # a state and an action may be called alike
            number += 1
            name = f"{wanted}_{number}"
        columns[name] = values
        return name

    roles: dict[str, Any] = {"episodes": add("episode", pa.array(demos.episodes))}
    if demos.time is not None:
        roles["time"] = add("time", pa.array(demos.time))
    matrices = (
        ("states", demos.states, demos.state_names),
        ("actions", demos.actions, demos.action_names),
        ("policy", demos.policy, [f"policy.{name}" for name in demos.action_names]),
    )
    for role, matrix, names in matrices:
        if matrix is not None:
            roles[role] = [
                add(name, pa.array(np.ascontiguousarray(column)))
                for name, column in zip(names, matrix.T, strict=True)
            ]
    if demos.forces is not None:
        roles["forces"] = [
            add(f"force.{i + 1}", pa.array(np.ascontiguousarray(column)))
            for i, column in enumerate(demos.forces.T)
        ]
    if demos.free is not None:
        roles["free"] = add("free", pa.array(demos.free))
    if demos.projections is not None:
        flat = pa.array(np.ascontiguousarray(demos.projections).reshape(-1))
        lists = pa.FixedSizeListArray.from_arrays(flat, demos.actions.shape[1] ** 2)
        roles["projections"] = add("projections", lists)
    return pa.table(columns).replace_schema_metadata({KEY: json.dumps(about | {"roles": roles})})


def _columns(table: pa.Table, roles: dict[str, Any]) -> dict[str, np.ndarray]:
    def flat(name: str) -> np.ndarray:
        return table.column(name).to_numpy()

    arrays: dict[str, np.ndarray] = {n: flat(roles[n]) for n in ("episodes", "time", "free") if n in roles}
    for role in ("states", "actions", "policy", "forces"):
        if role in roles:
            arrays[role] = np.column_stack([flat(name) for name in roles[role]])
    if "projections" in roles:
        d = len(roles["actions"])
        lists = table.column(roles["projections"]).combine_chunks()
        arrays["projections"] = lists.flatten().to_numpy().reshape(-1, d, d)
    return arrays
