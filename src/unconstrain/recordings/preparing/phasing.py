"""The steps that give states a phase: it is found in whole episodes, and added when nothing else is done to states."""

from dataclasses import replace

import numpy as np

from unconstrain.recordings.phase import phase_of
from unconstrain.recordings.preparing.rows import Notes, Portion, Rows


def find_phase(portion: Portion, rows: Rows) -> tuple[Rows, Notes]:
    """Find how far each row's episode has come, before it is split: fragments go on counting in their episode."""
    if not portion.recording.preparation.phase:
        return rows, ()
    if not len(rows):
        return replace(rows, phase=np.zeros((0, 1))), ()
    assert rows.time is not None
    return replace(rows, phase=phase_of(rows.time, rows.codes)[:, None]), ()


def add_phase(portion: Portion, rows: Rows) -> tuple[Rows, Notes]:
    """Add the phase to the states."""
    if rows.phase is None:
        return rows, ()
    return replace(rows, X=np.hstack([rows.X, rows.phase])), ()
