"""What is done to a recording before it is learnt from."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from numbers import Real

from unconstrain.errors import DataError, show
from unconstrain.spaces.words import FRAMES

TIME_UNITS = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
"""Ticks a second."""

DROPPED = ("missing", "duplicates", "short", "pauses")
"""What `drop` may leave out."""

ACTION_KINDS = ("velocity", "target", "increment")
"""What recorded actions may be."""

TIME_AXES = ("first", "last")

ANGLE_UNITS = ("rad", "deg")

ORDERS = (1, 2)

# Of smaller numbers the inverse, such as the step of a rate, is infinite.
SMALLEST = 1e-300

CHOICES = {
    "time_unit": tuple(TIME_UNITS),
    "action_is": ACTION_KINDS,
    "time_axis": TIME_AXES,
    "angle_unit": ANGLE_UNITS,
    "angular_velocity": FRAMES,
}
"""Options that take one of some words."""


@dataclass(frozen=True)
class Preparation:
    """How samples are timed, differentiated, split and left out.

    Parameters
    ----------
    time_unit : {"s", "ms", "us", "ns"}, optional
        The unit of numbers in the time column. By default it is guessed, and the guess is noted.
    rate : float, optional
        Samples a second. Without a time column the time of a row is its number within the episode / `rate`; with one,
        the column counts frames, of which there are `rate` a second.
    action_is : {"velocity", "target", "increment"}, optional
        What recorded actions are: velocities, commanded states (the states are differentiated instead), or steps
        (divided by the time that passes). By default it is found by comparing them with the states, and noted.
    drop : str, or list of str, optional
        What is left out and counted, separated by commas: missing (rows without a state, an action or a stamp),
        duplicates (rows with the stamp of the row before), short (episodes too short to be used), pauses (stretches at
        rest).
    resample : float, optional
        Samples a second to which episodes are brought by linear interpolation, never across gaps. Columns that are
        filled at different rates are interpolated each between its own stamps.
    window : float, optional
        Seconds over which states are smoothed when they are differentiated. By default it is found from their noise
        (`recordings.smoothing`), and noted.
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
    moving_centre : float, optional
        States and actions are taken relative to their mean over so many seconds (the standard deviation of a Gaussian),
        for movements such as circles about a centre that wanders. Several times shorter than it wanders, and longer
        than a turn takes.
    time_axis : {"first", "last"}, optional
        Which axis of a demonstration's arrays is time, in MATLAB, HDF5 and .npy files. By default it is found, which is
        noted.

    angle_unit : {"rad", "deg"}, optional
        The unit of angles, rotation vectors, and roll, pitch and yaw. By default it is found by their size, which is
        noted.
    angular_velocity : {"world", "body"}, optional
        The frame of the angular velocities that actions of rotations are. Recorded ones are compared with the states by
        default, which is noted; of others it is the world's.
    order : int
        2 adds velocities to the states, and makes accelerations the actions: for movements that cross themselves.
    phase : bool
        Add to the states how far an episode has come, from 0 at its start to 1 at its end: for movements that dwell, or
        that come back the way they went. The policy goes by the clock then.

    Raises
    ------
    DataError
        A number is not positive and finite, `phase` is no truth value, or a word is none of those that are known.
    """

    time_unit: str | None = None
    rate: float | None = None
    action_is: str | None = None
    drop: str | Sequence[str] | None = None
    resample: float | None = None
    window: float | None = None
    gap: float | None = None
    max_speed: float | None = None
    min_speed: float | None = None
    min_duration: float | None = None
    force_threshold: float | None = None
    moving_centre: float | None = None
    time_axis: str | None = None
    angle_unit: str | None = None
    angular_velocity: str | None = None
    order: int = 1
    phase: bool = False

    def __post_init__(self) -> None:
        for name, words in CHOICES.items():
            word = getattr(self, name)
            if word is not None and not (isinstance(word, str) and word in words):
                raise DataError(f"{name} must be one of {', '.join(words)}, got {show(word)}")
        if self.drop is not None:
            object.__setattr__(self, "drop", _listed(self.drop))
        if self.rate is not None and self.time_unit is not None:
            raise DataError(
                "rate= says that the time column counts frames, and time_unit= that it holds times: leave out one"
            )
        if isinstance(self.order, bool) or self.order not in ORDERS:
            raise DataError(f"order must be 1 or 2, got {show(self.order)}")
        if not isinstance(self.phase, bool):
            raise DataError(f"phase must be True or False, got {show(self.phase)}")
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name in (*CHOICES, "drop", "phase") or value is None:
                continue
            try:
                number = float(value)
            except (TypeError, ValueError, OverflowError):
                number = math.nan
            if isinstance(value, bool) or not isinstance(value, Real) or not SMALLEST < number < math.inf:
                raise DataError(f"{field.name} must be a positive number, got {show(value)}")

    def drops(self, what: str) -> bool:
        """Whether something is left out.

        Parameters
        ----------
        what : {"missing", "duplicates", "short", "pauses"}

        Returns
        -------
        bool
            Whether `drop` names it.
        """
        return isinstance(self.drop, str) and what in self.drop.split(",")


def _listed(drop: object) -> str | None:
    """Write what is to be dropped in one way, so that equal preparations compare equal."""
    each = drop.split(",") if isinstance(drop, str) else drop
    words = (
        [word.strip() if isinstance(word, str) else word for word in each]
        if isinstance(each, Sequence)
        else [drop]
    )
    odd = [word for word in words if word not in DROPPED]
    if odd:
        raise DataError(f"drop takes {', '.join(DROPPED)}, separated by commas, got {show(odd[0])}")
    return ",".join(word for word in DROPPED if word in words) or None
