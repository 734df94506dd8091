"""States that are plain numbers."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.spaces.base import Array, Space


@dataclass(frozen=True)
class Numbers(Space):
    """Plain numbers: positions, lengths, joint angles that do not turn round.

    Parameters
    ----------
    n : int
        How many.
    """

    n: int

    @property
    def n_states(self) -> int:
        """How many numbers stand for a state."""
        return self.n

    @property
    def n_actions(self) -> int:
        """As many as states."""
        return self.n

    @property
    def origin(self) -> Array:
        """Zero."""
        return np.zeros(self.n)

    @property
    def units(self) -> tuple[str, ...]:
        """The unit of the numbers."""
        return ("1",) * self.n

    @property
    def is_flat(self) -> bool:
        """True."""
        return True

    @property
    def words(self) -> str:
        """What states are, for a note."""
        return f"{self.n} number{'' if self.n == 1 else 's'}"

    def describe(self) -> dict[str, Any]:
        """Say what it is in plain values; see `Space.describe`."""
        return {"numbers": self.n}

    def action_names(self, names: Sequence[str]) -> tuple[str, ...]:
        """Name the velocities; see `Space.action_names`."""
        return tuple(f"{name}_dot" for name in names)

    def faults(self, X: Array) -> NDArray[np.bool_]:
        """Find none: any numbers are a state; see `Space.faults`."""
        return np.zeros(len(X), dtype=bool)

    def difference(self, X: Array, Y: Array) -> Array:
        """Subtract; see `Space.difference`."""
        return Y - X

    def step(self, X: Array, U: Array, dt: float | Array) -> Array:
        """Compute `x + dt u`; see `Space.step`."""
        return X + dt * U

    def follow(self, X: Array) -> Array:
        """Return the states themselves; see `Space.follow`."""
        return X

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
        """Return zero: numbers lie flat wherever they are; see `Space.find_base`."""
        return np.zeros(self.n)

    def embed(self, X: Array, base: Array | None) -> Array:
        """Return the states themselves; see `Space.embed`."""
        return X
