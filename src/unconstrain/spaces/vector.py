"""What states have in common that are added to: numbers, and angles apart from whole turns."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from unconstrain.spaces.base import Array, Space


class Vector(Space):
    """States whose velocities are their derivatives, and whose frames are told apart by subtraction."""

    @property
    def n_actions(self) -> int:
        """As many as states."""
        return self.n_states

    @property
    def origin(self) -> Array:
        """Zero."""
        return np.zeros(self.n_states)

    def action_names(self, names: Sequence[str]) -> tuple[str, ...]:
        """Name the velocities; see `Space.action_names`."""
        return tuple(f"{name}_dot" for name in names)

    def faults(self, X: Array) -> NDArray[np.bool_]:
        """Find none: any numbers are a state; see `Space.faults`."""
        return np.zeros(len(X), dtype=bool)

    def step(self, X: Array, U: Array, dt: float | Array) -> Array:
        """Compute `x + dt u`; see `Space.step`."""
        return X + dt * U

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
