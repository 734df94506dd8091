"""The step that gives rows their time."""

from dataclasses import replace

import numpy as np

from unconstrain.recordings.blocks import number_values
from unconstrain.recordings.joined import join_cells, places
from unconstrain.recordings.notes import Note
from unconstrain.recordings.preparing.rows import Notes, Portion, Rows
from unconstrain.recordings.steps import are_even, comes_in_bursts
from unconstrain.recordings.time import repeated


def time_rows(portion: Portion, rows: Rows) -> tuple[Rows, Notes]:
    """Find the time (s) of each row, from its stamp, or from its number within the episode and the rate.

    Rows that repeat a stamp are left out where that is asked for.

    Raises
    ------
    DataError
        Stamps that do not increase strictly within an episode.
    """
    recording = portion.recording
    needed = portion.everything or recording.splits or recording.changes_states
    if not (recording.timed and needed and len(rows)):
        return rows, ()
    notes: Notes = ()
    if recording.roles.time is None:
        # Rows that were left out count too: they took their time.
        codes, _ = number_values(recording.labels(portion.pieces))
        rows = replace(rows, time=recording.count_time(codes)[rows.numbers])
    else:
        rows, notes = _read_stamps(portion, rows)
    return rows, notes if recording.saves else (*notes, *_note_bursts(recording.name, rows))


def _read_stamps(portion: Portion, rows: Rows) -> tuple[Rows, Notes]:
    recording, pieces = portion.recording, portion.complete
    field = recording.roles.time
    assert field is not None
    stamps = join_cells(pieces, field, "time")
    if recording.saves and not recording.splits:
        return replace(rows, time=np.concatenate([part.numbers() for part in stamps])), ()
    clock, where = recording.clock, places(pieces)
    ticks = np.concatenate([clock.ticks(part) for part in stamps])
    left = np.arange(len(ticks))
    notes: Notes = ()
    if recording.preparation.drops("duplicates"):
        again = repeated(ticks, rows.codes)
        if again.any():
            text = "left out {} with the stamp of the one before"
            notes = (Note("repeated", recording.name, text, (int(again.sum()),), ("row",)),)
        left = np.flatnonzero(~again)
        rows, ticks = rows.take(left), ticks[left]
    seconds = clock.seconds(ticks, rows.codes, stamps[0].path, field.called, lambda i: where(int(left[i])))
    if not recording.saves:
        notes += clock.note(recording.name)
    return replace(rows, time=seconds), notes


def _note_bursts(name: str, rows: Rows) -> Notes:
    """Note the episodes whose stamps come in bursts."""
    assert rows.time is not None
    if are_even(np.diff(rows.time)[np.diff(rows.codes) == 0]) and np.all(np.diff(rows.codes) >= 0):
        return ()
    count = sum(comes_in_bursts(np.diff(rows.time[own])) for own in rows.runs())
    text = (
        "the stamps of {} come in bursts, as when messages are stamped where they arrive; name better stamps with "
        "time= if there are any, or give resample= to spread these evenly"
    )
    return (Note("burst", name, text, (count,), ("episode",)),) if count else ()
