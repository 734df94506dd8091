"""Frames at rest that states are relative to, and the constraints that hold there."""

from dataclasses import dataclass

import numpy as np

from unconstrain.errors import DataError
from unconstrain.spaces.base import Array, Space
from unconstrain.spaces.numbers import Numbers
from unconstrain.spaces.phased import Phased
from unconstrain.spaces.product import Pose

POSITIONS = Numbers(3)
"""What may be relative to a pose, the frame of positions x, y and z."""


def takes_frame(space: Space, count: int) -> bool:
    """Whether states of a space are positions, and `count` numbers are the pose that they are relative to."""
    return _without_phase(space) == POSITIONS and count == Pose().n_states


def _without_phase(space: Space) -> Space:
    return space.of if isinstance(space, Phased) else space


def relate(space: Space, X: Array, U: Array, to: Array, moves: Array) -> tuple[Array, Array]:
    """Express states and velocities in the frame of others, which may move.

    Parameters
    ----------
    space : Space
        That the states belong to.
    X : ndarray of shape (N, n)
        States.
    U : ndarray of shape (N, d)
        Velocities.
    to : ndarray of shape (N, n)
        What they are relative to; of shape (N, 7) poses, for positions.
    moves : ndarray of shape (N, d) or (N, 6)
        Its velocities.

    Returns
    -------
    X : ndarray of shape (N, n)
        Relative states.
    U : ndarray of shape (N, d)
        Their velocities.
    """
    if not takes_frame(space, to.shape[1]):
        return space.relative(X, to), space.relative_velocity(X, U, to, moves)
    pose, none = Pose(), np.zeros((len(X), 3))
    lifted, moving = _lift(X), np.hstack([U, none])
    placed = pose.relative(lifted, to)[:, :3]
    return np.hstack([placed, X[:, 3:]]), pose.relative_velocity(lifted, moving, to, moves)[:, :3]


@dataclass(frozen=True)
class Frame:
    """A frame at rest.

    Parameters
    ----------
    space : Space
        That states belong to.
    at : tuple of float
        A state, or for positions a pose.

    Raises
    ------
    DataError
        It is neither.
    """

    space: Space
    at: tuple[float, ...]

    def __post_init__(self) -> None:
        n = self.space.n_states
        if len(self.at) != n and not takes_frame(self.space, len(self.at)):
            raise DataError(
                f"a frame of states that are {self.space.words} has {n} numbers, not {len(self.at)}"
            )
        if self._kind.faults(np.array([self.at])).any():
            raise DataError(f"the frame is none of these: {self._kind.words}")

    def into(self, X: Array) -> Array:
        """Express states (N, n) in the frame."""
        none = np.zeros((len(X), self._kind.n_actions))
        return relate(self.space, X, none[:, : self.space.n_actions], self._to(len(X)), none)[0]

    def out_of(self, X: Array) -> Array:
        """Undo `into`."""
        if len(self.at) == self.space.n_states:
            return self.space.absolute(X, self._to(len(X)))
        return np.hstack([self._kind.absolute(_lift(X), self._to(len(X)))[:, :3], X[:, 3:]])

    def velocities_out_of(self, U: Array) -> Array:
        """Turn velocities (N, d) in the frame into those that are not."""
        to = self._to(len(U))
        if len(self.at) == self.space.n_states:
            return self.space.absolute_velocity(U, to)
        return self._kind.absolute_velocity(np.hstack([U, np.zeros_like(U)]), to)[:, :3]

    def constraint_into(self, A: Array) -> Array:
        """Turn rows (k, d) of a constraint on velocities into those of the same constraint in the frame."""
        return A @ self.velocities_out_of(np.eye(self.space.n_actions)).T

    @property
    def _kind(self) -> Space:
        return Pose() if len(self.at) != self.space.n_states else self.space

    def _to(self, count: int) -> Array:
        return np.tile(np.asarray(self.at, dtype=np.float64), (count, 1))


def _lift(X: Array) -> Array:
    """Make poses (N, 7) without a rotation of positions (N, 3), which a phase may follow."""
    return np.hstack([X[:, :3], np.zeros((len(X), 3)), np.ones((len(X), 1))])
