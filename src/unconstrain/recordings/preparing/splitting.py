"""The step that splits episodes where they are broken."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.recordings.derivative import spans_window, window_samples
from unconstrain.recordings.gaps import GAP_STEPS, SUSPICIOUS, Fragments, split
from unconstrain.recordings.notes import Note, count
from unconstrain.recordings.preparing.rows import Notes, Portion, Rows
from unconstrain.recordings.recording import Recording
from unconstrain.recordings.resampling import count_even

Array = NDArray[np.float64]


def split_rows(portion: Portion, rows: Rows) -> tuple[Rows, Notes]:
    """Split episodes into fragments at gaps and at steps that are too fast, and drop fragments that are too short.

    Raises
    ------
    DataError
        An episode is too short to be differentiated.
    """
    recording = portion.recording
    if rows.time is None or (recording.saves and not recording.splits):
        return rows, ()
    how = recording.preparation
    needs_neighbours = recording.smooths or recording.kind.kind == "increment"
    if needs_neighbours and not how.drops("short"):
        _check_long_enough(recording, rows)
    gap = how.gap
    if gap is None and not recording.smooths and how.resample is None:
        gap = math.inf  # given actions do not depend on their neighbours, so a gap does no harm

    def long_enough(stamps: Array) -> bool:
        # Rounding must not drop a fragment of exactly the duration asked for.
        lasts = stamps[-1] - stamps[0] >= (how.min_duration or 0.0) * (1 - 1e-9)
        if not lasts or (len(stamps) < 2 and recording.kind.kind == "increment"):
            return False
        return not recording.smooths or _spans_window(stamps, recording.window, how.resample)

    found = split(
        rows.X, rows.time, rows.codes, gap=gap, max_speed=how.max_speed, long_enough=long_enough,
        drop_short=how.drops("short"),
    )  # fmt: skip
    kept = rows if len(found.samples) == len(rows) else rows.take(found.samples)
    rows = replace(kept, codes=found.episodes, origins=found.origins)
    return rows, _describe(found, recording)


def _check_long_enough(recording: Recording, rows: Rows) -> None:
    assert rows.time is not None
    how = recording.preparation
    window = how.window or 0.0  # one that was found becomes shorter where it has to
    for label, own in zip(rows.episodes.labels, rows.runs(), strict=True):
        stamps = rows.time[own]
        if len(stamps) < 2 or (recording.smooths and not _spans_window(stamps, window, how.resample)):
            samples = count(len(stamps), "sample")
            over = "" if how.window is None else f" with window={how.window:g} s"
            remedy = "" if how.window is None else ", or lower window="
            if how.resample is not None:
                over, remedy = f"{over} at resample={how.resample:g} Hz", ", or raise resample="
            raise DataError(
                f"{recording.shown}: episode {label!r} has {samples} over {stamps[-1] - stamps[0]:.3g} s, too few to "
                f'differentiate{over}; leave it out with drop="short"{remedy}'
            )


def _spans_window(stamps: Array, window: float, resample: float | None) -> bool:
    """Whether a fragment can be differentiated, as it will be after resampling."""
    if resample is None:
        return spans_window(stamps, window)
    even = count_even(float(stamps[-1] - stamps[0]), resample)
    return even >= window_samples(1.0 / resample, window)


def _describe(found: Fragments, recording: Recording) -> Notes:
    """Note where episodes were split, what was dropped, and what looks as if it should have been split."""
    how, name = recording.preparation, recording.name
    length = f"{GAP_STEPS:g} typical steps" if how.gap is None else f"{how.gap:g} s"
    notes = [
        Note("gap", name, f"split at {{}} longer than {length}", (found.gaps,), ("gap",)),
        Note(
            "short", name, f"dropped {{}} ({{}}) shorter than {recording.shortest:g} s",
            (found.dropped, found.dropped_samples), ("fragment", "sample"),
        ),
    ]  # fmt: skip
    if how.max_speed is not None:
        text = f"split at {{}} faster than {how.max_speed:g} per second"
        notes.append(Note("speed", name, text, (found.fast,), ("step",)))
    else:
        text = (
            f"{{}} more than {SUSPICIOUS:g} times faster than 95 % of them, as when a tracker jumps; give "
            "max_speed= to split there"
        )
        notes.append(Note("jump", name, text, (found.suspicious,), ("step",)))
    return tuple(note for note in notes if note.counts[0])
