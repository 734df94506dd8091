"""What every kind of state knows of itself."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Space(ABC):
    """A kind of state: how many numbers stand for one, what lies between two, and where a velocity leads.

    A velocity may have fewer numbers than a state: a quaternion has four, its angular velocity three. All methods take
    many states at once, row by row.
    """

    @property
    @abstractmethod
    def n_states(self) -> int:
        """How many numbers stand for a state, n."""

    @property
    @abstractmethod
    def n_actions(self) -> int:
        """How many numbers a velocity has, d."""

    @property
    @abstractmethod
    def origin(self) -> Array:
        """A state, (n,): zero, or no rotation."""

    @property
    @abstractmethod
    def units(self) -> tuple[str, ...]:
        """What each of the d numbers of a velocity is counted in, apart from time: "1", "rad" or "deg"."""

    @property
    def is_flat(self) -> bool:
        """Whether states are plain numbers, whose difference is subtraction."""
        return False

    @property
    def blocks(self) -> tuple[tuple[int, bool], ...]:
        """How the d numbers of a velocity fall into parts: how many each has, and whether it is of plain numbers."""
        return ((self.n_actions, self.is_flat),)

    @property
    @abstractmethod
    def words(self) -> str:
        """What states are, for a note."""

    @abstractmethod
    def describe(self) -> dict[str, Any]:
        """Say what it is in plain values, of which `from_description` makes it again."""

    @abstractmethod
    def action_names(self, names: Sequence[str]) -> tuple[str, ...]:
        """Name the velocities after the states.

        Parameters
        ----------
        names : sequence of str
            Of the n numbers of a state.

        Returns
        -------
        tuple of str
            Of the d numbers of a velocity.
        """

    @abstractmethod
    def faults(self, X: Array) -> NDArray[np.bool_]:
        """Find rows that stand for no state.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            Finite.

        Returns
        -------
        ndarray of shape (N,)
            Whether a row is none.
        """

    @abstractmethod
    def difference(self, X: Array, Y: Array) -> Array:
        """Compute the velocity that leads from one state to another in a unit of time, by the shortest way.

        Parameters
        ----------
        X, Y : ndarray of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, d)
            Velocities times time.
        """

    @abstractmethod
    def step(self, X: Array, U: Array, dt: float | Array) -> Array:
        """Follow actions for a time.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        U : ndarray of shape (N, d)
            Actions, held for that time.
        dt : float or ndarray of shape (N, 1)
            Seconds.

        Returns
        -------
        ndarray of shape (N, n)
            States.
        """

    def between(self, X: Array, Y: Array, share: Array) -> Array:
        """Interpolate along the shortest way.

        Parameters
        ----------
        X, Y : ndarray of shape (N, n)
            States.
        share : ndarray of shape (N,)
            How far on the way, from 0 to 1.

        Returns
        -------
        ndarray of shape (N, n)
            States.
        """
        return self.step(X, self.difference(X, Y), share[:, None])

    @abstractmethod
    def follow(self, X: Array) -> Array:
        """Make one episode continuous, where the same state can be written in several ways.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States in the order of time.

        Returns
        -------
        ndarray of shape (N, n)
            The same states.
        """

    @abstractmethod
    def coordinates(self, X: Array) -> Array:
        """Return smooth coordinates of one episode, of which velocities are made by `velocity`.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States that follow each other, from `follow`.

        Returns
        -------
        ndarray of shape (N, c)
            Coordinates.
        """

    @abstractmethod
    def velocity(self, C: Array, slopes: Array) -> Array:
        """Turn derivatives of coordinates into velocities.

        Parameters
        ----------
        C : ndarray of shape (N, c)
            From `coordinates`.
        slopes : ndarray of shape (N, c)
            Their derivatives by time.

        Returns
        -------
        ndarray of shape (N, d)
            Velocities.
        """

    @abstractmethod
    def relative(self, X: Array, to: Array) -> Array:
        """Express states in the frame of others.

        Parameters
        ----------
        X, to : ndarray of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, n)
            States of the same kind.
        """

    @abstractmethod
    def absolute(self, X: Array, to: Array) -> Array:
        """Undo `relative`.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            From `relative`.
        to : ndarray of shape (N, n)
            What they are relative to.

        Returns
        -------
        ndarray of shape (N, n)
            States.
        """

    @abstractmethod
    def relative_velocity(self, X: Array, U: Array, to: Array, moves: Array) -> Array:
        """Express velocities in the frame of other states, which may move.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        U : ndarray of shape (N, d)
            Their velocities.
        to : ndarray of shape (N, n)
            The other states.
        moves : ndarray of shape (N, d)
            The velocities of these.

        Returns
        -------
        ndarray of shape (N, d)
            The velocities of `relative(X, to)`.
        """

    @abstractmethod
    def absolute_velocity(self, U: Array, to: Array) -> Array:
        """Undo `relative_velocity` for a frame that rests.

        Parameters
        ----------
        U : ndarray of shape (N, d)
            Velocities in the frame.
        to : ndarray of shape (N, n)
            The frame.

        Returns
        -------
        ndarray of shape (N, d)
            Velocities.
        """

    @property
    def n_places(self) -> int:
        """How many of the n numbers say where a state is; the others are its velocity."""
        return self.n_states

    def at_rest(self, x: Array) -> Array:
        """Return the state (n,) that is where x is, and does not move.

        Parameters
        ----------
        x : ndarray of shape (n,) or (n_places,)
            A state, or where it is.

        Returns
        -------
        ndarray of shape (n,)
            A state.
        """
        return np.append(x[: self.n_places], np.zeros(self.n_states - self.n_places))

    def offsets(self, X: Array) -> Array:
        """Compute how far states lie from a typical one, as velocities that lead there in a unit of time.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, d)
            Of mean zero.
        """
        D = self.difference(np.repeat(X[:1], len(X), axis=0), X)
        return D - D.mean(axis=0)

    @abstractmethod
    def find_base(self, X: Array) -> Array | None:
        """Find the state about which all others lie near enough for `embed` to lay them out flat.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (n,) or None
            None where they go all the way round.
        """

    @abstractmethod
    def embed(self, X: Array, base: Array | None) -> Array:
        """Lay states out as features see them: one place for a state, however it is written.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        base : ndarray of shape (n,) or None
            From `find_base`.

        Returns
        -------
        ndarray of shape (N, m)
            About as far from each other as the states are.
        """
