"""The start of the rollout, to be dragged."""

from collections.abc import Callable
from typing import Any

import numpy as np

from unconstrain.viewer import palette
from unconstrain.viewer.stage import Stage

HANDLE, BALL = 0.16, 0.03
"""Size of the handle and radius of the ball, as shares of the scene's extent."""


class Start:
    """A ball with a handle.

    Parameters
    ----------
    stage : Stage
        Where it is drawn.
    dragged : callable
        Is told the point (3,) of the scene that the handle was dragged to.
    """

    def __init__(self, stage: Stage, dragged: Callable[[np.ndarray], None]) -> None:
        self._dragged = dragged
        self._handle: Any = None
        self._is_flat: bool | None = None
        self.draw(stage)

    def draw(self, stage: Stage) -> None:
        """Draw it where the start is; see `Part`."""
        frame, scene = stage.frame, stage.server.scene
        if self._is_flat != frame.is_flat:
            self._is_flat = frame.is_flat
            if self._handle is not None:
                self._handle.remove()
            self._handle = scene.add_transform_controls(
                "/start",
                scale=HANDLE * frame.extent,
                active_axes=(True, True, not frame.is_flat),
                disable_rotations=True,
                depth_test=False,
            )
            radius = BALL * frame.extent
            scene.add_icosphere("/start/ball", radius=radius, color=palette.rgb(palette.LEARNT))

            # A coroutine is called in the order of what happens; a function would be by any of 32 threads.
            async def follow(event: Any) -> None:
                self._dragged(np.array(event.target.position))

            self._handle.on_update(follow)
        self._handle.position = tuple(stage.places(stage.start[None])[0])

    def drag_to(self, point: np.ndarray) -> None:
        """Put handle and start to a point of the scene, as if it were dragged there.

        Parameters
        ----------
        point : ndarray of shape (3,)
            In the scene.
        """
        self._handle.position = tuple(point)
        self._dragged(np.asarray(point, dtype=np.float64))
