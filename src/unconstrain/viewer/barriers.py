"""A plane and a box as constraints of a rollout.

A barrier takes away motion into it, and nothing else: where the next step, by the speed with which the policy moves
what is shown, would lead into the barrier, the component of that speed along the barrier's normal is taken away for
this step. What slides along a barrier, or leaves it, is free. So a movement stops short of the surface by less than a
step, there is no friction, and what begins inside may only go outwards.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from unconstrain.constraints.nullspace import constrain, projection
from unconstrain.viewer.coordinates import Coordinates
from unconstrain.viewer.frame import Frame

Array = NDArray[np.float64]

ROUNDS = 4
"""How often what is left of a motion is checked anew: two barriers and an edge need three."""


class Barrier(Protocol):
    """Something in the scene that is in the way."""

    def normals(self, P: Array, steps: Array) -> Array:
        """Return outward normals (S, 3) where steps (S, 3) from points (S, 3) lead into it, else zero."""
        ...


@dataclass(frozen=True)
class Plane:
    """A plane; what is behind it is barred.

    Parameters
    ----------
    point : ndarray of shape (3,)
        On it, in the scene.
    normal : ndarray of shape (3,)
        Of length one, towards where motion is free.
    """

    point: Array
    normal: Array

    def normals(self, P: Array, steps: Array) -> Array:
        """Return the normal where a step leads behind the plane; see `Barrier.normals`."""
        speed = steps @ self.normal
        into = (speed < 0) & ((P - self.point) @ self.normal + speed < 0)
        return into[:, None] * self.normal


@dataclass(frozen=True)
class Box:
    """A box whose sides are along the axes.

    Parameters
    ----------
    centre : ndarray of shape (3,)
        In the scene.
    sides : ndarray of shape (3,)
        Whole ones, infinite along an axis that is not shown.
    """

    centre: Array
    sides: Array

    def normals(self, P: Array, steps: Array) -> Array:
        """Return the normal of the face that a step leads through; see `Barrier.normals`."""
        half, before = self.sides / 2.0, P - self.centre
        after = before + steps
        if ((np.minimum(before, after) >= half) | (np.maximum(before, after) <= -half)).any(axis=1).all():
            return np.zeros_like(P)  # beside it, as nearly always
        rows = np.arange(len(P))
        outside = np.abs(before) - half
        # A fast step may lead through the box: it enters where the last of the axes comes within its face.
        with np.errstate(divide="ignore", invalid="ignore"):
            enters = np.where(outside >= 0, outside / np.abs(steps), -np.inf)
            leaves = (half + np.abs(before) * np.where(before * steps > 0, -1.0, 1.0)) / np.abs(steps)
        enters = np.where((outside >= 0) & ~(before * steps < 0), np.inf, enters)
        first, last = enters.max(axis=1), np.nanmin(leaves, axis=1)
        inside = (outside < 0).all(axis=1)
        crosses = ~inside & (first <= 1.0) & (first < last)
        axis = np.where(inside, outside.argmax(axis=1), enters.argmax(axis=1))
        sign = np.sign(before[rows, axis])
        deeper = inside & (sign * steps[rows, axis] < 0)
        result = np.zeros_like(P)
        into = crosses | deeper
        result[rows[into], axis[into]] = sign[into]
        return result


class InTheWay:
    """Projections of a rollout among barriers.

    Parameters
    ----------
    barriers : sequence of Barrier
        In the scene.
    coordinates : Coordinates
        What is shown of states.
    frame : Frame
        Of the scene.
    dt : float
        Seconds a step.
    scale : ndarray of shape (d,), optional
        Of the policy's actions.
    """

    def __init__(
        self,
        barriers: Sequence[Barrier],
        coordinates: Coordinates,
        frame: Frame,
        dt: float,
        scale: Array | None = None,
    ) -> None:
        self.barriers, self.coordinates, self.frame = tuple(barriers), coordinates, frame
        self.dt, self.scale = dt, scale

    def projections(self, X: Array, U: Array, known: Array | None = None) -> Array:
        """Find the projections of the next step.

        Parameters
        ----------
        X : ndarray of shape (S, n)
            States.
        U : ndarray of shape (S, d)
            Actions of the policy.
        known : ndarray of shape (S, k, d), optional
            Rows of another constraint that holds as well.

        Returns
        -------
        ndarray of shape (S, d, d)
            The identity where nothing is in the way.
        """
        A = np.zeros((len(X), 0, U.shape[1])) if known is None else known
        N = projection(A) if A.shape[1] else np.repeat(np.eye(U.shape[1])[None], len(X), axis=0)
        if not self.barriers:
            return N
        P = self.frame.to_scene(self.coordinates.place(X))
        J = self.coordinates.tangents(X)
        for _ in range(ROUNDS):
            left = constrain(N, U, self.scale) if A.shape[1] else U
            steps = self.frame.vectors(self.dt * (J @ left[:, :, None])[:, :, 0])
            found = [each.normals(P, steps) for each in self.barriers]
            found = [normals for normals in found if normals.any()]
            if not found:
                break
            normals = np.stack(found, axis=1)[..., : J.shape[1]]
            A = np.concatenate([A, normals @ J], axis=1)
            N = projection(A)
        return N
