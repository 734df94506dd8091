"""Recorded movements, coloured by how surely nothing was in the way of each sample."""

from typing import Any

import numpy as np

from unconstrain.viewer import palette
from unconstrain.viewer.stage import Stage

THICKNESS = 2.0
"""Of lines, in pixels."""
JUMP = 0.5
"""Of the scene's extent: samples farther apart are not joined, such as those where an angle begins anew."""


class Movements:
    """A line for each movement."""

    def __init__(self) -> None:
        self._handle: Any = None
        self.visible = True

    def show(self, visible: bool) -> None:
        """Show it, or not."""
        self.visible = visible
        if self._handle is not None:
            self._handle.visible = visible

    def draw(self, stage: Stage) -> None:
        """Draw the movements; see `Part`."""
        if self._handle is not None:
            self._handle.remove()
        scene, shown = stage.server.scene, stage.shown
        P = stage.places(stage.states, lift=0.0)
        colours = np.tile(np.array(palette.rgb(palette.RECORDED), dtype=np.uint8), (len(P), 1))
        if shown.free is not None:
            known = ~np.isnan(shown.free)
            colours[known] = palette.blend(1.0 - shown.free[known], palette.FREE, palette.CONSTRAINED)
        near = np.linalg.norm(np.diff(P, axis=0), axis=1) < JUMP * stage.frame.extent
        joined = np.flatnonzero(shown.joined & near)
        if len(joined):
            pairs = np.stack([joined, joined + 1], axis=1)
            self._handle = scene.add_line_segments(
                "/movements",
                P[pairs],
                palette.linear(colours)[pairs],
                thickness=THICKNESS,
                thickness_units="screen",
                visible=self.visible,
            )
        else:
            size = 0.012 * stage.frame.extent
            self._handle = scene.add_point_cloud(
                "/movements",
                P,
                palette.linear(colours),
                point_size=size,
                point_shape="circle",
                visible=self.visible,
            )
