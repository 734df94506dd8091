"""An obstacle in the plane: a rectangle with rounded corners."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import UnconstrainError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Box:
    """A rectangle with rounded corners.

    Parameters
    ----------
    center : (float, float)
        Its middle, in metres.
    size : (float, float)
        Full width and height before turning, in metres.
    angle : float
        By which it is turned counterclockwise, in radians.
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
        """Find the points (..., 2) of the sharp rectangle nearest to the given ones (..., 2)."""
        local = (points - self.center) @ self.axes.T
        return self.center + np.clip(local, -self.core, self.core) @ self.axes

    def outline(self) -> Array:
        """Trace the rounded outline (M, 2), for drawing."""
        quarter = np.linspace(0, np.pi / 2, 9)
        start = self.angle + np.arange(4)[:, None] * np.pi / 2 + quarter
        arcs = self.corners[:, None] + self.rounding * np.stack([np.cos(start), np.sin(start)], axis=-1)
        return arcs.reshape(-1, 2)
