"""The rows of a block on their way through preparation, and where they come from."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.recordings.notes import Note
from unconstrain.recordings.pieces import Piece
from unconstrain.recordings.recording import NEEDED, Episodes, Recording
from unconstrain.recordings.resampling import Grid
from unconstrain.recordings.steps import runs

Array = NDArray[np.float64]
Codes = NDArray[np.int64]

BETWEEN = ("X", "U", "forces", "policy", "reference", "phase")
"""What is interpolated linearly; of everything else a grid takes the nearest row. States that are no plain numbers are
interpolated by `preparing.motion`."""


@dataclass(frozen=True)
class Rows:
    """Rows of a block: arrays of which each holds one entry a row.

    Parameters
    ----------
    numbers : ndarray of shape (N,)
        Which rows of the block these are, counted from 0.
    X : ndarray of shape (N, n)
        States.
    U : ndarray of shape (N, d)
        Actions; zeros where they are yet to be differentiated.
    codes : ndarray of shape (N,)
        The fragment of each row, a number into `origins`. Episodes may be interleaved.
    episodes : Episodes
        The values and labels of the episodes in the block.
    origins : tuple of (int, int)
        Of each fragment, the number of its episode, and which of that episode's fragments it is, counted from 1; 0
        where it is the only one.
    time : ndarray of shape (N,) or None
        Seconds, strictly increasing within an episode.
    forces : ndarray of shape (N, m) or None
    free : ndarray of shape (N,) or None
    policy : ndarray of shape (N, d) or None
    projections : ndarray of shape (N, d, d) or None
    reference : ndarray of shape (N, n) or None
        What the states are relative to.
    phase : ndarray of shape (N, 1) or None
        How far each row's episode has come, from 0 to 1.
    resting : ndarray of shape (N,) or None
        Whether a row is in a pause.
    """

    numbers: Codes
    X: Array
    U: Array
    codes: Codes
    episodes: Episodes
    origins: tuple[tuple[int, int], ...]
    time: Array | None = None
    forces: Array | None = None
    free: Array | None = None
    policy: Array | None = None
    projections: Array | None = None
    reference: Array | None = None
    phase: Array | None = None
    resting: NDArray[np.bool_] | None = None

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.X)

    def take(self, chosen: Codes) -> "Rows":
        """Return the rows of these indices (M,)."""
        return replace(self, **{name: array[chosen] for name, array in self._arrays().items()})

    def on(self, grid: Grid) -> "Rows":
        """Return rows at the times of a grid: interpolated, or where that makes no sense the nearest ones."""
        nearest = grid.nearest
        brought: dict[str, Any] = {
            name: grid.between(array) if name in BETWEEN else array[nearest]
            for name, array in self._arrays().items()
        }
        return replace(self, **{**brought, "time": grid.time, "codes": grid.episodes})

    def runs(self) -> list[Codes]:
        """Return the indices of each fragment's rows, in order."""
        return runs(self.codes)

    def _arrays(self) -> dict[str, Any]:
        every = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: value for name, value in every.items() if isinstance(value, np.ndarray)}


@dataclass(frozen=True)
class Portion:
    """Consecutive rows of a recording, which are prepared together.

    Parameters
    ----------
    recording : Recording
    pieces : sequence of Piece
        As they were read.
    start : int
        The number of the first row in the recording.
    everything : bool
        Whether all that demonstrations hold is prepared, and not only what is learnt from.
    """

    recording: Recording
    pieces: Sequence[Piece]
    start: int
    everything: bool

    @cached_property
    def complete(self) -> Sequence[Piece]:
        """The pieces, where that is asked for without the rows in which something is missing."""
        return self.recording.complete(self.pieces, ("time",) if self.recording.fills else NEEDED)


Notes = tuple[Note, ...]
"""What a step found."""
