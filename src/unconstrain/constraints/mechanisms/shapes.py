"""The surfaces and curves that mechanisms leave to a point that is held."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Kind = Literal["prismatic", "hinge", "plane", "sphere", "cylinder"]


@dataclass(frozen=True)
class Shape:
    """Where a mechanism lets a point be.

    Parameters
    ----------
    kind : {"prismatic", "hinge", "plane", "sphere", "cylinder"}
        A line, a circle, and three surfaces.
    point : ndarray of shape (d,)
        On the line or the plane, the middle of what was recorded; else the centre, of a cylinder a point of its axis.
    direction : ndarray of shape (d,)
        Unit vector along the line or the axis, or the plane's normal; its largest entry is positive. Zero for a sphere,
        and for a hinge in two dimensions.
    radius : float
        Of circle, sphere or cylinder; else infinite.
    """

    kind: Kind
    point: Array
    direction: Array
    radius: float = np.inf

    @property
    def offset(self) -> float:
        """How far a plane is from the origin, along its normal."""
        return float(self.direction @ self.point)

    def rows(self, P: Array) -> Array:
        """Compute the directions that are blocked at points.

        Parameters
        ----------
        P : ndarray of shape (N, d)
            Points.

        Returns
        -------
        ndarray of shape (N, k, d)
            Orthonormal rows, ``A v = 0`` for the velocities v that the mechanism lets through. The outward row is zero
            at a centre.
        """
        if self.kind == "prismatic":
            across = np.linalg.svd(self.direction[None])[2][1:]
            return np.broadcast_to(across, (len(P), *across.shape)).copy()
        if self.kind == "plane":
            return np.broadcast_to(self.direction, (len(P), 1, len(self.direction))).copy()
        outward = self._outward(P)
        length = np.linalg.norm(outward, axis=1, keepdims=True)
        radial = np.divide(outward, length, out=np.zeros_like(outward), where=length > 0)[:, None]
        if self.kind != "hinge" or not self.direction.any():
            return radial
        return np.concatenate([np.broadcast_to(self.direction, radial.shape), radial], axis=1)

    def residuals(self, P: Array) -> Array:
        """Compute how far points are from the shape along each blocked direction.

        Parameters
        ----------
        P : ndarray of shape (N, d)
            Points.

        Returns
        -------
        ndarray of shape (N, k)
            In the unit of the points.
        """
        away = P - self.point
        if self.kind == "prismatic":
            return away @ np.linalg.svd(self.direction[None])[2][1:].T
        if self.kind == "plane":
            return (away @ self.direction)[:, None]
        radial = (np.linalg.norm(self._outward(P), axis=1) - self.radius)[:, None]
        if self.kind != "hinge" or not self.direction.any():
            return radial
        return np.concatenate([(away @ self.direction)[:, None], radial], axis=1)

    def angles(self, P: Array) -> Array:
        """Compute by how much a hinge is turned at points, counted about its direction and without jumps.

        Parameters
        ----------
        P : ndarray of shape (N, d)
            In the order of time.

        Returns
        -------
        ndarray of shape (N,)
            Radians from the first point.
        """
        outward = self._outward(P)
        first = outward[0] / np.linalg.norm(outward[0])
        second = np.array([-first[1], first[0]]) if len(first) == 2 else np.cross(self.direction, first)
        return np.unwrap(np.arctan2(outward @ second, outward @ first))

    def describe(self, names: Sequence[str]) -> str:
        """Say where the shape is.

        Parameters
        ----------
        names : sequence of str
            Names of the d positions.

        Returns
        -------
        str
            Its numbers, in the unit of the positions.
        """
        at, along = _numbers(self.point), _numbers(self.direction)
        axes = ", ".join(names)
        if self.kind == "prismatic":
            return f"direction ({axes}) = ({along})"
        if self.kind == "plane":
            return f"normal ({axes}) = ({along}), offset {self.offset:.4g} along it"
        if not self.direction.any():
            return f"centre ({axes}) = ({at}), radius {self.radius:.4g}"
        return f"axis through ({axes}) = ({at}), direction ({along}), radius {self.radius:.4g}"

    def _outward(self, P: Array) -> Array:
        away = P - self.point
        return away if self.kind == "sphere" else away - np.outer(away @ self.direction, self.direction)


def _numbers(values: Array) -> str:
    return ", ".join(f"{value + 0.0:.4g}" for value in np.round(values, 4))
