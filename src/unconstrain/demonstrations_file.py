"""How demonstrations lie in files: which array is what, in an archive that NumPy opens, and in Parquet.

Both hold as JSON which columns play which role, and the names: the archive as any other (see `storage`), Parquet in the
metadata of its schema, under the key "unconstrain".
"""

import json
import os
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from unconstrain import atomic, storage
from unconstrain.errors import DataError
from unconstrain.waiting import stage

if TYPE_CHECKING:
    import pyarrow as pa

    from unconstrain.demonstrations import Demonstrations

FORMAT = 1
KEY = "unconstrain"
ARRAYS = ("states", "actions", "episodes", "time", "policy", "projections", "forces", "free")
NAMES = ("state_names", "action_names", "episode_labels", "notes")


def write(demos: "Demonstrations", path: str | os.PathLike[str]) -> None:
    """Write demonstrations to an NPZ or Parquet file, by suffix; see `Demonstrations.save`."""
    suffix = atomic.as_path(path).suffix.lower()
    if suffix not in (".npz", ".parquet", ".pq"):
        raise DataError(f"cannot save {path}: choose a name that ends in .npz or .parquet")
    if suffix == ".npz":
        found = arrays_of(demos)
        storage.write(
            path, storage.Kind.DEMONSTRATIONS, describe(demos, {name: name for name in found}), found
        )
        return
    import pyarrow.parquet as pq

    with stage("writing"), atomic.replacing(path) as temporary:
        pq.write_table(_table(demos), temporary, write_page_checksum=True)


def arrays_of(demos: "Demonstrations") -> dict[str, NDArray[Any]]:
    """Return the arrays that demonstrations have, by the names of the attributes."""
    arrays = {name: getattr(demos, name) for name in ARRAYS}
    return {name: array for name, array in arrays.items() if array is not None}


def describe(demos: "Demonstrations", roles: dict[str, Any]) -> dict[str, Any]:
    """Return what a file says of its columns: their roles, and the names and the noise that demonstrations have."""
    names = {name: list(getattr(demos, name)) for name in NAMES}
    space = {} if demos.space.is_flat else {"space": demos.space.describe()}
    noise = {} if demos.noise is None else {"noise": demos.noise}
    return {"format": FORMAT, **names, **space, **noise, "roles": roles}


def columns_of(demos: "Demonstrations") -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Return demonstrations as named columns, and which of them play which role.

    Parameters
    ----------
    demos : Demonstrations

    Returns
    -------
    columns : dict of str to array
        Of shape (N,); the projections (N, d, d) are one.
    roles : dict of str to str or list of str
        For each array of the demonstrations, its column or columns.
    """
    columns: dict[str, NDArray[Any]] = {}

    def add(wanted: str, values: NDArray[Any]) -> str:
        name, number = wanted, 1
        while name in columns:  # a state and an action may be called alike
            number += 1
            name = f"{wanted}_{number}"
        columns[name] = values
        return name

    roles: dict[str, Any] = {"episodes": add("episode", demos.episodes)}
    if demos.time is not None:
        roles["time"] = add("time", demos.time)
    forces = [] if demos.forces is None else [f"force.{i + 1}" for i in range(demos.forces.shape[1])]
    matrices = (
        ("states", demos.states, demos.state_names),
        ("actions", demos.actions, demos.action_names),
        ("policy", demos.policy, [f"policy.{name}" for name in demos.action_names]),
        ("forces", demos.forces, forces),
    )
    for role, matrix, names in matrices:
        if matrix is not None:
            roles[role] = [add(name, column) for name, column in zip(names, matrix.T, strict=True)]
    if demos.free is not None:
        roles["free"] = add("free", demos.free)
    if demos.projections is not None:
        roles["projections"] = add("projections", demos.projections)
    return columns, roles


def _table(demos: "Demonstrations") -> "pa.Table":
    import pyarrow as pa

    columns, roles = columns_of(demos)
    arrays = {}
    for name, values in columns.items():
        flat = pa.array(np.ascontiguousarray(values).reshape(-1))
        width = demos.actions.shape[1] ** 2
        arrays[name] = flat if values.ndim == 1 else pa.FixedSizeListArray.from_arrays(flat, width)
    return pa.table(arrays).replace_schema_metadata({KEY: json.dumps(describe(demos, roles))})
