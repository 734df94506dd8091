"""States that are made of several."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from unconstrain.spaces.base import Array, Space
from unconstrain.spaces.numbers import Numbers
from unconstrain.spaces.rotation import QUATERNION, Rotation


@dataclass(frozen=True)
class Product(Space):
    """A state of several parts, each in columns of its own; velocities follow each other in the order of the parts.

    Parameters
    ----------
    parts : tuple of Space
        The parts.
    columns : tuple of tuple of int
        Which of the state's numbers each part consists of.
    """

    parts: tuple[Space, ...]
    columns: tuple[tuple[int, ...], ...]

    @classmethod
    def of(cls, *parts: Space) -> Self:
        """Put parts one after the other.

        Parameters
        ----------
        *parts : Space
            In the order of the columns.

        Returns
        -------
        Product
            Of them.
        """
        ends = np.cumsum([part.n_states for part in parts]).tolist()
        columns = tuple(tuple(range(end - part.n_states, end)) for part, end in zip(parts, ends, strict=True))
        return cls(parts, columns)

    @property
    def n_states(self) -> int:
        """How many numbers stand for a state."""
        return sum(part.n_states for part in self.parts)

    @property
    def n_actions(self) -> int:
        """How many numbers a velocity has."""
        return sum(part.n_actions for part in self.parts)

    @property
    def origin(self) -> Array:
        """The origin of each part."""
        return self._states(np.empty((1, self.n_states)), lambda part, own, at: part.origin[None])[0]

    @property
    def units(self) -> tuple[str, ...]:
        """The units of each part."""
        return tuple(unit for part in self.parts for unit in part.units)

    @property
    def blocks(self) -> tuple[tuple[int, bool], ...]:
        """Those of each part; see `Space.blocks`."""
        return tuple(block for part in self.parts for block in part.blocks)

    @property
    def is_flat(self) -> bool:
        """Whether all parts are."""
        return all(part.is_flat for part in self.parts)

    @property
    def words(self) -> str:
        """What states are, for a note."""
        return ", ".join(part.words for part in self.parts)

    def describe(self) -> dict[str, Any]:
        """Say what it is in plain values; see `Space.describe`."""
        return {
            "parts": [part.describe() for part in self.parts],
            "columns": [list(columns) for columns in self.columns],
        }

    def action_names(self, names: Sequence[str]) -> tuple[str, ...]:
        """Name the velocities; see `Space.action_names`."""
        each = (
            part.action_names([names[i] for i in own])
            for part, own in zip(self.parts, self.columns, strict=True)
        )
        return tuple(name for one in each for name in one)

    def faults(self, X: Array) -> NDArray[np.bool_]:
        """Find rows that are no state in any part; see `Space.faults`."""
        each = [part.faults(X[:, own]) for part, own in zip(self.parts, self.columns, strict=True)]
        return np.any(each, axis=0)

    def difference(self, X: Array, Y: Array) -> Array:
        """Compute the velocities that lead from one to the other; see `Space.difference`."""
        return self._velocities(lambda part, own, _: part.difference(X[:, own], Y[:, own]))

    def step(self, X: Array, U: Array, dt: float | Array) -> Array:
        """Follow actions; see `Space.step`."""
        return self._states(X, lambda part, own, at: part.step(X[:, own], U[:, at], dt))

    def follow(self, X: Array) -> Array:
        """Make an episode continuous; see `Space.follow`."""
        return self._states(X, lambda part, own, _: part.follow(X[:, own]))

    def coordinates(self, X: Array) -> Array:
        """Return the coordinates of all parts side by side; see `Space.coordinates`."""
        return self._velocities(lambda part, own, _: part.coordinates(X[:, own]))

    def velocity(self, C: Array, slopes: Array) -> Array:
        """Turn derivatives into velocities; see `Space.velocity`."""
        every, begin = [], 0
        for part in self.parts:
            width = part.coordinates(part.origin[None]).shape[1]
            at = slice(begin, begin + width)
            every.append(part.velocity(C[:, at], slopes[:, at]))
            begin += width
        return np.hstack(every)

    def relative(self, X: Array, to: Array) -> Array:
        """Express each part in the frame of its like; see `Space.relative`."""
        return self._states(X, lambda part, own, _: part.relative(X[:, own], to[:, own]))

    def absolute(self, X: Array, to: Array) -> Array:
        """Undo `relative`; see `Space.absolute`."""
        return self._states(X, lambda part, own, _: part.absolute(X[:, own], to[:, own]))

    def relative_velocity(self, X: Array, U: Array, to: Array, moves: Array) -> Array:
        """Express velocities in the frame of others; see `Space.relative_velocity`."""
        return self._velocities(
            lambda part, own, at: part.relative_velocity(X[:, own], U[:, at], to[:, own], moves[:, at])
        )

    def absolute_velocity(self, U: Array, to: Array) -> Array:
        """Undo `relative_velocity` for a frame that rests; see `Space.absolute_velocity`."""
        return self._velocities(lambda part, own, at: part.absolute_velocity(U[:, at], to[:, own]))

    def find_base(self, X: Array) -> Array | None:
        """Find the base of each part, NaN where one goes all the way round; see `Space.find_base`."""
        base = np.full(self.n_states, np.nan)
        for part, own in zip(self.parts, self.columns, strict=True):
            found = part.find_base(X[:, own])
            if found is not None:
                base[list(own)] = found
        return base

    def embed(self, X: Array, base: Array | None) -> Array:
        """Lay out each part; see `Space.embed`."""

        def laid_out(part: Space, own: list[int], _: slice) -> Array:
            zero = None if base is None or np.isnan(base[own]).any() else base[own]
            return part.embed(X[:, own], zero)

        return self._velocities(laid_out)

    def _velocities(self, compute: Callable[[Space, list[int], slice], Array]) -> Array:
        """Put what is computed for each part, its columns and those of its actions, side by side."""
        every, begin = [], 0
        for part, own in zip(self.parts, self.columns, strict=True):
            every.append(compute(part, list(own), slice(begin, begin + part.n_actions)))
            begin += part.n_actions
        return np.hstack(every)

    def _states(self, X: Array, compute: Callable[[Space, list[int], slice], Array]) -> Array:
        """Put what is computed for each part where its columns are."""
        result, begin = np.empty((len(X), self.n_states)), 0
        for part, own in zip(self.parts, self.columns, strict=True):
            result[:, list(own)] = compute(part, list(own), slice(begin, begin + part.n_actions))
            begin += part.n_actions
        return result


@dataclass(frozen=True)
class Pose(Product):
    """A position and a rotation, which are taken relative to others together, as a frame.

    A pose (p, R) relative to another is `(R_toᵀ (p - p_to), R_toᵀ R)`, its velocity
    `R_toᵀ (v - v_to - ω_to x (p - p_to))`.

    Parameters
    ----------
    parts : tuple of Space
        Three numbers and a `Rotation`.
    columns : tuple of tuple of int
        Of both.
    """

    parts: tuple[Space, ...] = (Numbers(3), QUATERNION)
    columns: tuple[tuple[int, ...], ...] = ((0, 1, 2), (3, 4, 5, 6))

    @property
    def words(self) -> str:
        """What states are, for a note."""
        return f"poses, their rotations as {self.parts[1].words}"

    def describe(self) -> dict[str, Any]:
        """Say what it is in plain values; see `Space.describe`."""
        return {"pose": self.parts[1].describe(), "columns": [list(columns) for columns in self.columns]}

    def relative(self, X: Array, to: Array) -> Array:
        """Express poses in the frame of others; see `Space.relative`."""
        position, rotation = (list(own) for own in self.columns)
        result = np.empty_like(X)
        frames = self._rotation.rotations(to[:, rotation])
        result[:, position] = frames.inv().apply(X[:, position] - to[:, position])
        result[:, rotation] = self._rotation.relative(X[:, rotation], to[:, rotation])
        return result

    def absolute(self, X: Array, to: Array) -> Array:
        """Undo `relative`; see `Space.absolute`."""
        position, rotation = (list(own) for own in self.columns)
        result = np.empty_like(X)
        frames = self._rotation.rotations(to[:, rotation])
        result[:, position] = frames.apply(X[:, position]) + to[:, position]
        result[:, rotation] = self._rotation.absolute(X[:, rotation], to[:, rotation])
        return result

    def relative_velocity(self, X: Array, U: Array, to: Array, moves: Array) -> Array:
        """Express velocities in the frame of other poses; see `Space.relative_velocity`."""
        position, rotation = (list(own) for own in self.columns)
        frames = self._rotation.rotations(to[:, rotation])
        turning = moves[:, 3:] if self._rotation.frame == "world" else frames.apply(moves[:, 3:])
        carried = moves[:, :3] + np.cross(turning, X[:, position] - to[:, position])
        turned = self._rotation.relative_velocity(X[:, rotation], U[:, 3:], to[:, rotation], moves[:, 3:])
        return np.hstack([frames.inv().apply(U[:, :3] - carried), turned])

    def absolute_velocity(self, U: Array, to: Array) -> Array:
        """Undo `relative_velocity` for a frame that rests; see `Space.absolute_velocity`."""
        rotation = list(self.columns[1])
        v = self._rotation.rotations(to[:, rotation]).apply(U[:, :3])
        return np.hstack([v, self._rotation.absolute_velocity(U[:, 3:], to[:, rotation])])

    @property
    def _rotation(self) -> Rotation:
        (_, rotation) = self.parts
        assert isinstance(rotation, Rotation)
        return rotation
