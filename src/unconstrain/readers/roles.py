"""Columns in their roles: which are states, which actions, which tell time and episodes."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.readers.stamps import seconds
from unconstrain.readers.table import Key, Table

Keys = Key | Sequence[Key]


def assigned(
    table: Table,
    label: str,
    one_of_several: bool,
    state: Keys | None,
    action: Keys | None,
    time: Key | None,
    episode: Key | None,
    time_unit: str | None,
    force: Keys | None = None,
    free: Key | None = None,
) -> Demonstrations:
    """The table's columns in their roles. Where no action column is given, the actions are still missing."""
    if state is None:
        raise DataError(f"{table.path} was not written by unconstrain, so say state=; {table.listing()}")
    if action is None and time is None:
        raise DataError(
            f"{table.path}: give action=, or time= so that the states can be differentiated; {table.listing()}"
        )
    at_state = _positions(table, "state", state)
    states = table.matrix("state", at_state)
    actions, action_names = None, [f"{name}_dot" for name in _names(table, at_state, "x")]
    if action is not None:
        at_action = _positions(table, "action", action)
        actions, action_names = table.matrix("action", at_action), _names(table, at_action, "u")
        if len(actions) != len(states):
            raise DataError(
                f"{table.path}: there are {len(states)} states but {len(actions)} actions; "
                "there must be one action per state"
            )
    forces = None if force is None else table.matrix("force", _positions(table, "force", force))
    flags = None if free is None else table.matrix("free", [_position(table, "free", free)])[:, 0]
    for name, values in (("forces", forces), ("free flags", flags)):
        if values is not None and len(values) != len(states):
            raise DataError(
                f"{table.path}: there are {len(states)} states but {len(values)} {name}; give one per state"
            )
    codes = np.zeros(len(states), dtype=np.int64)
    labels: tuple[str, ...] = (label,)
    if episode is not None:
        codes, labels = table.labels(_position(table, "episode", episode))
        if len(codes) != len(states):
            raise DataError(
                f"{table.path}: there are {len(states)} states but {len(codes)} episode values; "
                "there must be one per state"
            )
        if one_of_several:
            labels = tuple(f"{label}:{value}" for value in labels)
    stamps: NDArray[np.float64] | None = None
    notes: list[str] = []
    if time is not None:
        stamps, notes = seconds(table, _position(table, "time", time), codes, time_unit)
    return Demonstrations(
        states=states,
        actions=np.zeros_like(states) if actions is None else actions,
        episodes=codes,
        time=stamps,
        state_names=_names(table, at_state, "x"),
        action_names=action_names,
        episode_labels=labels,
        notes=notes,
        forces=forces,
        free=flags,
    )


def _positions(table: Table, role: str, keys: Keys) -> list[int]:
    each = [keys] if isinstance(keys, Key) or not isinstance(keys, Iterable) else keys
    positions = [position for key in each for position in table.find(role, key)]
    if not positions:
        raise DataError(f"no {role} columns were given for {table.path}; {table.listing()}")
    return positions


def _position(table: Table, role: str, key: Key) -> int:
    positions = _positions(table, role, key)
    if len(positions) > 1:
        raise DataError(f"{table.path}: {role} takes one column, but {key!r} stands for {len(positions)}")
    return positions[0]


def _names(table: Table, positions: list[int], letter: str) -> list[str]:
    names = [table.columns[position].name for position in positions]
    return [name or f"{letter}{i}" for i, name in enumerate(names, start=1)]
