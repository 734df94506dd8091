"""Demonstrations written as a table of text, for other programs to read."""

import os

from numpy.typing import NDArray

from unconstrain import atomic
from unconstrain.demonstrations import Demonstrations
from unconstrain.waiting import stage


def write_csv(demos: Demonstrations, path: str | os.PathLike[str]) -> None:
    """Write what a recording would hold to a CSV file: episodes, time, states and actions.

    The true policy and projections, which only simulation knows, are left out; `save` keeps them.

    Parameters
    ----------
    demos : Demonstrations
    path : path
        Of the file, which is replaced if it exists. Its columns are ``episode`` if there are several, ``t`` if there
        are times, the states and the actions by their names; a name that is taken gets a number.

    Raises
    ------
    UnconstrainError
        The place cannot be written to.
    """
    import pyarrow as pa
    import pyarrow.csv

    columns: dict[str, pa.Array] = {}
    wanted: list[tuple[str, NDArray]] = [
        (name, demos.states[:, i]) for i, name in enumerate(demos.state_names)
    ]
    wanted += [(name, demos.actions[:, i]) for i, name in enumerate(demos.action_names)]
    if demos.time is not None:
        wanted.insert(0, ("t", demos.time))
    if demos.n_episodes > 1:
        wanted.insert(0, ("episode", demos.episodes))
    for name, values in wanted:
        distinct, number = name, 1
        while distinct in columns:
            number += 1
            distinct = f"{name}_{number}"
        columns[distinct] = pa.array(values)
    with stage("writing"), atomic.replacing(path) as temporary:
        pyarrow.csv.write_csv(pa.table(columns), temporary)
