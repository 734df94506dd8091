"""A recording made of its files: which of their columns plays which role, by what the user and the files say."""

from collections.abc import Sequence
from dataclasses import replace

from unconstrain.errors import DataError
from unconstrain.recordings.columns import Columns
from unconstrain.recordings.formats.base import Declared, Format
from unconstrain.recordings.formats.lerobot import LeRobot
from unconstrain.recordings.preparation import Preparation
from unconstrain.recordings.recognizing import Found
from unconstrain.recordings.recording import Recording
from unconstrain.recordings.roles import Roles, assign_roles
from unconstrain.recordings.table import Field


def make_recording(
    found: Found, name: str, label: str, number: int, alone: bool, columns: Columns, preparation: Preparation
) -> Recording:
    """Make a recording of its files.

    Parameters
    ----------
    found : Found
    name, label : str
        What notes call it, and what its episodes are called after.
    number : int
        Which of the recordings it is.
    alone : bool
        Whether it is the only one.
    columns : Columns
        As given.
    preparation : Preparation
        As given.

    Returns
    -------
    Recording

    Raises
    ------
    DataError
        It has no samples, or no such columns, or they cannot be used.
    """
    shown, formats, robot = found
    filled = [each for each in formats if each.at_once or sum(each.row_groups) > 0]
    if not filled:
        raise DataError(f"{shown} has no samples")
    if robot is not None:
        _check_count(robot, formats, shown)
        columns = _by_rate(columns, robot.assign(columns), preparation)
    declared = _declared(filled[0], columns)
    saved = declared is not None and declared.saved
    own = columns
    if declared is not None:
        own = _by_rate(columns, _with_declared(columns, declared), preparation)
        if not saved:  # its notes are on what it takes for time
            notes = declared.notes if columns.time is None else ()
            declared = replace(declared, notes=tuple(f"{name}: {note}" for note in notes))
    if columns.state is None and columns != Columns(topic=columns.topic, part=columns.part) and not saved:
        raise DataError(f"give state= too: other columns were given for {shown}, but no state columns")
    try:
        roles = assign_roles(filled[0].columns(), own, declared, preparation, shown)
    except DataError as error:
        if not saved or columns != Columns():
            raise
        raise DataError(
            f"{shown} is damaged and cannot be read as saved demonstrations ({error!s:.300})"
        ) from error
    if robot is not None:
        roles = _with_names(roles, robot)
    return Recording(shown, name, label, number, alone, tuple(filled), roles, own, preparation, declared)


def _check_count(robot: LeRobot, formats: Sequence[Format], shown: str) -> None:
    count = sum(sum(each.row_groups) for each in formats)
    if robot.n_samples is not None and count != robot.n_samples:
        raise DataError(
            f"{shown} holds {count} samples where its meta/info.json says {robot.n_samples}; "
            "download the dataset again, or give its Parquet files themselves"
        )


def _by_rate(given: Columns, found: Columns, preparation: Preparation) -> Columns:
    """Leave out the time that a file has of its own where a rate is given instead."""
    return replace(found, time=given.time) if preparation.rate is not None else found


def _declared(file: Format, columns: Columns) -> Declared | None:
    """Return what a file says of its columns, where that still matters beside what the user says."""
    try:
        declared = file.declared()
    except DataError:
        if columns.state is None:
            raise
        return None
    return declared if declared is None or columns.state is None or declared.columns.state is None else None


def _with_declared(columns: Columns, declared: Declared) -> Columns:
    own = declared.columns
    return replace(
        columns,
        state=columns.state if own.state is None else own.state,
        action=own.action if columns.action is None else columns.action,
        time=own.time if columns.time is None else columns.time,
        episode=own.episode if columns.episode is None else columns.episode,
    )


def _with_names(roles: Roles, robot: LeRobot) -> Roles:
    """Call components as the dataset calls them."""

    def called(fields: Sequence[Field], names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(_name(robot, field, name) for field, name in zip(fields, names, strict=True))

    return replace(
        roles,
        state_names=called(roles.state, roles.state_names),
        action_names=called(roles.action or roles.state, roles.action_names),
    )


def _name(robot: LeRobot, field: Field, name: str) -> str:
    names = robot.component_names(field.column)
    if not names or field.component is None:
        return name
    return names[field.component] + ("_dot" if name.endswith("_dot") else "")
