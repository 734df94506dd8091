"""Columns in their roles: which are states, which actions, which tell time and episodes."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.recordings.stamps import seconds
from unconstrain.recordings.table import Key, Table

Keys = Key | Sequence[Key]

DIFFERENTIATE = "differentiate"


@dataclass(frozen=True)
class Roles:
    """Which columns are what, as the user says it: by name or position. Time, episode and free are one column each."""

    state: Keys | None = None
    action: Keys | None = None
    time: Key | None = None
    episode: Key | None = None
    force: Keys | None = None
    free: Key | None = None

    @property
    def differentiated(self) -> bool:
        """Whether the actions are the derivative of the states."""
        return self.action is None or self.action == DIFFERENTIATE

    def positions(self, table: Table) -> dict[str, list[int]]:
        """Where in a table the columns of each role are that is given.

        Raises `DataError` for columns that do not exist, and for several where one is wanted.
        """
        several = {
            "state": self.state,
            "action": None if self.differentiated else self.action,
            "force": self.force,
        }
        single = {"time": self.time, "episode": self.episode, "free": self.free}
        return {
            **{role: _positions(table, role, keys) for role, keys in several.items() if keys is not None},
            **{role: [_position(table, role, key)] for role, key in single.items() if key is not None},
        }


def assigned(
    table: Table, label: str, one_of_several: bool, roles: Roles, time_unit: str | None
) -> Demonstrations:
    """The table's columns in their roles. Where no action column is given, the actions are still missing."""
    if roles.state is None:
        raise DataError(f"{table.path} was not written by unconstrain, so say state=; {table.listing()}")
    if roles.differentiated and roles.time is None:
        raise DataError(
            f"{table.path}: give action=, or time= so that the states can be differentiated; {table.listing()}"
        )
    at = roles.positions(table)
    states = table.matrix("state", at["state"])
    actions, action_names = None, [f"{name}_dot" for name in _names(table, at["state"], "x")]
    if "action" in at:
        actions, action_names = table.matrix("action", at["action"]), _names(table, at["action"], "u")
        if len(actions) != len(states):
            raise DataError(
                f"{table.path}: there are {len(states)} states but {len(actions)} actions; "
                "there must be one action per state"
            )
    forces = table.matrix("force", at["force"]) if "force" in at else None
    flags = table.flags(at["free"][0]) if "free" in at else None
    for name, values in (("forces", forces), ("free flags", flags)):
        if values is not None and len(values) != len(states):
            raise DataError(
                f"{table.path}: there are {len(states)} states but {len(values)} {name}; give one per state"
            )
    codes = np.zeros(len(states), dtype=np.int64)
    labels: tuple[str, ...] = (label,)
    if "episode" in at:
        codes, labels = table.labels(at["episode"][0])
        if len(codes) != len(states):
            raise DataError(
                f"{table.path}: there are {len(states)} states but {len(codes)} episode values; "
                "there must be one per state"
            )
        if one_of_several:
            labels = tuple(f"{label}:{value}" for value in labels)
    stamps: NDArray[np.float64] | None = None
    notes: list[str] = []
    if "time" in at:
        stamps, notes = seconds(table, at["time"][0], codes, time_unit)
    return Demonstrations(
        states=states,
        actions=np.zeros_like(states) if actions is None else actions,
        episodes=codes,
        time=stamps,
        state_names=_names(table, at["state"], "x"),
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
