"""Grid, ticks and names of the axes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.viewer.frame import Frame
from unconstrain.viewer.stage import Stage

Array = NDArray[np.float64]

TICKS = 5
ROUND = (1.0, 2.0, 2.5, 5.0, 10.0)
MARGIN = 0.07
"""Around the recorded region, as a share of its largest side."""
LINES, DEPTH = (216, 216, 216), -0.02
"""Colour of the grid, and how far below a plane it lies."""


class Surroundings:
    """The floor below what is shown (all of it, if it is flat), with numbers in the units of the states."""

    def __init__(self) -> None:
        self._handles: list[Any] = []

    def draw(self, stage: Stage) -> None:
        """Draw grid, ticks and names; see `Part`."""
        scene, frame = stage.server.scene, stage.frame
        for handle in self._handles:
            handle.remove()
        low, high = limits(frame)
        spacing = choose_spacing(frame)
        ticks = [
            np.arange(np.ceil(a / spacing), np.floor(b / spacing) + 1) * spacing
            for a, b in zip(low, high, strict=True)
        ]
        self._handles = [
            scene.add_line_segments(
                "/floor", _floor(frame, low, high, ticks), LINES, thickness=1.0, thickness_units="screen"
            )
        ]
        corner = frame.to_scene(low[None])[0]
        away = 0.05 * frame.extent
        for axis, values in enumerate(ticks):
            aside = np.zeros(3)
            # Numbers of the third axis stand farther out, lest they cover those of the others at their corner.
            aside[[[1], [0], [0, 1]][axis]] = -away
            for k, value in enumerate(values):
                at = corner + aside
                at[axis] = frame.to_scene(np.full((1, len(low)), value))[0, axis]
                self._label(scene, f"/ticks/{axis}/{k}", f"{round(value, 12) + 0.0:g}", at)
            at = corner + 2.4 * aside
            at[axis] = frame.to_scene((low + high)[None] / 2.0)[0, axis]
            self._label(scene, f"/names/{axis}", stage.coordinates.names[axis], at, 1.2)

    def _label(self, scene: Any, name: str, text: str, at: Array, size: float = 0.9) -> None:
        self._handles.append(
            scene.add_label(name, text, position=tuple(at), font_screen_scale=size, anchor="center-center")
        )


def limits(frame: Frame) -> tuple[Array, Array]:
    """Return the limits of the axes: those of the recorded region, and a margin.

    Parameters
    ----------
    frame : Frame
        Of the scene.

    Returns
    -------
    low, high : ndarray of shape (k,)
        In the units of what is shown.
    """
    margin = MARGIN * frame.extent / frame.scale
    return frame.low - margin, frame.high + margin


def choose_spacing(frame: Frame) -> float:
    """Choose the spacing of the ticks, which all axes share: 1, 2, 2.5 or 5 times a power of ten.

    Parameters
    ----------
    frame : Frame
        Of the scene.

    Returns
    -------
    float
        In the units of what is shown.
    """
    rough = frame.extent / frame.scale / TICKS
    power = 10.0 ** np.floor(np.log10(rough))
    return float(min(power * each for each in ROUND if power * each >= rough * (1 - 1e-9)))


def _floor(frame: Frame, low: Array, high: Array, ticks: list[Array]) -> Array:
    """Return the lines (M, 2, 3) of a grid over the first two axes."""
    pieces = []
    two = [*ticks, np.zeros(1)][:2]
    bottom, top = np.append(low, 0.0)[:2], np.append(high, 0.0)[:2]
    for axis, values in enumerate(two):
        for value in [bottom[axis], *values, top[axis]]:
            ends = np.stack([bottom, top])
            ends[:, axis] = value
            pieces.append(ends)
    flat = np.array(pieces)
    places = np.zeros((*flat.shape[:2], len(low)))
    places[..., : min(2, len(low))] = flat[..., : len(low)]
    places[..., 2:] = low[2:]
    scene = frame.to_scene(places.reshape(-1, len(low)), lift=DEPTH).reshape(-1, 2, 3)
    return scene
