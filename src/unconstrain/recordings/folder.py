"""Folders read at once: LeRobot datasets, and Parquet files that are parts of one recording."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from unconstrain.errors import DataError
from unconstrain.recordings import saved
from unconstrain.recordings.files import file_labels
from unconstrain.recordings.formats import lerobot
from unconstrain.recordings.roles import Roles
from unconstrain.recordings.shards import SUFFIXES, Shards
from unconstrain.recordings.table import Column, Table


def is_meant(shown: str) -> bool:
    """Whether this is a folder that can be read at once: one with Parquet files in it."""
    path = Path(shown)
    return path.is_dir() and any(file.suffix.lower() in SUFFIXES for file in path.rglob("*"))


def expanded(files: Sequence[str], roles: Roles) -> list[str]:
    """The files meant, with those of a folder in its place where each is a recording by itself, as `save` writes it."""
    expanded: list[str] = []
    for shown in files:
        if roles.state is None and is_meant(shown) and not lerobot.is_meant(shown):
            shards = Shards.find(shown)
            table, schema = shards.first_rows()
            if saved.roles(schema) is None:
                raise DataError(f"{shown}: give state=, the columns that are states; {table.listing()}")
            expanded += shards.paths
        else:
            expanded.append(shown)
    return expanded


def read(shown: str, roles: Roles) -> tuple[Table, Roles]:
    """The columns of a folder's Parquet files, one file after the other, and in which roles they are.

    Columns of a LeRobot dataset have known names, which stand in for roles not given, and may go by the names that the
    dataset gives to their components. Without an episode column every file is an episode. No other column is read.

    Raises `DataError` for files that cannot be read, and columns that do not exist or are not given.
    """
    robot = lerobot.opened(shown)
    shards = robot.shards if robot else Shards.find(shown)
    first, _ = shards.first_rows()
    if robot:
        roles = robot.roles(roles)
    found = roles.positions(first)
    chosen = [first.columns[at] for positions in found.values() for at in positions]
    pieces = list(shards.pieces(list(dict.fromkeys(column.part_of or column.name for column in chosen))))
    tables = [shards.table(piece, list(piece.rows.schema.names)) for piece in pieces]
    columns = [_joined(first.columns[i], role, tables) for role, where in found.items() for i in where]
    if robot:
        columns = [_renamed(column, robot) for column in columns]
    bounds = np.cumsum([0, *map(len, found.values())])
    at = {role: list(range(a, b)) for role, (a, b) in zip(found, pairwise(bounds.tolist()), strict=True)}
    if roles.episode is None:
        labels = file_labels([shards.name(i) for i in range(len(shards.paths))])
        columns.append(
            Column("", pa.array([labels[piece.file] for piece in pieces for _ in range(len(piece.rows))]))
        )
        at["episode"] = [len(columns) - 1]
    placed: dict[str, Any] = {
        role: where if role in ("state", "action", "force") else where[0] for role, where in at.items()
    }
    return Table(shown, columns, shards.places(pieces)), replace(roles, **placed)


def _joined(column: Column, role: str, tables: Sequence[Table]) -> Column:
    """A column of all pieces of the files."""
    parts: list[Any] = []
    for table in tables:
        whole = column.part_of in table.unusable  # an array that has another shape in this file
        (at,) = table.find(role, column.part_of if whole else column.name)
        values = table.columns[at].values
        parts += values.chunks if isinstance(values, pa.ChunkedArray) else [values]
    if len({part.type for part in parts}) > 1 and all(_is_number(part.type) for part in parts):
        parts = [part.cast(pa.float64()) for part in parts]  # files differ in precision
    try:
        return replace(column, values=pa.chunked_array(parts))
    except (pa.ArrowInvalid, TypeError) as error:
        kinds = " and ".join(sorted({str(part.type) for part in parts}))
        raise DataError(
            f"{tables[0].path} and the files beside it hold {kinds} in column {column.name!r}: write them alike, or "
            "load them one by one"
        ) from error


def _renamed(column: Column, robot: lerobot.LeRobot) -> Column:
    """A component by the name that the dataset gives it."""
    names = robot.component_names(column.part_of)
    return replace(column, name=names[column.component]) if names and column.component is not None else column


def _is_number(kind: pa.DataType) -> bool:
    return pa.types.is_floating(kind) or pa.types.is_integer(kind)
