"""The step that makes projections of forces or flags."""

from dataclasses import replace

import numpy as np

from unconstrain.constraints.recorded import from_forces_and_flags
from unconstrain.constraints.stuck import find_stuck
from unconstrain.recordings.notes import Note
from unconstrain.recordings.preparing.rows import Notes, Portion, Rows


def make_projections(portion: Portion, rows: Rows) -> tuple[Rows, Notes]:
    """Make the projections of contact forces or of flags, where they are not read."""
    recording = portion.recording
    if not recording.makes_projections:
        return rows, ()
    d = recording.roles.n_actions
    if not len(rows):
        return replace(rows, projections=np.zeros((0, d, d))), ()
    threshold = recording.preparation.force_threshold
    made = from_forces_and_flags(rows.forces, rows.free, rows.U, rows.codes, force_threshold=threshold)
    notes = []
    if rows.forces is not None:
        text = (
            "forces are taken along the axes of the actions; where the sensor turns with the hand, projections= takes "
            "what constraints.find_payload and constraints.from_forces make of them"
        )
        notes.append(Note("guess", recording.name, text))
        stuck = find_stuck(rows.forces, episodes=rows.codes)
        within = len(np.unique(rows.codes[stuck]))
        text = (
            "the force stays the same in {} of {}: the sensor had stopped, and nothing is taken from it there"
        )
        notes.append(Note("stuck", recording.name, text, (int(stuck.sum()), within), ("sample", "episode")))
    return replace(rows, projections=made), tuple(notes)
