"""Grid, ticks and names of the axes."""

import numpy as np
from numpy.typing import NDArray

from unconstrain.viewer.frame import Frame
from unconstrain.viewer.stage import Stage

Array = NDArray[np.float64]

TICKS = 5
ROUND = (1.0, 2.0, 2.5, 5.0, 10.0)
MARGIN = 0.08
"""Around the recorded region, as a share of its largest side."""


class Surroundings:
    """The floor below what is shown (all of it, if it is flat), with numbers in the units of the states."""

    def __init__(self) -> None:
        self._handles: list = []

    def draw(self, stage: Stage) -> None:
        """Draw grid, ticks and names; see `Part`."""
        scene, frame = stage.server.scene, stage.frame
        for handle in self._handles:
            handle.remove()
        low, high, spacing = limits(frame)
        corner, opposite = frame.to_scene(low[None])[0], frame.to_scene(high[None])[0]
        cell = spacing * frame.scale
        floor = (corner + opposite) / 2.0
        floor[2] = corner[2] if not frame.is_flat else -0.02
        width, height = (np.maximum((opposite - corner)[:2], cell)).tolist()
        self._handles = [
            scene.add_grid(
                "/floor",
                width=width,
                height=height,
                plane="xy",
                cell_size=cell,
                section_size=cell,
                cell_color=(225, 225, 225),
                section_color=(205, 205, 205),
                shadow_opacity=0.0,
                position=tuple(floor),
            )
        ]
        size = len(low)
        for axis in range(size):
            edge = corner.copy()
            away = np.zeros(3)
            away[1 if axis != 1 else 0] = -0.35 * cell
            for k, value in enumerate(np.arange(low[axis], high[axis] + spacing / 2, spacing)):
                at = edge + away
                at[axis] = corner[axis] + k * cell
                self._label(scene, f"/ticks/{axis}/{k}", f"{round(value, 12):g}", at)
            at = edge + 2.0 * away
            at[axis] = (corner[axis] + opposite[axis]) / 2.0
            self._label(scene, f"/names/{axis}", stage.coordinates.names[axis], at, 1.25)

    def _label(self, scene: object, name: str, text: str, at: Array, size: float = 0.9) -> None:
        self._handles.append(
            scene.add_label(  # type: ignore[attr-defined]
                name, text, position=tuple(at), font_screen_scale=size, anchor="center-center"
            )
        )


def limits(frame: Frame) -> tuple[Array, Array, float]:
    """Choose round limits of the axes, and a round spacing that all axes share.

    Parameters
    ----------
    frame : Frame
        Of the scene.

    Returns
    -------
    low, high : ndarray of shape (k,)
        Multiples of the spacing.
    spacing : float
        In the units of what is shown.
    """
    span = float((frame.high - frame.low).max()) or 1.0 / frame.scale
    rough = span / TICKS
    power = 10.0 ** np.floor(np.log10(rough))
    spacing = float(min(power * each for each in ROUND if power * each >= rough * (1 - 1e-9)))
    margin = MARGIN * span
    low = np.floor((frame.low - margin) / spacing) * spacing
    high = np.ceil((frame.high + margin) / spacing) * spacing
    return low, high, spacing
