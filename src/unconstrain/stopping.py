"""Where a movement has to stop: outside of what was recorded, beyond limits, or out of all bounds."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.arrays import check_number, check_numbers, quote
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, UnconstrainError

Array = NDArray[np.float64]

Guard = Callable[[Array], list[str]]
"""From states (S, n) to the reason why a movement may not be in each, empty where it may."""

DIVERGED = 100.0
"""How many times as far as recorded states lie from each other a movement leads that diverges."""

OUT_OF_BOUNDS = "states or actions are no longer finite; a smaller time step dt may help"


@dataclass(frozen=True)
class Stop:
    """Where and why one of several movements had to stop.

    Parameters
    ----------
    episode : int
        Which movement.
    step : int
        How many steps it had taken.
    time : float
        Seconds since its start.
    state : ndarray of shape (n,)
        Where it stopped, which is the last of its samples.
    reason : str
        What the next step would have led to, and what allows it; arguments are written ``name=``.
    """

    episode: int
    step: int
    time: float
    state: Array
    reason: str


@dataclass(frozen=True, init=False, eq=False, repr=False)
class Movement(Demonstrations):
    """What a rollout returns: demonstrations, an episode for each start, and which of them had to stop.

    Parameters
    ----------
    *args
        As for `Demonstrations`.
    stopped : sequence of Stop
        Of those that were cut short. Empty where all of them took all steps, or ended where they were told to.
    **kwargs
        As for `Demonstrations`.
    """

    stopped: tuple[Stop, ...]

    def __init__(self, *args: Any, stopped: Sequence[Stop] = (), **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        object.__setattr__(self, "stopped", tuple(stopped))


class MovementStopped(UserWarning):
    """A movement had to stop; `Movement.stopped` of the result says which, where and why."""


class Recorded:
    """Movements stay near what was recorded.

    Parameters
    ----------
    policy : Policy
        Of this library.
    beyond : float, optional
        How far from recorded states they may lead, in the policy's `distance_unit_`; by default as far as recordings
        lead from each other, infinite for as far as they like unless they diverge.

    Raises
    ------
    DataError
        `beyond` is no number above zero.
    """

    def __init__(self, policy: Any, beyond: float | None = None) -> None:
        self.unit, self.lay_out, self.region = policy.distance_unit_, policy.model_.lay_out, policy.region()
        beyond = policy.usual_distance() if beyond is None else beyond
        self.beyond = np.inf if beyond == np.inf else check_number(beyond, "beyond", positive=True)
        farthest = DIVERGED * self.region.extent
        self.diverged = farthest if self.beyond == np.inf else max(farthest, self.beyond)

    def __call__(self, X: Array) -> list[str]:
        """Say why a movement may not be in states (S, n)."""
        return [self._reason(away) for away in self.region.distance(self.lay_out(X))]

    def _reason(self, away: float) -> str:
        unit = self.unit
        if away > self.diverged:
            return f"the movement diverges: it leads {away:.3g} {unit} away from all recorded states"
        if away > self.beyond:
            return (
                f"the movement leaves what was recorded: it leads {away:.4g} {unit} away from all recorded states, "
                f"more than {self.beyond:.4g}; say with beyond= how far it may lead, or that it may lead anywhere"
            )
        return ""


class Limits:
    """States stay within limits, such as those of joints.

    Parameters
    ----------
    limits : sequence of n pairs, or mapping from str to pairs
        The least and the largest value of each state, in its unit as it is recorded; None, NaN or infinity where there
        is none. A mapping has them by the states' names.
    names : sequence of str
        Of the n states.
    outward : callable, optional
        From states (S, n) as a policy has them to those that the limits are for.

    Raises
    ------
    DataError
        They are no such pairs, or there is no state of a name.
    """

    def __init__(
        self, limits: Any, names: Sequence[str], outward: Callable[[Array], Array] | None = None
    ) -> None:
        self.names, self.outward = tuple(names), outward
        self.least, self.largest = _parse_limits(limits, self.names).T

    def __call__(self, X: Array) -> list[str]:
        """Say why a movement may not be in states (S, n)."""
        X = X if self.outward is None else self.outward(X)
        return [self._reason(x) for x in X]

    def _reason(self, x: Array) -> str:
        for outside, bound, kind in (
            (x < self.least, self.least, "lower"),
            (x > self.largest, self.largest, "upper"),
        ):
            if outside.any():
                k = int(np.argmax(outside))
                return (
                    f"the movement leaves the limits: {self.names[k]} would be {x[k]:.4g}, and its {kind} limit is "
                    f"{bound[k]:.4g}"
                )
        return ""


def _parse_limits(limits: Any, names: tuple[str, ...]) -> Array:
    """Return limits as (n, 2), infinite where there are none."""
    if isinstance(limits, Mapping):
        unknown = [str(name) for name in limits if name not in names]
        if unknown:
            raise DataError(f"limits= names {quote(unknown[0])}, and the states are {', '.join(names)}")
        limits = [limits.get(name) for name in names]
    try:
        pairs = [(None, None) if pair is None else tuple(pair) for pair in limits]
    except TypeError:
        pairs = []
    if len(pairs) != len(names) or any(len(pair) != 2 for pair in pairs):
        raise DataError(
            f"limits= must have a least and a largest value for each of {len(names)} states, got {quote(limits)}"
        )
    none = (-np.inf, np.inf)
    bounds = check_numbers(
        [[none[k] if value is None else value for k, value in enumerate(pair)] for pair in pairs], "limits"
    )
    bounds = np.where(np.isnan(bounds), none, bounds)
    crossed = np.flatnonzero(bounds[:, 0] > bounds[:, 1])
    if len(crossed):
        low, high = bounds[crossed[0]]
        raise DataError(f"the limits of {names[crossed[0]]} are {low:g} to {high:g}: the least comes first")
    return bounds


def describe_stop(stop: Stop, steps: int, names: Sequence[str], state: Array | None = None) -> str:
    """Say in a sentence where a movement stopped, and why.

    Parameters
    ----------
    stop : Stop
        Of it.
    steps : int
        How many steps it should have taken.
    names : sequence of str
        Of the states.
    state : ndarray of shape (n,), optional
        In place of its own, where it is to be told in another frame.

    Returns
    -------
    str
        A sentence.
    """
    place = ", ".join(
        f"{name} {value:.4g}"
        for name, value in zip(names, stop.state if state is None else state, strict=True)
    )
    where = "at the start" if stop.step == 0 else f"after {stop.step} of {steps} steps ({stop.time:g} s)"
    return f"stopped {where}, at {place}: {stop.reason}"


def check_inside(limits: Limits, X: Array) -> None:
    """Refuse starts that are beyond limits already.

    Parameters
    ----------
    limits : Limits
        Of the states.
    X : ndarray of shape (S, n)
        Starts.

    Raises
    ------
    UnconstrainError
        One is.
    """
    for reason in limits(X):
        if reason:
            raise UnconstrainError(f"the start is outside: {reason}; start within them, or correct limits=")
