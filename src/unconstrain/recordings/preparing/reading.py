"""The first step: the columns of a portion as arrays."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from unconstrain.recordings.notes import Note
from unconstrain.recordings.pieces import Piece, read_flags, read_numbers, read_projections
from unconstrain.recordings.preparing.rows import Notes, Portion, Rows
from unconstrain.recordings.table import Field

Array = NDArray[np.float64]


def read(portion: Portion) -> tuple[Rows, Notes]:
    """Read the columns that preparation needs.

    Parameters
    ----------
    portion : Portion

    Returns
    -------
    Rows
        Without time.
    tuple of Note

    Raises
    ------
    DataError
        Something is not a number; the sentence names file, column and row.
    """
    recording, pieces, everything = portion.recording, portion.complete, portion.everything
    roles = recording.roles
    about_constraints = everything or recording.makes_projections
    gappy = recording.fills
    X = _read(pieces, roles.state, "state", gappy)
    none = np.zeros((len(X), recording.recorded_space.n_actions))
    projections = None
    if recording.reads_projections:
        checked = recording.columns.projections is not None
        projections = read_projections(pieces, roles.projections, roles.n_actions, check=checked)
    episodes, codes = recording.number_episodes(recording.labels(pieces))
    rows = Rows(
        numbers=_numbers(pieces),
        X=X,
        U=_read(pieces, roles.action, "action", gappy) if roles.action else none,
        codes=codes,
        episodes=episodes,
        origins=tuple((code, 0) for code in range(len(episodes.values))),
        forces=_read(pieces, roles.force, "force", gappy) if roles.force and about_constraints else None,
        free=read_flags(pieces, roles.free) if roles.free is not None and about_constraints else None,
        policy=_read(pieces, roles.policy, "policy") if roles.policy and everything else None,
        projections=projections,
        reference=_read(pieces, roles.reference, "relative_to", gappy) if roles.reference else None,
    )
    missing = sum(len(piece.rows) for piece in portion.pieces) - len(rows)
    if not missing:
        return rows, ()
    notes = (Note("empty", recording.name, "left out {} with something missing", (missing,), ("row",)),)
    if missing <= len(rows) or not recording.timed:
        return rows, notes
    text = (
        "most rows lack something, as where columns are filled at different rates: resample= interpolates each between "
        "its own stamps"
    )
    return rows, (*notes, Note("empty", recording.name, text))


def _read(pieces: Sequence[Piece], fields: Sequence[Field], role: str, gappy: bool = False) -> Array:
    if gappy:
        columns = [
            np.concatenate([piece.cells(field, role).numbers_or_nan(beside_text=True) for piece in pieces])
            if field.component is None
            else read_numbers(pieces, (field,), role)[0]
            for field in fields
        ]
        return np.stack(columns, axis=1).astype(np.float64)
    return np.ascontiguousarray(read_numbers(pieces, fields, role, by_row=True).T, dtype=np.float64)


def _numbers(pieces: Sequence[Piece]) -> NDArray[np.int64]:
    """Return the numbers of the rows of pieces, counted from the first, where some may have been left out."""
    at, every = 0, []
    for piece in pieces:
        every.append(at + (np.arange(len(piece.rows)) if piece.kept is None else piece.kept))
        at += piece.length
    return np.concatenate(every)
