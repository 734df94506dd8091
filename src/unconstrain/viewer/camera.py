"""Where the scene is looked at from."""

from typing import Any

import numpy as np

from unconstrain.viewer.stage import Stage

FIELD_OF_VIEW = 0.7
"""Vertical, in radians."""
ABOVE, IN_SPACE = (0.0, 0.0, 1.95), (1.2, -1.6, 1.0)
"""From the middle of what is shown to the camera, in the scene's extent."""
ASIDE = {True: (0.22, 0.0, 0.0), False: (0.12, 0.09, 0.0)}
"""What the camera looks at, from the middle: the panel covers the right."""


def look(stage: Stage) -> None:
    """Put the camera where all of the scene is seen, from above what is flat.

    Parameters
    ----------
    stage : Stage
        What is shown.
    """
    served, frame = stage.server, stage.frame
    flat = frame.is_flat
    served.scene.set_up_direction("+y" if flat else "+z")
    aside, away = np.array(ASIDE[flat]), np.array(ABOVE if flat else IN_SPACE)
    camera: Any = served.initial_camera
    camera.fov = FIELD_OF_VIEW
    camera.up = (0.0, 1.0, 0.0) if flat else (0.0, 0.0, 1.0)
    camera.look_at = tuple(frame.middle + frame.extent * aside)
    camera.position = tuple(frame.middle + frame.extent * (aside + away))
    for client in served.get_clients().values():
        client.camera.up_direction = camera.up
        client.camera.position = camera.position
        client.camera.look_at = camera.look_at
