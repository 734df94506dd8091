"""Obstacles in the way of a robot's hands: walls, and barriers with a gap in them.

A hand that comes closer than `CLEARANCE` to an obstacle, and would come closer still, loses its motion along the
obstacle's normal: `nᵀ ẋ = 0` for that hand, and nothing else. Sources: ICRA 2009, Sec. IV-C and IV-D.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.errors import UnconstrainError

Array = NDArray[np.float64]

CLEARANCE = 0.05
"""A hand's point is blocked when nearer than this, in metres: about the radius of a hand."""


@dataclass(frozen=True)
class Wall:
    """Endless planes, one for each of S movements.

    Parameters
    ----------
    points : ndarray of shape (S, 3)
        A point of each plane, in metres.
    normals : ndarray of shape (S, 3)
        Unit length, pointing out of the wall to where the robot is.
    """

    points: Array
    normals: Array

    def nearest(self, x: Array) -> tuple[Array, Array]:
        """Compute distances (S, 1) of points x (S, 3), negative inside the wall, and normals (S, 1, 3)."""
        distance = np.einsum("sd,sd->s", x - self.points, self.normals)
        return distance[:, None], self.normals[:, None, :]


@dataclass(frozen=True)
class Barrier:
    """Upright slabs of K boxes, for each of S movements.

    Parameters
    ----------
    low, high : ndarray of shape (S, K, 3)
        Corners of the boxes, in metres. A box without volume is no obstacle.
    """

    low: Array
    high: Array

    def nearest(self, x: Array) -> tuple[Array, Array]:
        """Compute distances (S, K) from points x (S, 3) to each box, and the directions (S, K, 3) away from it.

        A box's normal is the direction from its nearest point: along an axis before a face, turning around an edge.
        Inside a box the distance is negative and the normal that of the nearest face.
        """
        x = x[:, None, :]
        away = x - np.clip(x, self.low, self.high)
        distance = np.linalg.norm(away, axis=-1)
        outside = distance > 0
        depth = np.concatenate([self.low - x, x - self.high], axis=-1)  # all negative inside
        face = np.argmax(depth, axis=-1)
        inward = np.eye(3)[face % 3] * np.where(face < 3, -1.0, 1.0)[..., None]
        normal = np.where(outside[..., None], away / np.where(outside, distance, 1.0)[..., None], inward)
        distance = np.where(outside, distance, depth.max(axis=-1))
        solid = np.all(self.high > self.low, axis=-1)
        return np.where(solid, distance, np.inf), normal


def make_with_gap(
    widths: ArrayLike,
    x: float,
    bottom: float,
    *,
    thickness: float,
    span: float,
    height: float,
    centre: float = 0.0,
) -> Barrier:
    """Make barriers across the robot's way with a gap in them, one for each of the `widths` (S,).

    Parameters
    ----------
    widths : array_like of shape (S,)
        Width of the gap in metres; at zero and below there is none.
    x, bottom : float
        Distance in front of the robot to the barrier's middle, and height of its foot, in metres.
    thickness, span, height : float
        Extents along x, y and z, in metres.
    centre : float
        Where along y the gap's middle is, in metres.

    Returns
    -------
    Barrier
        Of S movements.

    Raises
    ------
    UnconstrainError
        If the widths are not one for each movement.
    """
    half = np.clip(np.atleast_1d(np.asarray(widths, dtype=np.float64)), 0.0, span) / 2
    if half.ndim != 1:
        raise UnconstrainError(f"a barrier needs one gap width per movement, not an array {half.shape}")
    low, high = np.empty((len(half), 2, 3)), np.empty((len(half), 2, 3))
    low[..., 0], high[..., 0] = x - thickness / 2, x + thickness / 2
    low[..., 2], high[..., 2] = bottom, bottom + height
    low[:, 0, 1], high[:, 0, 1] = np.minimum(centre + half, span / 2), span / 2
    low[:, 1, 1], high[:, 1, 1] = -span / 2, np.maximum(centre - half, -span / 2)
    return Barrier(low, high)


def make_central(
    n: int, x: float, bottom: float, *, thickness: float, width: float, height: float
) -> Barrier:
    """Make a barrier without a gap that stands in the middle and has to be reached around, for n movements."""
    low = np.array([x - thickness / 2, -width / 2, bottom])
    high = np.array([x + thickness / 2, width / 2, bottom + height])
    return Barrier(np.tile(low, (n, 1, 1)), np.tile(high, (n, 1, 1)))


def find_blocking(
    obstacle: Wall | Barrier, hands: Array, velocities: Array, clearance: float = CLEARANCE
) -> tuple[Array, NDArray[np.bool_]]:
    """Find the normals that constrain each hand, and whether they do.

    Parameters
    ----------
    obstacle : Wall or Barrier
        For S movements and K boxes (a wall is one).
    hands, velocities : ndarray of shape (S, H, 3)
        Where each of H hands is (m), and how the policy would move it (m/s).
    clearance : float
        In metres.

    Returns
    -------
    rows : ndarray of shape (S, H, K, 3)
        Normals n with ``nᵀ ẋ = 0``; zero where nothing is in the way.
    blocked : ndarray of shape (S, H), bool
        Which hands have a normal that is not zero.
    """
    rows = []
    for hand in range(hands.shape[1]):
        distance, normal = obstacle.nearest(hands[:, hand])
        approaching = np.einsum("skd,sd->sk", normal, velocities[:, hand]) < 0
        rows.append(normal * ((distance < clearance) & approaching)[..., None])
    stacked = np.stack(rows, axis=1)
    return stacked, np.any(stacked != 0, axis=(2, 3))
