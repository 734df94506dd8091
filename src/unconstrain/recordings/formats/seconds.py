"""Seconds in one column and what is left of a second in another, as ROS and robots' controllers write stamps."""

from typing import Any

import numpy as np
import pyarrow as pa

from unconstrain.recordings.formats.text_stamps import find_pair

TIME = "time"
BILLION = 1_000_000_000


def with_time(table: Any) -> tuple[Any, tuple[str, ...]]:
    """Return a table with a column of stamps, where two of its columns are parts of them.

    Parameters
    ----------
    table : pyarrow.Table

    Returns
    -------
    table : pyarrow.Table
    notes : tuple of str
    """
    names = table.column_names
    pair = find_pair(names)
    if pair is None or TIME in names:
        return table, ()
    seconds, rest, ticks = pair
    parts = table.column(seconds), table.column(rest)
    if not all(pa.types.is_integer(part.type) and not part.null_count for part in parts):
        return table, ()
    whole, small = (np.asarray(part.cast(pa.int64()).to_numpy()) for part in parts)
    if np.any(small < 0) or np.any(small >= ticks) or np.any(np.abs(whole) >= BILLION * 9):
        return table, ()
    stamps = pa.array(whole * BILLION + small * (BILLION // ticks)).cast(pa.duration("ns"))
    note = f"time is made of {names[seconds]} and {names[rest]}; time= names another column"
    return table.append_column(TIME, stamps), (note,)
