"""A planar finger that stretches out, and slides along whatever lies in its way (section 1, Fig. 1)."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import nnls

from unconstrain.constraints import projection
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, UnconstrainError

Array = NDArray[np.float64]

TOUCHING = 1e-5
"""Clearance in metres under which finger and obstacle touch."""

PENETRATION = 1e-5
"""A recorded posture is never deeper inside an obstacle than this, in metres."""

SUBSTEPS = 3
"""Integration steps between two recorded samples."""


@dataclass(frozen=True)
class Box:
    """An obstacle: a rectangle with rounded corners.

    Attributes
    ----------
    center, size : (float, float)
        Middle, and full width and height before turning, in metres.
    angle : float
        Turned counterclockwise by this, in radians.
    rounding : float
        Radius of the corners in metres.
    """

    center: tuple[float, float]
    size: tuple[float, float]
    angle: float = 0.0
    rounding: float = 0.002

    def __post_init__(self) -> None:
        if not np.isfinite([*self.center, *self.size, self.angle, self.rounding]).all():
            raise UnconstrainError("an obstacle's center, size, angle and rounding must be finite numbers")
        if not 0 <= 2 * self.rounding < min(self.size):
            raise UnconstrainError(
                f"an obstacle of size {self.size} cannot have corners of radius {self.rounding}: "
                "keep the radius under half of the shorter side"
            )

    @cached_property
    def axes(self) -> Array:
        """The box's own axes as rows (2, 2)."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        return np.array([[c, s], [-s, c]])

    @cached_property
    def core(self) -> Array:
        """Half the sides (2,) of the sharp rectangle that, grown by `rounding`, is the box."""
        return np.array(self.size) / 2 - self.rounding

    @cached_property
    def corners(self) -> Array:
        """Corners (4, 2) of that sharp rectangle, counterclockwise."""
        signs = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
        return self.center + (signs * self.core) @ self.axes

    def nearest(self, points: Array) -> Array:
        """The points (..., 2) of the sharp rectangle nearest to the given ones (..., 2)."""
        local = (points - self.center) @ self.axes.T
        return self.center + np.clip(local, -self.core, self.core) @ self.axes

    def outline(self) -> Array:
        """The rounded outline (M, 2), for drawing."""
        quarter = np.linspace(0, np.pi / 2, 9)
        start = self.angle + np.arange(4)[:, None] * np.pi / 2 + quarter
        arcs = self.corners[:, None] + self.rounding * np.stack([np.cos(start), np.sin(start)], axis=-1)
        return arcs.reshape(-1, 2)


@dataclass(frozen=True)
class Finger:
    """Three phalanges in the plane, their joints bent by q (rad), the base at the origin.

    Stretched out (q = 0) the finger points along +x; positive angles bend it downwards. The policy moves
    every joint towards zero, ``π(q) = -gain q``.

    Attributes
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
        """Joint velocities (N, 3) in rad/s at joint angles (N, 3)."""
        return -self.gain * self._postures(Q)

    def joints(self, Q: ArrayLike) -> Array:
        """Positions (N, 4, 2) in metres of the base, the two inner joints and the tip."""
        heading = -np.cumsum(self._postures(Q), axis=1)
        links = np.array(self.lengths)[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        return np.concatenate([np.zeros((len(links), 1, 2)), np.cumsum(links, axis=1)], axis=1)

    def clearance(self, Q: ArrayLike, obstacles: Box | Sequence[Box]) -> Array:
        """Least distance (N,) in metres between finger and obstacles; negative inside, inf without any."""
        boxes = _boxes(obstacles)
        return np.array([self._contacts(q, boxes)[0].min(initial=np.inf) for q in self._postures(Q)])

    def constraint(self, q: ArrayLike, obstacles: Box | Sequence[Box]) -> Array:
        """Rows (k, 3) of the contacts that stop the policy at posture q (3,): ``A u = 0``.

        A contact at point p with outward normal n lets the finger leave but not enter, ``nᵀ J(p) u >= 0``.
        The admissible action nearest to the policy presses on some of the contacts and leaves the others;
        only the former constrain: on them ``u = N π(q)``, and the finger slides.
        """
        posture = self._postures(np.atleast_2d(q))[0]
        contacts = self._contacts(posture, _boxes(obstacles))
        return contacts[1][self._pressing(posture, contacts)]

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
        starts : array (3,) or (S, 3)
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
        d = len(self.lengths)
        states, projections = np.empty((len(starts), length, d)), np.empty((len(starts), length, d, d))
        for episode, (q, boxes) in enumerate(zip(starts, scenes, strict=True)):
            contacts = self._contacts(q, boxes)
            for k in range(length):
                states[episode, k] = q
                projections[episode, k] = projection(contacts[1][self._pressing(q, contacts)])
                for _ in range(SUBSTEPS):
                    q, contacts = self._step(q, contacts, boxes, 1 / (rate * SUBSTEPS))
        X, N = states.reshape(-1, d), projections.reshape(-1, d, d)
        wanted = self.policy(X)
        names = [f"joint{i + 1}" for i in range(d)]
        return Demonstrations(
            states=X,
            actions=np.einsum("nij,nj->ni", N, wanted),
            episodes=np.repeat(np.arange(len(starts)), length),
            time=np.tile(np.arange(length) / rate, len(starts)),
            policy=wanted,
            projections=N,
            state_names=tuple(names),
            action_names=tuple(f"{name}_velocity" for name in names),
        )

    def _step(
        self, q: Array, contacts: tuple[Array, Array], boxes: Sequence[Box], dt: float
    ) -> tuple[Array, tuple[Array, Array]]:
        """One integration step, and back onto the surfaces it slid along or ran into: q and its contacts."""
        sliding = self._pressing(q, contacts)
        action = self.policy(q[None])[0]
        q = q + dt * (projection(contacts[1][sliding]) @ action if len(sliding) else action)
        contacts = self._contacts(q, boxes)
        # A straight step leaves a curved surface, either way, by the square of the step: a few Newton steps
        # lead back. Contacts that do not press are only pushed out, never pulled in.
        for _ in range(10):
            distances, rows = contacts
            off = distances < 0
            off[sliding] = True
            if np.all(np.abs(distances[off]) < PENETRATION / 10):
                break
            q = q - np.linalg.lstsq(rows[off], distances[off], rcond=1e-6)[0]
            contacts = self._contacts(q, boxes)
        return q, contacts

    def _pressing(self, q: Array, contacts: tuple[Array, Array]) -> NDArray[np.intp]:
        """Which contacts push back, from ``min_u ‖u - π(q)‖²`` under ``rows u >= 0`` where finger and box touch.

        Its dual is ``min_λ ‖π + rowsᵀ λ‖²`` under ``λ >= 0``; contacts with λ > 0 are the active set.
        """
        distances, rows = contacts
        touching = np.flatnonzero(distances <= TOUCHING)
        if not len(touching):
            return touching
        force, _ = nnls(rows[touching].T, -self.policy(q[None])[0])
        return touching[force > 0]

    def _contacts(self, q: Array, boxes: Sequence[Box]) -> tuple[Array, Array]:
        """Signed distances (m,) of all places where the finger could touch, and their gradients (m, 3) in q.

        A phalanx (a thick line) and a box can touch at either end of the phalanx or at a corner of the box;
        a phalanx flat against a side touches at two of them. Each distance is smooth in q.
        """
        if not boxes:
            return np.empty(0), np.empty((0, len(q)))
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
        return length - reach, rows

    def outlines(self, q: ArrayLike) -> Array:
        """Outlines (3, M, 2) in metres of the phalanges at posture q (3,), as thick as they are, for drawing."""
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
