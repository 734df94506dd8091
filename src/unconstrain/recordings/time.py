"""Time stamps as they are written, made seconds since the start of each episode."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.recordings.notes import Note
from unconstrain.recordings.preparation import TIME_UNITS
from unconstrain.recordings.table import Cells, is_text

Codes = NDArray[np.int64]

# No one records a second apart in units of 10 µs: a typical step this large is counted in nanoseconds.
NANOSECOND_STEP = 1e5

# Outside of these a typical step (seconds) makes the unit doubtful, which is noted.
USUAL_STEP = (1e-4, 1.0)


@dataclass(frozen=True)
class Clock:
    """How the stamps of a recording are read, which is decided once, by its first samples.

    Parameters
    ----------
    unit : {"s", "ms", "us", "ns"}
        The unit of the stamps.
    text : pyarrow.DataType or None
        What stamps that are text are read as.
    step : float
        The typical step (s) of those first samples, zero where there is none.
    """

    unit: str
    text: pa.DataType | None
    step: float

    @classmethod
    def decide(cls, stamps: Cells, episodes: Codes, unit: str | None) -> "Clock":
        """Decide by the first stamps of a recording.

        Without a `unit`, stamps whose typical step is 100000 or more are nanoseconds, others seconds. Stamps that
        carry their unit (timestamps, durations) go by that.

        Parameters
        ----------
        stamps : Cells
        episodes : ndarray of shape (N,)
            The episode of each stamp, as a number from 0.
        unit : {"s", "ms", "us", "ns"}, optional

        Returns
        -------
        Clock
        """
        text = _type_of_text(stamps) if is_text(stamps.filled().type) else None
        ticks, own = _ticks(stamps, text)
        order = np.argsort(episodes, kind="stable")
        steps = np.diff(ticks[order])[np.diff(episodes[order]) == 0]
        typical = float(np.median(steps)) if len(steps) else 0.0
        unit = own or unit or ("ns" if typical >= NANOSECOND_STEP else "s")
        return cls(unit, text, typical / TIME_UNITS[unit])

    def note(self, file: str) -> tuple[Note, ...]:
        """Note a unit that is doubtful."""
        if not self.step or USUAL_STEP[0] <= self.step <= USUAL_STEP[1]:
            return ()
        text = f"time read in {self.unit} has a typical step of {self.step:.3g} s; if that is wrong, give time_unit="
        return (Note("time", file, text),)

    def ticks(self, stamps: Cells) -> NDArray[Any]:
        """Return stamps as numbers (N,), integers where nothing else is needed.

        Raises
        ------
        DataError
            Stamps that are missing, or are text.
        """
        return _ticks(stamps, self.text)[0]

    def seconds(
        self, ticks: NDArray[Any], episodes: Codes, path: str, called: str, place: Callable[[int], str]
    ) -> NDArray[np.float64]:
        """Return seconds since the first stamp of each sample's episode.

        The first stamp is subtracted while the stamps are still integers, as float64 resolves today's nanoseconds
        only to a quarter of a microsecond.

        Parameters
        ----------
        ticks : ndarray of shape (N,)
        episodes : ndarray of shape (N,)
            The episode of each stamp, as a number from 0.
        path, called : str
            The file and the column, as a sentence says them.
        place : function
            Where the i-th stamp is.

        Returns
        -------
        ndarray of shape (N,)

        Raises
        ------
        DataError
            Stamps that do not increase strictly within an episode.
        """
        order = np.argsort(episodes, kind="stable")
        steps = np.diff(ticks[order])
        late = np.flatnonzero((np.diff(episodes[order]) == 0) & ~(steps > 0))
        if len(late):
            first = late[np.argmin(order[late + 1])]
            does = "repeats a stamp" if steps[first] == 0 else "goes back"
            raise DataError(
                f"{path}: time in {called} {does} at {place(int(order[first + 1]))}; "
                "it must increase strictly within an episode, so take such samples out, "
                "or give episode=, the column that tells episodes apart"
            )
        starts = np.zeros(int(episodes.max()) + 1, dtype=ticks.dtype)
        starts[episodes[order[::-1]]] = ticks[order[::-1]]  # the last one written is an episode's first
        return (ticks - starts[episodes]) / TIME_UNITS[self.unit]


def _type_of_text(stamps: Cells) -> pa.DataType | None:
    # Integers first, so that nothing is lost; zoned times cannot be told from plain ones beforehand.
    for target in (pa.int64(), pa.float64(), pa.timestamp("ns"), pa.timestamp("ns", "UTC")):
        try:
            stamps.filled().cast(target)
        except pa.ArrowInvalid:
            continue
        return target
    return None


def _ticks(stamps: Cells, text: pa.DataType | None) -> tuple[NDArray[Any], str | None]:
    values = stamps.filled()
    if is_text(values.type) and text is not None:
        try:
            values = values.cast(text)
        except pa.ArrowInvalid as error:
            if pa.types.is_integer(text):
                return stamps.numbers(), None
            raise DataError(
                f"{stamps.path}: {stamps.called} holds text at {stamps.place(0)} or later that is no {text}; write "
                "all stamps alike"
            ) from error
    kind = values.type
    if pa.types.is_timestamp(kind) or pa.types.is_duration(kind) or pa.types.is_time(kind):
        integers = values.cast(pa.int32() if pa.types.is_time32(kind) else pa.int64())
        return integers.to_numpy().astype(np.int64), kind.unit
    if pa.types.is_integer(kind):
        try:
            return values.cast(pa.int64()).to_numpy(), None
        except pa.ArrowInvalid as error:
            raise DataError(f"{stamps.path}: {stamps.called} holds stamps too large for time") from error
    return stamps.numbers(), None
