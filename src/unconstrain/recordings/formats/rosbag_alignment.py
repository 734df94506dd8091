"""Topics at rates of their own, brought to the stamps of the first of them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.recordings.formats.rosbag_messages import Nanoseconds, TopicTable, Values
from unconstrain.recordings.gaps import GAP_STEPS

TURNS = (2 * np.pi, 360.0)
"""What is added to or taken from an angle where it begins anew."""


@dataclass(frozen=True)
class Aligned:
    """Several topics as one table.

    Parameters
    ----------
    rows : ndarray of shape (M,)
        The messages of the first topic that are kept.
    fields : dict of str to Values
        Of shape (M,) or (M, k) each; their paths begin with the topic.
    notes : tuple of str
    """

    rows: NDArray[np.int64]
    fields: dict[str, Values]
    notes: tuple[str, ...]


def align(tables: Sequence[TopicTable], times: Sequence[Nanoseconds], shown: str) -> Aligned:
    """Bring topics to the stamps of the first.

    Between two messages of another topic real numbers are interpolated linearly; whole numbers, truth values, text and
    quaternions, and numbers that step by more than half a turn as angles do, are those of the nearer message. A row
    that lies outside of another topic, or between two of its messages further apart than `GAP_STEPS` times their median
    step, is left out.

    Parameters
    ----------
    tables : sequence of TopicTable
    times : sequence of ndarray
        The stamps (ns) of each topic, (N,) by one clock.
    shown : str
        The bag, as the user calls it.

    Returns
    -------
    Aligned

    Raises
    ------
    DataError
        No row of the first topic is left.
    """
    first, at = tables[0], times[0]
    kept = np.ones(len(at), dtype=bool)
    notes: list[str] = []
    others = []
    for table, own in zip(tables[1:], times[1:], strict=True):
        # A stamp that repeats or goes back has no place between its neighbours.
        rising = own > np.concatenate([[np.iinfo(np.int64).min], np.maximum.accumulate(own)[:-1]])
        if not rising.all():
            notes.append(
                f"left out {np.sum(~rising)} of {len(own)} messages of {table.topic.name}, whose stamps repeat or go "
                "back"
            )
        used = np.flatnonzero(rising)
        inside = _inside(at, own[used])
        if not inside.any():
            raise DataError(
                f"{shown}: no message of {first.topic.name} lies between messages of {table.topic.name}, so they "
                "cannot be aligned; choose other topics, or one of them"
            )
        kept &= inside
        others.append((table, own[used], used))
    rows = np.flatnonzero(kept)
    names = ", ".join(table.topic.name for table in tables[1:])
    if not len(rows):
        raise DataError(
            f"{shown}: no message of {first.topic.name} lies between messages of each of {names}; choose fewer topics"
        )
    fields = {f"{first.topic.name}/{path}": _taken(each, rows) for path, each in first.fields.items()}
    for table, own, used in others:
        for path, each in table.fields.items():
            fields[f"{table.topic.name}/{path}"] = _between(each, at[rows], own, used)
    left_out = len(at) - len(rows)
    notes.append(
        f"{names} aligned to the stamps of {first.topic.name}, the first of topic=: real numbers linearly, others and "
        f"quaternions by the nearest message; left out {left_out} of {len(at)} messages of {first.topic.name} that lie "
        f"outside of the others or in their gaps (longer than {GAP_STEPS:g} typical steps)"
    )
    return Aligned(rows, fields, tuple(notes))


def _inside(at: Nanoseconds, own: Nanoseconds) -> NDArray[np.bool_]:
    """Whether each stamp is one of another topic's, or lies between two that are close enough."""
    before = np.searchsorted(own, at, side="right") - 1
    exact = (before >= 0) & (own[np.maximum(before, 0)] == at)
    if len(own) < 2:
        return exact
    steps = np.diff(own)
    between = (before >= 0) & (before < len(steps))
    close = steps[np.clip(before, 0, len(steps) - 1)] <= GAP_STEPS * np.median(steps)
    return exact | (between & close)


def _between(each: Values, at: Nanoseconds, own: Nanoseconds, used: NDArray[np.int64]) -> Values:
    values = each.values[used]
    before = np.searchsorted(own, at, side="right") - 1
    after = np.minimum(before + 1, len(own) - 1)
    length = np.maximum(own[after] - own[before], 1)
    share = (at - own[before]) / length
    if each.by_nearest:
        return Values(values[np.where(share > 0.5, after, before)], each.names, True)
    nearest = np.where((share > 0.5).reshape(-1, *[1] * (values.ndim - 1)), values[after], values[before])
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    mixed = (1.0 - share) * values[before] + share * values[after]
    mixed = np.where(_turned(values[after] - values[before], values), nearest, mixed)
    # A message that is not finite says nothing of rows that lie exactly on its neighbour.
    return Values(np.where(share == 0.0, values[before], mixed), each.names)


def _turned(steps: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether a step may be that of an angle that begins anew, between whose ends there is no value."""
    span = np.ptp(values, axis=0)
    turned = np.zeros(steps.shape, dtype=bool)
    for turn in TURNS:
        turned |= (np.abs(steps) > turn / 2) & (span <= turn * (1 + 1e-6))
    return turned


def _taken(each: Values, rows: NDArray[np.int64]) -> Values:
    return Values(each.values[rows], each.names, each.by_nearest)
