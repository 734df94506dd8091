"""Time stamps as they are written, made seconds since the start of each episode."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.recordings.notes import Note
from unconstrain.recordings.preparation import TIME_UNITS
from unconstrain.recordings.steps import comes_in_bursts, follow_each_other, typical_step
from unconstrain.recordings.table import Cells, is_text

Codes = NDArray[np.int64]

# By the size of numbers that count from 1970: seconds of 1986 to 2128, and thousands of them.
EPOCH = (5e8, 5e9)

# A clock by which samples are further apart (s) does not count from 1970 in the unit at hand.
EPOCH_STEP = 10.0

# From these typical steps on a clock counts milliseconds, microseconds, nanoseconds: 2 Hz to 2 kHz in each.
LEAST_STEPS = {"ms": 2.0, "us": 500.0, "ns": 5e5}

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
    ticks_a_second : float
        By which stamps are divided.
    guessed : bool
        Whether the unit is a guess of which the user should hear.
    counts : bool
        Whether stamps go up by exactly 1, so that they may be the numbers of frames.
    of_type : bool
        Whether stamps carry their unit.
    instead_of : str
        The unit that a file by itself would be taken to be in, where it is read in that of the first file.
    """

    unit: str
    text: pa.DataType | None
    step: float
    ticks_a_second: float
    guessed: bool = False
    counts: bool = False
    of_type: bool = False
    instead_of: str = ""

    @classmethod
    def decide(cls, stamps: Cells, episodes: Codes, unit: str | None, rate: float | None = None) -> "Clock":
        """Decide by the first stamps of a recording.

        Stamps that carry their unit (timestamps, durations) go by that. Without a `unit`, numbers that count from 1970
        tell it by their size; those of other numbers by their typical step.

        Parameters
        ----------
        stamps : Cells
        episodes : ndarray of shape (N,)
            The episode of each stamp, as a number from 0.
        unit : {"s", "ms", "us", "ns"}, optional
        rate : float, optional
            Where stamps count frames, of which there are so many a second.

        Returns
        -------
        Clock
        """
        text = _type_of_text(stamps) if is_text(stamps.filled().type) else None
        ticks, own = _ticks(stamps, text)
        _, every, within = _steps(ticks, episodes)
        steps = every[within]
        if rate is not None and own is None:
            return cls("frames", text, typical_step(steps, rate) / rate, rate)
        first = float(abs(ticks[0])) if len(ticks) else 0.0
        usual = typical_step(steps, math.inf)
        guess, guessed = _guess(first, usual)
        found = own or unit or guess
        # What comes in no bursts however long a second is, does so in no unit.
        bursts = comes_in_bursts(steps[steps > 0], math.inf)
        typical = typical_step(steps, TIME_UNITS[found]) if bursts else usual
        if own is unit is None:  # what seemed bursts may have been gaps
            found, guessed = _guess(first, typical)
        guessed = guessed and own is unit is None
        seconds = TIME_UNITS[found]
        return cls(
            found, text, typical / seconds, seconds, guessed, guessed and typical == 1.0, own is not None
        )

    def led_by(self, first: "Clock") -> "Clock":
        """Return the clock by which these stamps are read beside those of a first file: in its unit."""
        if first.unit == self.unit or first.of_type or "frames" in (first.unit, self.unit):
            return self
        step = self.step * self.ticks_a_second / first.ticks_a_second
        return replace(
            self, unit=first.unit, step=step, ticks_a_second=first.ticks_a_second, instead_of=self.unit
        )

    def note(self, file: str) -> tuple[Note, ...]:
        """Note a unit that is guessed or doubtful."""
        if self.instead_of:
            text = (
                f"time is read in {self.unit} as in the first file, though by itself it would be taken to be in "
                f"{self.instead_of}; if that is wrong, give time_unit="
            )
        elif self.counts:
            text = (
                f"time goes up by 1, as the numbers of frames do, and milliseconds at 1 kHz: it is read in "
                f"{self.unit}; if that is wrong, give rate= or time_unit="
            )
        elif self.guessed:
            text = (
                f"time is taken to be in {self.unit}, by its typical step of {self.step * self.ticks_a_second:.4g}; if "
                "that is wrong, give time_unit=, or rate= for the numbers of frames"
            )
        elif self.step and not USUAL_STEP[0] <= self.step <= USUAL_STEP[1]:
            text = f"time read in {self.unit} has a typical step of {self.step:.3g} s"
            text += "; if that is wrong, give time_unit="
        else:
            return ()
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
        order, steps, within = _steps(ticks, episodes)
        late = np.flatnonzero(within & ~(steps > 0))
        if len(late):
            first = late[np.argmin(order[late + 1])]
            does = "repeats a stamp" if steps[first] == 0 else "goes back"
            raise DataError(
                f"{path}: time in {called} {does} at {place(int(order[first + 1]))}; "
                "it must increase strictly within an episode, so "
                + ('give drop="duplicates"' if steps[first] == 0 else "sort the samples")
                + ", or give episode=, the column that tells episodes apart"
            )
        starts = np.zeros(int(episodes.max()) + 1, dtype=ticks.dtype)
        begins = order[np.flatnonzero(np.concatenate([[True], ~within]))]
        starts[episodes[begins]] = ticks[begins]
        return (ticks - starts[episodes]) / self.ticks_a_second


def repeated(ticks: NDArray[Any], episodes: Codes) -> NDArray[np.bool_]:
    """Tell which stamps (N,) equal the one before them in the same episode."""
    order, steps, within = _steps(ticks, episodes)
    again = np.zeros(len(ticks), dtype=bool)
    again[order[1:]] = within & (steps == 0)
    return again


def _steps(ticks: NDArray[Any], episodes: Codes) -> tuple[Codes, NDArray[Any], NDArray[np.bool_]]:
    """Return the order (N,) of stamps episode by episode, the steps (N-1,) then, and which lie within an episode."""
    if follow_each_other(episodes):
        return np.arange(len(episodes)), np.diff(ticks), episodes[1:] == episodes[:-1]
    order = np.argsort(episodes, kind="stable")
    return order, np.diff(ticks[order]), np.diff(episodes[order]) == 0


def _guess(first: float, step: float) -> tuple[str, bool]:
    """Guess the unit by the size of the first stamp and the typical step, and say whether it is worth a note."""
    for unit, ticks in TIME_UNITS.items():
        if EPOCH[0] * ticks <= first < EPOCH[1] * ticks and step <= EPOCH_STEP * ticks:
            return unit, False
    found = "s"
    for unit, least in LEAST_STEPS.items():
        if step >= least:
            found = unit
    return found, found != "s" or step >= 1.0


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
