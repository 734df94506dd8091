"""From what is shown, in its own units, to places in the scene."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SPAN = 2.0
"""Of the recorded states in the scene: near enough to the metre that viser's camera and handles are made for."""


@dataclass(frozen=True)
class Frame:
    """A uniform scale, so that axes are equal, and a centre.

    Parameters
    ----------
    centre : ndarray of shape (k,)
        What is shown in the middle of the scene.
    scale : float
        How long one unit is there.
    low, high : ndarray of shape (k,)
        Between which recorded states lie.
    """

    centre: Array
    scale: float
    low: Array
    high: Array

    @classmethod
    def around(cls, places: Array, *, in_metres: bool = False) -> "Frame":
        """Make the frame in which places fill the scene.

        Parameters
        ----------
        places : ndarray of shape (N, k)
            Recorded ones.
        in_metres : bool
            Whether the scene is in metres, as robots are.

        Returns
        -------
        Frame
            With the places in its middle.
        """
        low, high = places.min(axis=0), places.max(axis=0)
        span = float((high - low).max()) or 1.0
        if in_metres:
            return cls(np.zeros(places.shape[1]), 1.0, low, high)
        return cls((low + high) / 2.0, SPAN / span, low, high)

    @property
    def is_flat(self) -> bool:
        """Whether what is shown lies in a plane."""
        return len(self.centre) < 3

    @property
    def extent(self) -> float:
        """Largest side of the recorded region, in the scene."""
        return float((self.high - self.low).max()) * self.scale or SPAN

    @property
    def middle(self) -> Array:
        """Middle of the recorded region, in the scene, (3,)."""
        return self.to_scene((self.low + self.high)[None] / 2.0)[0]

    def to_scene(self, places: Array, lift: float = 0.0) -> Array:
        """Return where places are in the scene.

        Parameters
        ----------
        places : ndarray of shape (N, k)
            What is shown.
        lift : float
            How far above a plane what is flat is drawn, so that it is seen above others.

        Returns
        -------
        ndarray of shape (N, 3)
            In the scene.
        """
        return self._filled((places - self.centre) * self.scale, lift if self.is_flat else 0.0)

    def vectors(self, V: Array) -> Array:
        """Return vectors (N, k), such as velocities, in the scene (N, 3)."""
        return self._filled(V * self.scale, 0.0)

    def from_scene(self, point: Array) -> Array:
        """Return the place (k,) that is at a point (3,) of the scene."""
        return np.asarray(point, dtype=np.float64)[: len(self.centre)] / self.scale + self.centre

    def _filled(self, values: Array, lift: float) -> Array:
        filled = np.full((len(values), 3), 0.0)
        filled[:, : values.shape[1]] = values
        if values.shape[1] < 3:
            filled[:, 2] = lift
        return filled
