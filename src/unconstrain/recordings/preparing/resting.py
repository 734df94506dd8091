"""The step that finds pauses."""

from dataclasses import replace

import numpy as np

from unconstrain.recordings.episodewise import norms
from unconstrain.recordings.notes import Note
from unconstrain.recordings.pauses import AT_REST, SHORTEST, find_pauses
from unconstrain.recordings.preparing.rows import Notes, Portion, Rows


def find_rest(portion: Portion, rows: Rows) -> tuple[Rows, Notes]:
    """Find the rows that are in pauses, and note how many they are.

    They are left out at the end, since the forces of a pause still tell what a contact is.
    """
    recording = portion.recording
    if rows.time is None or recording.saves:
        return rows, ()
    resting = np.zeros(len(rows), dtype=bool)
    count, speeds = 0, norms(rows.U)
    for own in rows.runs():
        resting[own], number = find_pauses(speeds[own], rows.time[own])
        count += number
    if not count:
        return rows, ()
    what = f"in {{}} of {SHORTEST:g} s or more below {AT_REST:.0%} of the usual speed"
    if recording.preparation.drops("pauses"):
        text = f"left out {{}} {what}"
    else:
        text = f'{{}} are at rest, {what}; drop="pauses" leaves them out, or min_speed= slow ones'
    note = Note("pause", recording.name, text, (int(resting.sum()), count), ("sample", "pause"))
    return replace(rows, resting=resting), (note,)
