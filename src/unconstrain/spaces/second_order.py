"""States with their velocities, whose actions are accelerations."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.spaces.base import Array, Space


@dataclass(frozen=True)
class SecondOrder(Space):
    """A state and its velocity (x, ẋ); actions are accelerations ẍ.

    Movements that cross themselves have several velocities at a place, but one acceleration at a place and a velocity.

    Parameters
    ----------
    of : Space
        What x is.
    """

    of: Space

    @property
    def n_states(self) -> int:
        """Numbers of a state and its velocity."""
        return self.of.n_states + self.of.n_actions

    @property
    def n_actions(self) -> int:
        """As many as a velocity has."""
        return self.of.n_actions

    @property
    def origin(self) -> Array:
        """The origin, at rest."""
        return np.append(self.of.origin, np.zeros(self.n_actions))

    @property
    def n_places(self) -> int:
        """Those of x."""
        return self.of.n_states

    @property
    def units(self) -> tuple[str, ...]:
        """Those of the state's velocity."""
        return self.of.units

    @property
    def words(self) -> str:
        """What states are, for a note."""
        return f"{self.of.words}, and their velocities"

    def describe(self) -> dict[str, Any]:
        """Say what it is in plain values; see `Space.describe`."""
        return {"second_order": self.of.describe()}

    def state_names(self, names: Sequence[str]) -> tuple[str, ...]:
        """Name states and velocities.

        Parameters
        ----------
        names : sequence of str
            Of x.

        Returns
        -------
        tuple of str
            Of (x, ẋ).
        """
        return (*names, *self.of.action_names(names))

    def action_names(self, names: Sequence[str]) -> tuple[str, ...]:
        """Name the accelerations; see `Space.action_names`."""
        return tuple(f"{name.removesuffix('_dot')}_ddot" for name in names[self.of.n_states :])

    def faults(self, X: Array) -> NDArray[np.bool_]:
        """Find rows that are no state; see `Space.faults`."""
        return self.of.faults(self._x(X))

    def difference(self, X: Array, Y: Array) -> Array:
        """Compute the acceleration that leads from one velocity to the other; see `Space.difference`."""
        return self._v(Y) - self._v(X)

    def step(self, X: Array, U: Array, dt: float | Array) -> Array:
        """Compute `x + dt ẋ + dt² ẍ / 2` and `ẋ + dt ẍ`; see `Space.step`."""
        v = self._v(X)
        return np.hstack([self.of.step(self._x(X), v + 0.5 * dt * U, dt), v + dt * U])

    def between(self, X: Array, Y: Array, share: Array) -> Array:
        """Interpolate both; see `Space.between`."""
        v = self._v(X) + share[:, None] * (self._v(Y) - self._v(X))
        return np.hstack([self.of.between(self._x(X), self._x(Y), share), v])

    def follow(self, X: Array) -> Array:
        """Make an episode continuous; see `Space.follow`."""
        return np.hstack([self.of.follow(self._x(X)), self._v(X)])

    def coordinates(self, X: Array) -> Array:
        """Return the velocities; see `Space.coordinates`."""
        return self._v(X)

    def velocity(self, C: Array, slopes: Array) -> Array:
        """Return the slopes of the velocities; see `Space.velocity`."""
        return slopes

    def relative(self, X: Array, to: Array) -> Array:
        """Express states and velocities in the frame of others; see `Space.relative`."""
        x, r = self._x(X), self._x(to)
        return np.hstack([self.of.relative(x, r), self.of.relative_velocity(x, self._v(X), r, self._v(to))])

    def absolute(self, X: Array, to: Array) -> Array:
        """Undo `relative` for a frame that rests; see `Space.absolute`."""
        r = self._x(to)
        return np.hstack([self.of.absolute(self._x(X), r), self.of.absolute_velocity(self._v(X), r)])

    def relative_velocity(self, X: Array, U: Array, to: Array, moves: Array) -> Array:
        """Express accelerations in a frame that does not accelerate; see `Space.relative_velocity`."""
        return self.of.relative_velocity(self._x(X), U, self._x(to), np.zeros_like(U))

    def absolute_velocity(self, U: Array, to: Array) -> Array:
        """Undo `relative_velocity`; see `Space.absolute_velocity`."""
        return self.of.absolute_velocity(U, self._x(to))

    def offsets(self, X: Array) -> Array:
        """Compute how far x lies from a typical one; see `Space.offsets`."""
        return self.of.offsets(self._x(X))

    def find_base(self, X: Array) -> Array | None:
        """Find the base of the states; see `Space.find_base`."""
        base = self.of.find_base(self._x(X))
        return None if base is None else np.append(base, np.zeros(self.n_actions))

    def embed(self, X: Array, base: Array | None) -> Array:
        """Lay out states, and velocities beside them; see `Space.embed`."""
        zero = None if base is None else base[: self.of.n_states]
        return np.hstack([self.of.embed(self._x(X), zero), self._v(X)])

    def _x(self, X: Array) -> Array:
        return X[:, : self.of.n_states]

    def _v(self, X: Array) -> Array:
        return X[:, self.of.n_states :]
