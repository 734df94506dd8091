"""The step that interpolates columns that are filled at different rates, each between its own stamps."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from unconstrain.recordings.angles import unwrap
from unconstrain.recordings.gaps import GAP_STEPS
from unconstrain.recordings.notes import Note
from unconstrain.recordings.preparing.rows import Notes, Portion, Rows
from unconstrain.recordings.recording import Recording
from unconstrain.recordings.steps import typical_step

Array = NDArray[np.float64]

FILLED = ("X", "U", "forces", "reference")
"""The arrays in which something may be missing."""


def fill_columns(portion: Portion, rows: Rows) -> tuple[Rows, Notes]:
    """Bring all columns to the stamps of the one that is filled most often, episode by episode.

    A column is interpolated linearly between its own stamps, never across a gap among them; rows for which one of
    the columns says nothing are left out.
    """
    recording = portion.recording
    if not (recording.fills and rows.time is not None and len(rows)):
        return rows, ()
    # Actions that are yet to be differentiated are zeros.
    names = [name for name in FILLED if name != "U" or not recording.differentiates]
    arrays = {name: held.copy() for name in names if (held := getattr(rows, name)) is not None}
    if all(np.isfinite(held).all() for held in arrays.values()):
        return rows, ()
    kept = np.zeros(len(rows), dtype=bool)
    notes: Notes = ()
    filled = left = 0
    for own in rows.runs():
        there = np.isfinite(rows.X[own])
        wanted = own[there[:, int(np.argmax(there.sum(axis=0)))]]
        for name, held in arrays.items():
            for j in range(held.shape[1]):
                known = own[np.isfinite(held[own, j])]
                missing = wanted[~np.isfinite(held[wanted, j])]
                if not len(missing):
                    continue
                values = held[known, j]
                if name == "X" and len(values):
                    values, found = _unwrapped(recording, values, j)
                    held[known, j], notes = values, (*notes, *found)
                gap = recording.preparation.gap
                held[missing, j] = _between(rows.time[missing], rows.time[known], values, gap)
                filled += int(np.isfinite(held[missing, j]).sum())
        whole = np.all([np.isfinite(held[wanted]).all(axis=1) for held in arrays.values()], axis=0)
        kept[wanted[whole]] = True
        left += int(np.sum(~whole))
    text = "{} filled in: each column is interpolated between its own stamps, not across gaps"
    notes = (
        Note("empty", recording.name, text, (filled,), ("value",)),
        Note("empty", recording.name, "left out {} with something missing", (left,), ("row",)),
        *notes,
    )
    return replace(rows, **arrays).take(np.flatnonzero(kept)), notes


def _unwrapped(recording: Recording, values: Array, place: int) -> tuple[Array, Notes]:
    """Return the values (K,) of a state with its turns counted on, if it is an angle."""
    angle = recording.roles.angle
    if not recording.unwraps or not (angle is None or place in angle):
        return values, ()
    name = recording.roles.state_names[place]
    turned, found = unwrap(values[:, None], (name,), None if angle is None else (0,), recording.name)
    return turned[:, 0], found


def _between(at: Array, stamps: Array, values: Array, gap: float | None) -> Array:
    """Interpolate values (K,) at times (M,); NaN before the first stamp, after the last, and in gaps."""
    if not len(stamps):
        return np.full(len(at), np.nan)
    right = np.clip(np.searchsorted(stamps, at, side="left"), 0, len(stamps) - 1)
    left = np.where(stamps[right] > at, np.maximum(right - 1, 0), right)
    result = np.interp(at, stamps, values)
    longest = gap if gap is not None else GAP_STEPS * typical_step(np.diff(stamps))
    hidden = (stamps[right] - stamps[left] > longest) & (stamps[left] != at)
    result[hidden | (at < stamps[0]) | (at > stamps[-1])] = np.nan
    return result
