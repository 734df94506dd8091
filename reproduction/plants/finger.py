"""A planar finger that stretches out, and slides along whatever lies in its way (section 1, Fig. 1)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import nnls

from reproduction.plants.box import Box
from unconstrain.constraints import projection
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, UnconstrainError
from unconstrain.simulation import simulate

Array = NDArray[np.float64]

TOUCHING = 1e-5
"""Clearance in metres under which finger and obstacle touch."""

PENETRATION = 1e-5
"""A recorded posture is never deeper inside an obstacle than this, in metres."""

SUBSTEPS = 3
"""Integration steps between two recorded samples."""

NEWTON_STEPS = 10
"""At most so many lead back onto a surface after a straight step; two or three do."""


@dataclass(frozen=True)
class Contacts:
    """All places where the finger could touch obstacles at one posture.

    Attributes
    ----------
    distances : ndarray of shape (m,)
        Signed distances in metres, negative inside.
    rows : ndarray of shape (m, 3)
        Their gradients over the joints.
    """

    distances: Array
    rows: Array

    def pressing(self, wanted: Array) -> NDArray[np.intp]:
        """Return the indices of the contacts that push back when the finger wants to move by `wanted` (3,).

        They are the active set of ``min_u ‖u - π(q)‖²`` under ``rows u >= 0`` where finger and obstacle touch. Its
        dual is ``min_λ ‖π + rowsᵀ λ‖²`` under ``λ >= 0``; contacts with λ > 0 are active.
        """
        touching = np.flatnonzero(self.distances <= TOUCHING)
        if not len(touching):
            return touching
        force, _ = nnls(self.rows[touching].T, -wanted)
        return touching[force > 0]


@dataclass(frozen=True)
class Finger:
    """Three phalanges in the plane, their joints bent by q (rad), the base at the origin.

    Stretched out (q = 0) the finger points along +x; positive angles bend it downwards. The policy moves
    every joint towards zero, ``π(q) = -gain q``.

    Parameters
    ----------
    lengths : (float, float, float)
        Of the phalanges from base to tip, in metres.
    radius : float
        Half the finger's thickness in metres.
    gain : float
        In 1/s.
    """

    lengths: tuple[float, ...] = (0.045, 0.03, 0.022)
    radius: float = 0.006
    gain: float = 1.0

    def policy(self, Q: ArrayLike) -> Array:
        """Return joint velocities (N, 3) in rad/s at joint angles (N, 3)."""
        return -self.gain * self._postures(Q)

    def joints(self, Q: ArrayLike) -> Array:
        """Return the positions (N, 4, 2) in metres of the base, the two inner joints and the tip."""
        heading = -np.cumsum(self._postures(Q), axis=1)
        links = np.array(self.lengths)[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        return np.concatenate([np.zeros((len(links), 1, 2)), np.cumsum(links, axis=1)], axis=1)

    def clearance(self, Q: ArrayLike, obstacles: Box | Sequence[Box]) -> Array:
        """Return the least distance (N,) in metres between finger and obstacles; negative inside, inf without any."""
        boxes = _boxes(obstacles)
        return np.array([self.contacts(q, boxes).distances.min(initial=np.inf) for q in self._postures(Q)])

    def constraint(self, q: ArrayLike, obstacles: Box | Sequence[Box]) -> Array:
        """Return the rows (k, 3) of the contacts that stop the policy at posture q (3,): ``A u = 0``.

        A contact at point p with outward normal n lets the finger leave but not enter, ``nᵀ J(p) u >= 0``.
        The admissible action nearest to the policy presses on some of the contacts and leaves the others;
        only the former constrain: on them ``u = N π(q)``, and the finger slides.
        """
        posture = self._postures(np.atleast_2d(q))
        contacts = self.contacts(posture[0], _boxes(obstacles))
        return contacts.rows[contacts.pressing(self.policy(posture)[0])]

    def demonstrate(
        self,
        starts: ArrayLike,
        obstacles: Box | Sequence[Box] | Sequence[Sequence[Box]] = (),
        length: int = 150,
        rate: float = 50.0,
    ) -> Demonstrations:
        """Stretch out from each start, sliding along what is in the way.

        Parameters
        ----------
        starts : array_like of shape (3,) or (S, 3)
            Joint angles in radians, clear of the obstacles.
        obstacles : Box, sequence of Box, or one sequence of Box per start
            What lies in the way; nothing by default.
        length : int
            Samples per movement.
        rate : float
            Samples per second.

        Returns
        -------
        Demonstrations
            ``S * length`` samples of joint angles (rad) and velocities (rad/s), with the true policy and
            projections. The action ``u = N π(q)`` is the one at the very instant of the sample.

        Raises
        ------
        DataError
            If a start is not three finite angles, or lies inside an obstacle.
        UnconstrainError
            If `length` or `rate` is not positive or the lists of obstacles do not match the starts.
        """
        starts = self._postures(np.atleast_2d(starts))
        if length < 1 or not (np.isfinite(rate) and rate > 0):
            raise UnconstrainError(f"give at least one sample and a positive rate, not {length} and {rate}")
        scenes = _scenes(obstacles, len(starts))
        for index, (q, boxes) in enumerate(zip(starts, scenes, strict=True)):
            if self.clearance(q[None], boxes)[0] < 0:
                raise DataError(f"start {index} lies inside an obstacle: move one of the two away")
        # Each start has its own obstacles, so that movements cannot be followed side by side.
        movements = [
            _slide(self, q, boxes, length, rate).select(slice(None, None, SUBSTEPS))
            for q, boxes in zip(starts, scenes, strict=True)
        ]
        labels = tuple(str(episode) for episode in range(len(starts)))
        return replace(Demonstrations.concatenate(movements), episode_labels=labels)

    def contacts(self, q: Array, boxes: Sequence[Box]) -> Contacts:
        """Find all places where the finger could touch the boxes at posture q (3,).

        A phalanx (a thick line) and a box can touch at either end of the phalanx or at a corner of the box;
        a phalanx flat against a side touches at two of them. Each distance is smooth in q.
        """
        if not boxes:
            return Contacts(np.empty(0), np.empty((0, len(q))))
        joints = self.joints(q[None])[0]
        a, along = joints[:-1], np.diff(joints, axis=0)
        corners = np.array([box.corners for box in boxes])
        # Ends of phalanges, (boxes, joints), and points of phalanges nearest to corners, (boxes, links, corners).
        ends = np.broadcast_to(joints, (len(boxes), *joints.shape))
        from_a = corners[:, None] - a[:, None]
        share = np.einsum("blcx,lx->blc", from_a, along) / np.sum(along**2, axis=1)[:, None]
        sides = a[:, None] + np.clip(share, 0, 1)[..., None] * along[:, None]
        nearest = np.array([box.nearest(joints) for box in boxes])
        p = np.concatenate([ends.reshape(-1, 2), sides.reshape(-1, 2)])
        gap = np.concatenate([(ends - nearest).reshape(-1, 2), (sides - corners[:, None]).reshape(-1, 2)])
        length = np.sqrt(np.sum(gap**2, axis=1))
        normal = np.divide(gap, length[:, None], out=np.zeros_like(gap), where=length[:, None] > 0)
        # J(p): joint i turns everything beyond it clockwise, (x, y) -> (y, -x); the end of link i is joint i + 1.
        last = np.concatenate(
            [
                np.tile(np.arange(len(joints)) - 1, len(boxes)),
                np.tile(np.repeat(np.arange(len(a)), 4), len(boxes)),
            ]
        )
        arm = p[:, None] - a
        turned = normal[:, None, 0] * arm[..., 1] - normal[:, None, 1] * arm[..., 0]
        rows = np.where(np.arange(len(q)) <= last[:, None], turned, 0.0)
        rounding = np.array([box.rounding for box in boxes])
        reach = self.radius + np.concatenate(
            [np.repeat(rounding, len(joints)), np.repeat(rounding, 4 * len(a))]
        )
        return Contacts(length - reach, rows)

    def outlines(self, q: ArrayLike) -> Array:
        """Trace the outlines (3, M, 2) in metres of the phalanges at posture q (3,), for drawing."""
        joints = self.joints(np.atleast_2d(q))[0]
        shapes = []
        for a, b in pairwise(joints):
            heading = np.arctan2(*(b - a)[::-1])
            half = heading + np.linspace(-np.pi / 2, np.pi / 2, 17)
            cap = self.radius * np.stack([np.cos(half), np.sin(half)], axis=1)
            shapes.append(np.concatenate([b + cap, a - cap]))
        return np.array(shapes)

    def _postures(self, Q: ArrayLike) -> Array:
        Q = np.asarray(Q, dtype=np.float64)
        if Q.ndim != 2 or Q.shape[1] != len(self.lengths):
            raise DataError(
                f"the finger has {len(self.lengths)} joints: give postures of shape "
                f"(N, {len(self.lengths)}), not {Q.shape}"
            )
        if not np.isfinite(Q).all():
            raise DataError("a posture of the finger has NaN or infinity: give joint angles in radians")
        return Q


class _Sliding:
    """One movement of a finger: which contacts press at its posture, and where it gets from there.

    The contacts are those of the posture that `advance` left the finger in, the start at first.
    """

    def __init__(self, finger: Finger, start: Array, boxes: Sequence[Box], dt: float):
        self.finger, self.boxes, self.dt = finger, boxes, dt
        self.contacts = finger.contacts(start, boxes)
        self.pressing = np.empty(0, dtype=np.intp)

    def project(self, sample: int, X: Array, wanted: Array) -> Array:
        self.pressing = self.contacts.pressing(wanted[0])
        return projection(self.contacts.rows[self.pressing])[None]

    def advance(self, X: Array, U: Array) -> tuple[Array, Array]:
        """One step, and back onto the surfaces that the finger slid along or ran into."""
        q = X[0] + self.dt * U[0]
        self.contacts = self.finger.contacts(q, self.boxes)
        # A straight step leaves a curved surface, either way, by the square of the step: a few Newton steps
        # lead back. Contacts that do not press are only pushed out, never pulled in.
        for _ in range(NEWTON_STEPS):
            distances, rows = self.contacts.distances, self.contacts.rows
            off = distances < 0
            off[self.pressing] = True
            if np.all(np.abs(distances[off]) < PENETRATION / 10):
                break
            q = q - np.linalg.lstsq(rows[off], distances[off], rcond=1e-6)[0]
            self.contacts = self.finger.contacts(q, self.boxes)
        return q[None], U


def _slide(finger: Finger, start: Array, boxes: Sequence[Box], length: int, rate: float) -> Demonstrations:
    """Follow a movement at `SUBSTEPS` times the rate of its samples."""
    dt = 1 / (rate * SUBSTEPS)
    sliding = _Sliding(finger, start, boxes, dt)
    return simulate(
        finger.policy,
        start,
        (length - 1) * SUBSTEPS,
        dt,
        project=sliding.project,
        advance=sliding.advance,
        state_names=[f"joint{i + 1}" for i in range(len(start))],
    )


def _boxes(obstacles: Box | Sequence[Box]) -> Sequence[Box]:
    return [obstacles] if isinstance(obstacles, Box) else obstacles


def _scenes(obstacles: Box | Sequence[Box] | Sequence[Sequence[Box]], starts: int) -> list[Sequence[Box]]:
    if isinstance(obstacles, Box):
        return [[obstacles]] * starts
    shared = [one for one in obstacles if isinstance(one, Box)]
    if len(shared) == len(obstacles):
        return [shared] * starts
    per_start = [one for one in obstacles if not isinstance(one, Box)]
    if len(per_start) != len(obstacles) or len(per_start) != starts:
        raise UnconstrainError(
            f"give obstacles shared by all, or one list of obstacles for each of the {starts} starts"
        )
    return per_start
