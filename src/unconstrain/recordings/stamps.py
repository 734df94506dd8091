"""Time stamps as they are written, made seconds since the start of each episode."""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.recordings.table import Table

PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}

# No one records a second apart in units of 10 µs: a typical step this large is counted in nanoseconds.
NANOSECOND_STEP = 1e5

# Outside of these a typical step (seconds) makes the unit doubtful, which is noted.
USUAL_STEP = (1e-4, 1.0)


def seconds(
    table: Table, position: int, episodes: NDArray[np.int64], unit: str | None = None
) -> tuple[NDArray[np.float64], list[str]]:
    """Seconds (N,) since the first stamp of each sample's episode, and notes.

    The first stamp is subtracted while the stamps are still integers, as float64 resolves today's
    nanoseconds only to a quarter of a microsecond.

    Without a `unit` ("s", "ms", "us", "ns"), stamps whose typical step is 100000 or more are nanoseconds,
    others seconds. Stamps that carry their unit (timestamps, durations) go by that.

    Raises
    ------
    DataError
        Stamps that do not increase strictly within an episode, that are missing, or that are text.
    """
    ticks, own_unit = _ticks(table, position)
    if len(ticks) != len(episodes):
        raise DataError(
            f"{table.path}: {table.called(position)} has {len(ticks)} stamps for {len(episodes)} samples; "
            "there must be one per sample"
        )
    order = np.argsort(episodes, kind="stable")
    steps = np.diff(ticks[order])
    within = np.diff(episodes[order]) == 0
    late = np.flatnonzero(within & ~(steps > 0))
    if len(late):
        first = late[np.argmin(order[late + 1])]
        does = "repeats a stamp" if steps[first] == 0 else "goes back"
        raise DataError(
            f"{table.path}: time in {table.called(position)} {does} at {table.place(int(order[first + 1]))}; "
            "it must increase strictly within an episode, so take such samples out, "
            "or name the column that tells episodes apart"
        )
    typical = float(np.median(steps[within])) if np.any(within) else 0.0
    unit = own_unit or unit or ("ns" if typical >= NANOSECOND_STEP else "s")
    starts = np.zeros(int(episodes.max()) + 1, dtype=ticks.dtype)
    starts[episodes[order[::-1]]] = ticks[order[::-1]]  # the last one written is an episode's first
    step, notes = typical / PER_SECOND[unit], []
    if step and not USUAL_STEP[0] <= step <= USUAL_STEP[1]:
        notes.append(
            f"{Path(table.path).name}: time read in {unit} has a typical step of {step:.3g} s; "
            "if that is wrong, give time_unit"
        )
    return (ticks - starts[episodes]) / PER_SECOND[unit], notes


def _ticks(table: Table, position: int) -> tuple[NDArray[Any], str | None]:
    values = table.filled(position)
    kind = values.type
    if pa.types.is_string(kind) or pa.types.is_large_string(kind):
        # Integers first, so that nothing is lost; zoned times cannot be told from plain ones beforehand.
        for target in (pa.int64(), pa.float64(), pa.timestamp("ns"), pa.timestamp("ns", "UTC")):
            try:
                values = values.cast(target)
                break
            except pa.ArrowInvalid:
                continue
        kind = values.type
    if pa.types.is_timestamp(kind) or pa.types.is_duration(kind) or pa.types.is_time(kind):
        integers = values.cast(pa.int32() if pa.types.is_time32(kind) else pa.int64())
        return integers.to_numpy().astype(np.int64), kind.unit
    if pa.types.is_integer(kind):
        try:
            return values.cast(pa.int64()).to_numpy(), None
        except pa.ArrowInvalid as error:
            raise DataError(
                f"{table.path}: {table.called(position)} holds stamps too large for time"
            ) from error
    return table.numbers(position), None
