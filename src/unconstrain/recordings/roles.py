"""Which fields of a recording play which role."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from unconstrain.errors import DataError
from unconstrain.recordings.columns import GOAL, NO_ANGLE, START, Columns, Keys
from unconstrain.recordings.formats.base import ColumnKey, Declared
from unconstrain.recordings.preparation import Preparation
from unconstrain.recordings.table import Field, Header

UNNAMED = re.compile(r"[xu]\d+(_dot)?")
"""What columns without a header are called."""


@dataclass(frozen=True)
class Roles:
    """Which fields of a recording's files play which role; none where no field does.

    Parameters
    ----------
    state, action, force, policy, reference : tuple of Field
    time, episode, free : Field or None
    projections : tuple of (str, int)
        Columns.
    state_names, action_names : tuple of str
    angle : tuple of int or None
        Which of the states are angles; None where that is to be found.
    rotations : tuple of tuple of int
        Which of the states are a rotation, for each.
    reference_names : tuple of str
        Of `reference`.
    """

    state: tuple[Field, ...]
    action: tuple[Field, ...]
    force: tuple[Field, ...]
    policy: tuple[Field, ...]
    reference: tuple[Field, ...]
    time: Field | None
    episode: Field | None
    free: Field | None
    projections: tuple[ColumnKey, ...]
    state_names: tuple[str, ...]
    action_names: tuple[str, ...]
    angle: tuple[int, ...] | None = None
    rotations: tuple[tuple[int, ...], ...] = ()
    reference_names: tuple[str, ...] = ()

    @property
    def n_actions(self) -> int:
        """The number d of action dimensions; a rotation has three, in however many numbers it is written."""
        if self.action:
            return len(self.action)
        return len(self.state) - sum(len(rotation) - 3 for rotation in self.rotations)


def assign_roles(
    header: Header, columns: Columns, declared: Declared | None, preparation: Preparation, shown: str
) -> Roles:
    """Find the fields that play the roles which the user, or else the file, names.

    Parameters
    ----------
    header : Header
        Of the first file.
    columns : Columns
        As the user gives them, with the file's own where those are taken.
    declared : Declared or None
        What the file says of columns that no user gives.
    preparation : Preparation
    shown : str
        The recording, as the user calls it.

    Returns
    -------
    Roles

    Raises
    ------
    DataError
        Columns that do not exist, are not given, or do not fit each other.
    """
    if columns.state is None:
        raise DataError(f"{shown}: give state=, the columns that are states; {header.listing()}")
    if columns.differentiated and columns.time is None and preparation.rate is None:
        raise DataError(
            f"{shown}: give action=, or time= so that the states can be differentiated, or rate= where no column holds "
            f"time; {header.listing()}"
        )
    state = header.find("state", columns.state)
    action: tuple[Field, ...] = ()
    if not columns.differentiated:
        assert columns.action is not None
        action = header.find("action", columns.action)
    own = declared if declared is not None and declared.saved else None
    chosen = not (columns.force is columns.free is columns.projections is None)
    force = columns.force if own is None or chosen else own.force
    free = columns.free if own is None or chosen else own.free
    stored = columns.projections if own is None or chosen else own.projections
    names = _names(header, state, "x")
    roles = Roles(
        state,
        action,
        () if force is None else header.find("force", force),
        () if own is None or own.policy is None or not action else header.find("policy", own.policy),
        _reference(header, columns),
        None if columns.time is None else header.find_one("time", columns.time),
        None if columns.episode is None else header.find_one("episode", columns.episode),
        None if free is None else header.find_one("free", free),
        (),
        names if own is None or own.state_names is None else own.state_names,
        tuple(f"{name}_dot" for name in names) if not action else _names(header, action, "u"),
    )
    if own is not None and own.action_names is not None and action:
        roles = replace(roles, action_names=own.action_names)
    found = _among_states(header, "angle", columns.angle, roles, shown)
    roles = replace(
        roles,
        angle=found,
        rotations=_group(_among_states(header, "rotation", columns.rotation, roles, shown) or (), shown),
        reference_names=_names(header, roles.reference, "r"),
    )
    if stored is not None:
        roles = replace(roles, projections=_projection_columns(header, stored, roles.n_actions))
    _check_lengths(header, roles, shown)
    needs_time = ("gap", "max_speed", "min_duration", "resample", "moving_centre")
    untimed = [name for name in needs_time if getattr(preparation, name) is not None]
    untimed += [f'drop="{what}"' for what in ("duplicates", "pauses") if preparation.drops(what)]
    untimed += ["relative_to"] if roles.reference else []  # such columns may move
    untimed += ["order"] if preparation.order > 1 else []
    untimed += ["phase"] if preparation.phase else []
    if untimed and roles.time is None and preparation.rate is None:
        raise DataError(
            f"{shown}: {untimed[0]} needs to know the time of each sample; give time= or rate= too"
        )
    if preparation.force_threshold is not None:
        if not roles.force:
            raise DataError("force_threshold= is for forces: name their columns with force=")
        if len(roles.force) != roles.n_actions:
            raise DataError(
                f"there are {len(roles.force)} force columns and {roles.n_actions} actions: give one for each action, "
                "or save what constraints.from_forces makes of them and of the Jacobian, and name that with "
                "projections="
            )
    return roles


def _reference(header: Header, columns: Columns) -> tuple[Field, ...]:
    keys = columns.relative_to
    return () if keys is None or keys in (START, GOAL) else header.find("relative_to", keys)


def _among_states(
    header: Header, role: str, keys: Keys | None, roles: Roles, shown: str
) -> tuple[int, ...] | None:
    """Find which of the states columns are; None where none are given."""
    if keys is None:
        return None
    if keys == NO_ANGLE:
        return ()
    found = header.find(role, keys)
    foreign = [field.called for field in found if field not in roles.state]
    if foreign:
        raise DataError(f"{shown}: {role}= names states, and {foreign[0]} is none; name it with state= too")
    return tuple(roles.state.index(field) for field in found)


def _group(columns: tuple[int, ...], shown: str) -> tuple[tuple[int, ...], ...]:
    """Cut the columns of several rotations into those of each."""
    for width in (4, 9, 3):
        if len(columns) % width == 0:
            return tuple(columns[i : i + width] for i in range(0, len(columns), width))
    raise DataError(
        f"{shown}: rotation= takes four columns of a quaternion, three of a rotation vector or of roll, pitch and yaw, "
        f"or nine of a matrix, for each rotation, and stands for {len(columns)} here"
    )


def _projection_columns(header: Header, keys: Keys, d: int) -> tuple[ColumnKey, ...]:
    each = [keys] if isinstance(keys, str | int) else list(keys)
    name = each[0] if len(each) == 1 else None
    if isinstance(name, str) and name in header.lists:
        return ((name, 0),)  # of what length its lists are, the first row need not tell: it may be empty
    found = header.find("projections", each)
    if len(found) != d**2 or any(field.component is not None for field in found):
        raise DataError(
            f"projections= takes one column of lists of {d**2} numbers, or {d**2} columns of numbers, row by row of "
            f"the {d} x {d} matrix, but {keys!r} stands for {len(found)}"
        )
    return tuple(field.key for field in found)


def _check_lengths(header: Header, roles: Roles, shown: str) -> None:
    n_states = header.length(roles.state[0])
    single = (("time", roles.time), ("episode", roles.episode), ("free", roles.free))
    several = (
        ("state", roles.state),
        ("action", roles.action),
        ("force", roles.force),
        ("reference", roles.reference),
    )
    each = [(role, field) for role, fields in several for field in fields]
    each += [(role, field) for role, field in single if field is not None]
    for role, field in each:
        length = header.length(field)
        if length == n_states:
            continue
        words = {
            "state": f"{field.called} has {length} values for state but {roles.state[0].called} has {n_states}; they "
            "must be equally long",
            "action": f"there are {n_states} states but {length} actions; there must be one action per state",
            "time": f"{field.called} has {length} stamps for {n_states} samples; there must be one per sample",
            "episode": f"there are {n_states} states but {length} episode values; there must be one per state",
            "force": f"there are {n_states} states but {length} forces; give one per state",
            "reference": f"there are {n_states} states but {length} values that they are relative to; give one per "
            "state",
            "free": f"there are {n_states} states but {length} free flags; give one per state",
        }
        raise DataError(f"{shown}: {words[role]}")
    for key in roles.projections:
        length = header.lists[key[0]][1] if key[0] in header.lists else n_states
        if length != n_states:
            raise DataError(
                f"{shown}: there are {n_states} states but {length} projections; give one per state"
            )


def is_named(names: Sequence[str]) -> bool:
    """Whether a file has names for its columns, other than those they get where it has none."""
    return not all(map(UNNAMED.fullmatch, names))


def _names(header: Header, fields: Sequence[Field], letter: str) -> tuple[str, ...]:
    called = {(each.part_of or each.name, each.nth, each.component): each.name for each in header.columns}
    names = [called[field.column, field.nth, field.component] for field in fields]
    return tuple(name or f"{letter}{i}" for i, name in enumerate(names, start=1))
