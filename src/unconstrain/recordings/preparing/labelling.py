"""The last step: samples of rows, with the names of their episodes."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.recordings.blocks import Episode, Loaded, select
from unconstrain.recordings.preparing.rows import Notes, Portion, Rows
from unconstrain.samples import Samples


def label(portion: Portion, rows: Rows, notes: Notes) -> Loaded:
    """Make samples of rows, without pauses where that is asked for.

    Parameters
    ----------
    portion : Portion
    rows : Rows
        After all other steps.
    notes : tuple of Note
        Of these.

    Returns
    -------
    Loaded
        Its groups are numbers into its episodes where everything is wanted; otherwise what cross-validation leaves out.
    """
    samples = Samples(rows.X, rows.U, _groups(portion, rows), rows.projections)
    loaded = Loaded(samples, notes, time=rows.time)
    if portion.everything:
        loaded = replace(
            loaded,
            episodes=_episodes(portion, rows),
            policy=rows.policy,
            forces=rows.forces,
            free=rows.free,
        )
    if rows.resting is None or not portion.recording.preparation.drops("pauses"):
        return loaded
    return select(loaded, ~rows.resting)


def _episodes(portion: Portion, rows: Rows) -> tuple[Episode, ...]:
    number, episodes = portion.recording.number, rows.episodes
    return tuple(
        Episode(
            (number, episodes.values[code], part),
            f"{episodes.labels[code]}/{part}" if part else episodes.labels[code],
        )
        for code, part in rows.origins
    )


def _groups(portion: Portion, rows: Rows) -> NDArray[Any]:
    recording = portion.recording
    if portion.everything:
        return rows.codes
    if recording.undivided and len(rows.origins) == 1:
        return recording.divide(portion.start + rows.numbers)
    if not recording.splits:
        return recording.groups(portion.complete, portion.start)
    names = [recording.name_fragment(rows.episodes.values[code], part) for code, part in rows.origins]
    return np.array(names, dtype=np.str_)[rows.codes]
