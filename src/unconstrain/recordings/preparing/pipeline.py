"""All steps of preparation, in order."""

from collections.abc import Callable

from unconstrain.recordings.blocks import Loaded
from unconstrain.recordings.preparing.filling import fill_columns
from unconstrain.recordings.preparing.labelling import label
from unconstrain.recordings.preparing.motion import (
    accelerate,
    differentiate_states,
    divide_increments,
    follow_states,
    relate,
    resample,
)
from unconstrain.recordings.preparing.phasing import add_phase, find_phase
from unconstrain.recordings.preparing.projecting import make_projections
from unconstrain.recordings.preparing.reading import read
from unconstrain.recordings.preparing.resting import find_rest
from unconstrain.recordings.preparing.rows import Notes, Portion, Rows
from unconstrain.recordings.preparing.splitting import split_rows
from unconstrain.recordings.preparing.timing import time_rows

Step = Callable[[Portion, Rows], tuple[Rows, Notes]]
"""Takes a portion and its rows as earlier steps left them; returns rows, and notes of what it found.

Rows with which it has nothing to do it returns as they are. It changes no array: others may hold it.
"""

STEPS: tuple[Step, ...] = (
    time_rows,
    fill_columns,
    find_phase,
    follow_states,
    split_rows,
    divide_increments,
    resample,
    differentiate_states,
    relate,
    find_rest,
    make_projections,
    accelerate,
    add_phase,
)
"""What lies between reading rows and labelling samples."""


def prepare(portion: Portion) -> Loaded:
    """Prepare samples that depend on their neighbours, or that are to become demonstrations.

    Parameters
    ----------
    portion : Portion
        Whole episodes.

    Returns
    -------
    Loaded
        float64.

    Raises
    ------
    DataError
        Anything cannot be read or used, in one sentence that names the file and the place in it.
    """
    rows, notes = read(portion)
    for step in STEPS:
        rows, found = step(portion, rows)
        notes += found
    return label(portion, rows, notes)
