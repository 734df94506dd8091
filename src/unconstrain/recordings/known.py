"""What files tell of constraints: the projections themselves, or forces and flags that projections are made of."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from unconstrain.arrays import NOT_IDEMPOTENT, not_idempotent
from unconstrain.constraints import from_recording
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.recordings.blocks import Array
from unconstrain.recordings.reading import Reading
from unconstrain.recordings.shards import Field, Piece, Shards


@dataclass(frozen=True)
class Known:
    """The columns that tell of the constraints on actions of `d` dimensions.

    projections: one column of lists of d² numbers, row by row, or d² columns; empty or NaN where not known.
    force, force_threshold, free: columns of forces and of flags, of which `constraints.from_recording` makes them.
    """

    d: int
    projections: tuple[str, ...] = ()
    force: tuple[Field, ...] = ()
    force_threshold: float | None = None
    free: tuple[Field, ...] = ()

    @classmethod
    def asked(
        cls,
        reading: Reading,
        fields: Callable[[str, Any], tuple[Field, ...]],
        schema: pa.Schema,
        d: int,
    ) -> "Known | None":
        """What `reading` names, or None where it names nothing of the kind; `fields` finds the columns of a role.

        Raises `DataError` for columns that do not exist, or are not as many as d actions need.
        """
        if reading.projections is not None:
            return cls(d, _matrix_columns(reading.projections, fields, schema, d))
        if reading.force is None and reading.free is None:
            return None
        force = () if reading.force is None else fields("force", reading.force)
        if force and len(force) != d:
            raise DataError(
                f"there are {len(force)} force columns and {d} actions: give one for each action, or save what "
                "constraints.from_forces makes of them and of the Jacobian, and name that with projections="
            )
        free = () if reading.free is None else fields("free", reading.free)
        if len(free) > 1:
            raise DataError(f"free takes one column, but {reading.free!r} stands for {len(free)}")
        return cls(d, (), force, reading.force_threshold, free)

    @property
    def columns(self) -> list[str]:
        """Names of the columns to be read."""
        return [*self.projections, *(field.column for field in (*self.force, *self.free))]

    @property
    def of_whole_episodes(self) -> bool:
        """Whether a sample's constraint depends on its neighbours: forces are filtered over time."""
        return bool(self.force)

    def told(self, shards: Shards, pieces: Sequence[Piece]) -> dict[str, Any]:
        """What pieces of the files say, under the names that `Demonstrations` has for it.

        Raises `DataError` that names file, column and row of what cannot be.
        """
        if self.projections:
            return {"projections": np.concatenate([self._projections(shards, piece) for piece in pieces])}
        told: dict[str, Any] = {}
        if self.force:
            told["forces"] = shards.numbers(pieces, self.force, "force").T
        if self.free:
            told["free"] = np.concatenate([self._flags(shards, piece) for piece in pieces])
        return told

    def of(self, demos: Demonstrations, shown: str) -> Array:
        """The projections (N, d, d) of demonstrations that hold what was told; NaN where not known.

        `shown` is where they are from.
        """
        if self.projections:
            assert demos.projections is not None
            return demos.projections
        return from_recording(demos, force_threshold=self.force_threshold)

    def _projections(self, shards: Shards, piece: Piece) -> Array:
        N = shards.sparse(piece, self.projections, self.d**2)
        bad = ~np.isfinite(N).all(axis=1) & ~np.isnan(N).all(axis=1)
        if bad.any():
            at = int(np.argmax(bad))
            raise DataError(
                f"{shards.name(piece.file)}: the projection at row {piece.first + at} (counted from 0) is neither "
                "finite numbers throughout nor NaN throughout: correct it, or make all of it NaN"
            )
        N = N.reshape(-1, self.d, self.d)
        odd = not_idempotent(N)
        if len(odd):
            place = f"row {piece.first + odd[0]} (counted from 0)"
            raise DataError(f"{shards.name(piece.file)}: the projection at {place} {NOT_IDEMPOTENT}")
        return N

    def _flags(self, shards: Shards, piece: Piece) -> Array:
        (field,) = self.free
        table = shards.table(piece, [field.column])
        key = field.column if field.component is None else f"{field.column}[{field.component}]"
        flags = table.flags(*table.find("free", key))
        odd = np.flatnonzero((flags != 0) & (flags != 1))
        if len(odd):
            raise DataError(
                f"{shards.name(piece.file)}: column {field.column!r} holds {flags[odd[0]]:g} at row "
                f"{piece.first + odd[0]} (counted from 0), but free is 1 (nothing constrains the motion) or 0"
            )
        return flags


def _matrix_columns(
    keys: Any, fields: Callable[[str, Any], tuple[Field, ...]], schema: pa.Schema, d: int
) -> tuple[str, ...]:
    each = [keys] if isinstance(keys, str | int) else list(keys)
    name = each[0] if len(each) == 1 else None
    if isinstance(name, str) and schema.names.count(name) == 1:
        kind = schema.field(name).type
        if pa.types.is_nested(kind) or pa.types.is_null(kind):
            return (name,)  # of what length its lists are, the first row need not tell: it may be empty
    found = fields("projections", each)
    if len(found) != d**2 or any(field.component is not None for field in found):
        raise DataError(
            f"projections takes one column of lists of {d**2} numbers, or {d**2} columns of numbers, row by row of the "
            f"{d} x {d} matrix, but {keys!r} stands for {len(found)}"
        )
    return tuple(field.column for field in found)
