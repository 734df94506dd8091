"""The values of a field in all pieces of a file, looked at together and not once for each of thousands of pieces."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from unconstrain.recordings.pieces import Piece
from unconstrain.recordings.table import Cells, Field


def join_cells(pieces: Sequence[Piece], field: Field, role: str) -> list[Cells]:
    """Return the values of a field: those of one file at once, where they are of one type.

    Parameters
    ----------
    pieces : sequence of Piece
    field : Field
    role : str
        What it is for, as the user calls it.

    Returns
    -------
    list of Cells

    Raises
    ------
    DataError
        Files hold values of other kinds than the first.
    """
    every = [piece.alike(field, role) for piece in pieces[:1]]
    kinds = {piece.column(field.key).type for piece in pieces}
    if len(pieces) < 2 or len(kinds) > 1 or any(piece.file != pieces[0].file for piece in pieces):
        return [*every, *(piece.alike(field, role) for piece in pieces[1:])]
    if field.component is not None or pa.types.is_dictionary(kinds.pop()):
        return [*every, *(piece.alike(field, role) for piece in pieces[1:])]
    values = pa.concat_arrays([piece.column(field.key) for piece in pieces])
    return [replace(every[0], values=values, place=places(pieces))]


def read_labels(pieces: Sequence[Piece], field: Field) -> NDArray[Any]:
    """Read the values (N,) that tell episodes apart. Raises `DataError` that names file, column and row of a gap."""
    parts = [cells.labels() for cells in join_cells(pieces, field, "episode")]
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def places(pieces: Sequence[Piece]) -> Callable[[int], str]:
    """Return what says where in their files a row of these pieces is."""
    bounds = np.cumsum([0, *(len(piece.rows) for piece in pieces)])

    def place(index: int) -> str:
        which = int(np.searchsorted(bounds, index, side="right")) - 1
        piece = pieces[which]
        at = piece.place(index - int(bounds[which]))
        return f"{at} of {piece.format.file.shown}" if piece.file != pieces[0].file else at

    return place
