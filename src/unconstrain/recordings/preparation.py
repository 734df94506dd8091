"""What is done to a recording before it is learnt from."""

import math
from dataclasses import dataclass, fields
from numbers import Real

from unconstrain.errors import DataError

TIME_UNITS = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
"""Ticks a second."""

TIME_AXES = ("first", "last")


@dataclass(frozen=True)
class Preparation:
    """How samples are timed, differentiated, split and left out.

    Parameters
    ----------
    time_unit : {"s", "ms", "us", "ns"}, optional
        The unit of numbers in the time column. By default it is guessed, and the guess is noted.
    window : float
        Seconds over which states are smoothed when they are differentiated.
    gap : float, optional
        A step longer than this (s) splits an episode. By default, where states are differentiated, five times the
        episode's median step does.
    max_speed : float, optional
        A step faster than this ([units of the states] / s) splits an episode, since trackers flip and jump.
    min_speed : float, optional
        Samples with an action shorter than this ([units of the actions]) are left out.
    min_duration : float, optional
        Fragments of a split episode that are shorter than this (s) are dropped. Episodes that were not split stay.
    force_threshold : float, optional
        A force above this, in its own unit, is a contact. Needed where `force` is given.
    time_axis : {"first", "last"}, optional
        Which axis of a demonstration's arrays is time, in MATLAB, HDF5 and .npy files. By default it is found, which is
        noted.

    Raises
    ------
    DataError
        A number is not positive and finite, or the time unit or axis is unknown.
    """

    time_unit: str | None = None
    window: float = 0.2
    gap: float | None = None
    max_speed: float | None = None
    min_speed: float | None = None
    min_duration: float | None = None
    force_threshold: float | None = None
    time_axis: str | None = None

    def __post_init__(self) -> None:
        unit = self.time_unit
        if unit is not None and not (isinstance(unit, str) and unit in TIME_UNITS):
            raise DataError(
                f"time_unit must be one of {', '.join(TIME_UNITS)}, got {' '.join(repr(unit).split()):.60}"
            )
        axis = self.time_axis
        if axis is not None and not (isinstance(axis, str) and axis in TIME_AXES):
            raise DataError(
                f"time_axis must be one of {', '.join(TIME_AXES)}, got {' '.join(repr(axis).split()):.60}"
            )
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name in ("time_unit", "time_axis") or value is None:
                continue
            try:
                number = float(value)
            except (TypeError, ValueError, OverflowError):
                number = math.nan
            if isinstance(value, bool) or not isinstance(value, Real) or not 0 < number < math.inf:
                raise DataError(
                    f"{field.name} must be a positive number, got {' '.join(repr(value).split()):.60}"
                )
