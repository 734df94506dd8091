"""Angles: one number, to which a turn may be added."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from unconstrain.spaces.base import Array
from unconstrain.spaces.vector import Vector

# Angles that lie within this share of a turn are laid out on a line; others on a circle.
LINE = 0.85


@dataclass(frozen=True)
class Angle(Vector):
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

    def difference(self, X: Array, Y: Array) -> Array:
        """Subtract, less whole turns; see `Space.difference`."""
        return self._wrap(Y - X)

    def follow(self, X: Array) -> Array:
        """Count turns on; see `Space.follow`."""
        return np.unwrap(X, period=self.turn, axis=0)

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
