"""Pictures of a simulated robot, without a window, by MuJoCo."""

import os
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import UnconstrainError
from unconstrain.robots import import_mujoco

Image = NDArray[np.uint8]


class NoOpenGL(UnconstrainError):
    """There is nothing to draw with on this computer."""


class Camera:
    """Looks at one model from one place; to be closed after use, or used in a `with` block.

    Parameters
    ----------
    model : mujoco.MjModel
        To be looked at.
    width, height : int
        Of the pictures, in pixels.
    at : (x, y, z)
        What the camera looks at, in metres.
    distance, azimuth, elevation : float
        From there to the camera in metres; in which direction it looks, and how far up, in degrees.

    Raises
    ------
    NoOpenGL
        If there is no OpenGL to draw with.
    """

    def __init__(
        self,
        model: Any,
        width: int,
        height: int,
        *,
        at: Sequence[float],
        distance: float,
        azimuth: float,
        elevation: float,
    ):
        mujoco = import_mujoco()
        self.model, self._data = model, mujoco.MjData(model)
        model.vis.global_.offwidth = max(width, model.vis.global_.offwidth)
        model.vis.global_.offheight = max(height, model.vis.global_.offheight)
        try:
            _draw_without_display()
            self._renderer = mujoco.Renderer(model, height, width)
        except Exception as error:  # what fails, and how, differs between OpenGL's many ways to be absent
            raise NoOpenGL(
                f"there is no OpenGL to draw with here ({' '.join(str(error).split()) or type(error).__name__}): "
                "install EGL or OSMesa and set MUJOCO_GL to egl or osmesa, or leave the pictures out"
            ) from error
        self._camera = mujoco.MjvCamera()
        self._camera.lookat, self._camera.distance = np.asarray(at, dtype=np.float64), distance
        self._camera.azimuth, self._camera.elevation = azimuth, elevation

    def picture(self, posture: NDArray[np.float64]) -> Image:
        """Render the model in a posture (nq,), as an image (height, width, 3)."""
        self._data.qpos = posture
        import_mujoco().mj_forward(self.model, self._data)
        self._renderer.update_scene(self._data, self._camera)
        return self._renderer.render()

    def close(self) -> None:
        """Give back what the graphics card holds."""
        self._renderer.close()

    def __enter__(self) -> "Camera":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _draw_without_display() -> None:
    """Draw by EGL where nothing else is asked for and there is no display.

    MuJoCo reads MUJOCO_GL when it is first imported, which is long ago by now.
    """
    chosen = any(os.environ.get(name) for name in ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY"))
    if sys.platform == "linux" and not chosen:
        from mujoco.egl import GLContext
        from mujoco.rendering.classic import gl_context

        gl_context.GLContext = GLContext
