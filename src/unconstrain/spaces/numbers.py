"""States that are plain numbers."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from unconstrain.spaces.base import Array
from unconstrain.spaces.vector import Vector


@dataclass(frozen=True)
class Numbers(Vector):
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

    def difference(self, X: Array, Y: Array) -> Array:
        """Subtract; see `Space.difference`."""
        return Y - X

    def follow(self, X: Array) -> Array:
        """Return the states themselves; see `Space.follow`."""
        return X

    def find_base(self, X: Array) -> Array | None:
        """Return zero: numbers lie flat wherever they are; see `Space.find_base`."""
        return np.zeros(self.n)

    def embed(self, X: Array, base: Array | None) -> Array:
        """Return the states themselves; see `Space.embed`."""
        return X
