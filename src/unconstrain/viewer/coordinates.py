"""Which of the states are shown, and how actions move them."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.spaces import Phased, Product, SecondOrder, Space
from unconstrain.spaces.vector import Vector

Array = NDArray[np.float64]

STEP = 1e-6
"""Of finite differences, in units of the actions."""


class Coordinates(Protocol):
    """Two or three numbers of a state that are shown as a place.

    Attributes
    ----------
    names : tuple of str
        Of the two or three, with their units.
    """

    names: tuple[str, ...]

    def place(self, X: Array) -> Array:
        """Return the shown numbers (N, k) of states (N, n)."""
        ...

    def tangents(self, X: Array) -> Array:
        """Return how actions move them at states (N, n): matrices J (N, k, d), with velocities J u."""
        ...

    def put(self, x: Array, place: Array) -> Array:
        """Return the state (n,) that is shown at a place (k,), and is as x (n,) otherwise."""
        ...


class Axes:
    """All numbers of which two or three can be shown: positions, angles, and rotations as vectors.

    Rotations are shown as rotation vectors from a typical one, in radians.

    Parameters
    ----------
    space : Space
        Of the states.
    names : sequence of str
        Of the n states.
    base : ndarray of shape (n,)
        A typical state: angles are shown within half a turn of it.
    """

    def __init__(self, space: Space, names: Sequence[str], base: Array) -> None:
        self.space, self.names_of_states = space, tuple(names)
        self.places = space.of if isinstance(space, Phased | SecondOrder) else space
        self.base = base[None, : self.places.n_states]
        self.names, self._added = _describe(self.places, self.names_of_states, self.base[0])

    def values(self, X: Array) -> Array:
        """Return all numbers that can be shown.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, d)
            A column for each of `names`.
        """
        places = X[:, : self.places.n_states]
        return self._added + self.places.difference(np.repeat(self.base, len(X), axis=0), places)

    def state(self, x: Array, values: Array) -> Array:
        """Return a state by its numbers.

        Parameters
        ----------
        x : ndarray of shape (n,)
            A state, whose phase or velocity is kept.
        values : ndarray of shape (d,)
            As `values` returns them.

        Returns
        -------
        ndarray of shape (n,)
            The state.
        """
        moved = self.places.step(self.base, (values - self._added)[None], 1.0)[0]
        return np.append(moved, x[len(moved) :])


class Picked:
    """Two or three of the numbers of `Axes`.

    Parameters
    ----------
    axes : Axes
        All of them.
    which : sequence of int
        Two or three, counted from 0.

    Raises
    ------
    DataError
        They are not two or three different ones of those there are.
    """

    def __init__(self, axes: Axes, which: Sequence[int]) -> None:
        wanted = np.asarray(which)
        few = wanted.ndim != 1 or len(wanted) not in (1, 2, 3) or len(set(wanted.tolist())) < len(wanted)
        if few or not all(each in range(len(axes.names)) for each in wanted.tolist()):
            raise DataError(
                f"coordinates= are two or three different ones of {', '.join(axes.names)}, counted from 0"
            )
        self.axes, self.which = axes, [int(each) for each in wanted]
        self.names = tuple(axes.names[each] for each in self.which)
        self._is_flat = axes.space.is_flat
        self._identity = np.eye(axes.space.n_actions)[None, self.which]

    def place(self, X: Array) -> Array:
        """Return the shown numbers; see `Coordinates.place`."""
        return X[:, self.which] if self._is_flat else self.axes.values(X)[:, self.which]

    def tangents(self, X: Array) -> Array:
        """Return how actions move them; see `Coordinates.tangents`."""
        if self._is_flat or isinstance(self.axes.space, SecondOrder):
            return self._identity if len(X) == 1 else np.repeat(self._identity, len(X), axis=0)
        return finite_differences(self, self.axes.space, X)

    def put(self, x: Array, place: Array) -> Array:
        """Return the state that is shown at a place; see `Coordinates.put`."""
        values = self.axes.values(x[None])[0]
        values[self.which] = place
        return self.axes.state(x, values)


def finite_differences(coordinates: Coordinates, space: Space, X: Array) -> Array:
    """Compute how actions move what is shown.

    Parameters
    ----------
    coordinates : Coordinates
        What is shown.
    space : Space
        Of the states.
    X : ndarray of shape (N, n)
        States.

    Returns
    -------
    ndarray of shape (N, k, d)
        By differences over `STEP`.
    """
    here = coordinates.place(X)
    moved = [
        coordinates.place(space.step(X, np.broadcast_to(action, (len(X), len(action))), 1.0)) - here
        for action in STEP * np.eye(space.n_actions)
    ]
    return np.stack(moved, axis=-1) / STEP


def _describe(space: Space, names: Sequence[str], base: Array) -> tuple[tuple[str, ...], Array]:
    """Name the numbers that a space's velocities belong to, and say what is added to a difference from the base."""
    if isinstance(space, Product):
        parts = [
            _describe(part, [names[i] for i in columns], base[list(columns)])
            for part, columns in zip(space.parts, space.columns, strict=True)
        ]
        return tuple(name for part, _ in parts for name in part), np.concatenate(
            [added for _, added in parts]
        )
    if isinstance(space, Vector):
        units = space.units
        named = [
            name if unit == "1" else f"{name} ({unit})" for name, unit in zip(names, units, strict=False)
        ]
        return tuple(named[: space.n_states]), np.asarray(base[: space.n_states])
    shared = space.action_names(names)
    return tuple(f"turned about {name[-1]} (rad)" for name in shared), np.zeros(space.n_actions)
