"""Angles: one number, to which a turn may be added."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.spaces.base import Array, Space

# Angles that lie within this share of a turn are laid out on a line; others on a circle.
LINE = 0.85


@dataclass(frozen=True)
class Angle(Space):
    """An angle, the same after a turn.

    Parameters
    ----------
    turn : float
        A turn in the unit of the angle: 2π, or 360.
    """

    turn: float = 2 * np.pi

    @property
    def n_states(self) -> int:
        """One number."""
        return 1

    @property
    def n_actions(self) -> int:
        """One number, in the unit of the angle a second."""
        return 1

    @property
    def origin(self) -> Array:
        """Zero."""
        return np.zeros(1)

    @property
    def units(self) -> tuple[str, ...]:
        """Radians, or degrees."""
        return ("deg" if self.turn == 360 else "rad",)

    @property
    def words(self) -> str:
        """What states are, for a note."""
        return "an angle in degrees" if self.turn == 360 else "an angle in radians"

    def describe(self) -> dict[str, Any]:
        """Say what it is in plain values; see `Space.describe`."""
        return {"angle": self.turn}

    def action_names(self, names: Sequence[str]) -> tuple[str, ...]:
        """Name the velocity; see `Space.action_names`."""
        return (f"{names[0]}_dot",)

    def faults(self, X: Array) -> NDArray[np.bool_]:
        """Find none; see `Space.faults`."""
        return np.zeros(len(X), dtype=bool)

    def difference(self, X: Array, Y: Array) -> Array:
        """Subtract, less whole turns; see `Space.difference`."""
        return self._wrap(Y - X)

    def step(self, X: Array, U: Array, dt: float | Array) -> Array:
        """Compute `x + dt u`, on which turns are counted; see `Space.step`."""
        return X + dt * U

    def follow(self, X: Array) -> Array:
        """Count turns on; see `Space.follow`."""
        return np.unwrap(X, period=self.turn, axis=0)

    def coordinates(self, X: Array) -> Array:
        """Return the states themselves; see `Space.coordinates`."""
        return X

    def velocity(self, C: Array, slopes: Array) -> Array:
        """Return the slopes themselves; see `Space.velocity`."""
        return slopes

    def relative(self, X: Array, to: Array) -> Array:
        """Compute `x - r`; see `Space.relative`."""
        return X - to

    def absolute(self, X: Array, to: Array) -> Array:
        """Compute `x + r`; see `Space.absolute`."""
        return X + to

    def relative_velocity(self, X: Array, U: Array, to: Array, moves: Array) -> Array:
        """Compute `u - ṙ`; see `Space.relative_velocity`."""
        return U - moves

    def absolute_velocity(self, U: Array, to: Array) -> Array:
        """Return the velocities themselves; see `Space.absolute_velocity`."""
        return U

    def find_base(self, X: Array) -> Array | None:
        """Find the middle of the arc that all angles lie in; None where it is nearly a turn. See `Space.find_base`."""
        around = np.sort(np.mod(X[:, 0], self.turn))
        free = np.diff(around, append=around[0] + self.turn)
        widest = int(np.argmax(free))
        arc = self.turn - free[widest]
        if arc > LINE * self.turn:
            return None
        return np.array([self._wrap(around[(widest + 1) % len(around)] + arc / 2)])

    def embed(self, X: Array, base: Array | None) -> Array:
        """Lay angles out on a line about the base, or on a circle of the turn's length; see `Space.embed`."""
        if base is not None:
            return self._wrap(X - base)
        radius = self.turn / (2 * np.pi)
        return radius * np.hstack([np.cos(X / radius), np.sin(X / radius)])

    def _wrap(self, X: Array) -> Array:
        return X - self.turn * np.round(X / self.turn)
