"""States with how far a movement has come."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.spaces.base import Array, Space

ROUNDING = 1e-9
"""By how much a phase may lie outside of 0 to 1."""


@dataclass(frozen=True)
class Phased(Space):
    """A state and its phase (x, s), which goes from 0 at a movement's start to 1 at its end; actions are those of x.

    Movements that dwell, or that come back the way they went, have several velocities at a place, but one at a place
    and a phase. The phase goes by the clock, `ṡ = 1 / T`, whatever the actions are, and is held at 1.

    Parameters
    ----------
    of : Space
        What x is.
    duration : float
        How long a movement takes, T, in seconds.

    Raises
    ------
    ValueError
        The duration is not a positive number.
    """

    of: Space
    duration: float

    def __post_init__(self) -> None:
        if not 0 < self.duration < np.inf:
            raise ValueError(f"duration must be a positive number of seconds, got {self.duration!r:.40}")

    @property
    def n_states(self) -> int:
        """Numbers of a state and its phase."""
        return self.of.n_states + 1

    @property
    def n_actions(self) -> int:
        """As many as those of x."""
        return self.of.n_actions

    @property
    def origin(self) -> Array:
        """The origin, at the start of a movement."""
        return np.append(self.of.origin, 0.0)

    @property
    def n_places(self) -> int:
        """Those of x: what is at rest begins at phase 0."""
        return self.of.n_places

    @property
    def units(self) -> tuple[str, ...]:
        """Those of x."""
        return self.of.units

    @property
    def blocks(self) -> tuple[tuple[int, bool], ...]:
        """Those of x; see `Space.blocks`."""
        return self.of.blocks

    @property
    def words(self) -> str:
        """What states are, for a note."""
        return f"{self.of.words}, and a phase from 0 to 1"

    def describe(self) -> dict[str, Any]:
        """Say what it is in plain values; see `Space.describe`."""
        return {"phased": self.of.describe(), "duration": self.duration}

    def state_names(self, names: Sequence[str]) -> tuple[str, ...]:
        """Name states and phase.

        Parameters
        ----------
        names : sequence of str
            Of x.

        Returns
        -------
        tuple of str
            Of (x, s).
        """
        return (*names, "phase" if "phase" not in names else "phase_of_episode")

    def action_names(self, names: Sequence[str]) -> tuple[str, ...]:
        """Name the actions after x; see `Space.action_names`."""
        return self.of.action_names(names[: self.of.n_states])

    def faults(self, X: Array) -> NDArray[np.bool_]:
        """Find rows that are no state, or whose phase is not from 0 to 1; see `Space.faults`."""
        s = X[:, -1]
        return self.of.faults(self._x(X)) | (s < -ROUNDING) | (s > 1.0 + ROUNDING)

    def difference(self, X: Array, Y: Array) -> Array:
        """Compute the velocity that leads from one x to the other; see `Space.difference`."""
        return self.of.difference(self._x(X), self._x(Y))

    def step(self, X: Array, U: Array, dt: float | Array) -> Array:
        """Follow actions, and go on to the phase `min(s + dt / T, 1)`; see `Space.step`."""
        return self._with(self.of.step(self._x(X), U, dt), np.minimum(X[:, -1:] + dt / self.duration, 1.0))

    def between(self, X: Array, Y: Array, share: Array) -> Array:
        """Interpolate both; see `Space.between`."""
        s = X[:, -1:] + share[:, None] * (Y[:, -1:] - X[:, -1:])
        return self._with(self.of.between(self._x(X), self._x(Y), share), s)

    def follow(self, X: Array) -> Array:
        """Make an episode continuous; see `Space.follow`."""
        return self._with(self.of.follow(self._x(X)), X[:, -1:])

    def coordinates(self, X: Array) -> Array:
        """Return those of x; see `Space.coordinates`."""
        return self.of.coordinates(self._x(X))

    def velocity(self, C: Array, slopes: Array) -> Array:
        """Turn derivatives into velocities of x; see `Space.velocity`."""
        return self.of.velocity(C, slopes)

    def relative(self, X: Array, to: Array) -> Array:
        """Express x in the frame of others, which have no say in the phase; see `Space.relative`."""
        return self._with(self.of.relative(self._x(X), self._x(to)), X[:, -1:])

    def absolute(self, X: Array, to: Array) -> Array:
        """Undo `relative`; see `Space.absolute`."""
        return self._with(self.of.absolute(self._x(X), self._x(to)), X[:, -1:])

    def relative_velocity(self, X: Array, U: Array, to: Array, moves: Array) -> Array:
        """Express velocities in the frame of other states; see `Space.relative_velocity`."""
        return self.of.relative_velocity(self._x(X), U, self._x(to), moves)

    def absolute_velocity(self, U: Array, to: Array) -> Array:
        """Undo `relative_velocity`; see `Space.absolute_velocity`."""
        return self.of.absolute_velocity(U, self._x(to))

    def offsets(self, X: Array) -> Array:
        """Compute how far x lies from a typical one; see `Space.offsets`."""
        return self.of.offsets(self._x(X))

    def find_base(self, X: Array) -> Array | None:
        """Find the base of x; see `Space.find_base`."""
        base = self.of.find_base(self._x(X))
        return None if base is None else np.append(base, 0.0)

    def embed(self, X: Array, base: Array | None) -> Array:
        """Lay out x, and the phase beside it, held within 0 to 1; see `Space.embed`."""
        zero = None if base is None else base[: self.of.n_states]
        return self._with(self.of.embed(self._x(X), zero), np.clip(X[:, -1:], 0.0, 1.0))

    def _x(self, X: Array) -> Array:
        return X[:, : self.of.n_states]

    @staticmethod
    def _with(x: Array, s: Array) -> Array:
        return np.hstack([x, s])
