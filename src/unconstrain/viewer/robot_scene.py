"""A robot in viser's scene: its meshes and simple shapes, a node for each body, moved by its joints."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.errors import DataError
from unconstrain.robots import import_mujoco
from unconstrain.viewer.shapes import collect_shapes

Array = NDArray[np.float64]

STILL = 1e-6
"""A body that moved and turned by less (metres, quaternion) is not sent to the browser again."""


class RobotScene:
    """A robot, and whatever its model has around it, in the scene of a viser server.

    Parameters
    ----------
    server : viser.ViserServer
        In whose scene it is drawn, in metres.
    model : mujoco.MjModel
        As `Robot.model`, or any other.
    name : str
        Of the node above all of its bodies.
    leave_out : tuple of str
        Names of geoms that are not drawn.

    Attributes
    ----------
    notes : tuple of str
        What cannot be drawn, a sentence each. Instead of a texture its mean colour is drawn.
    bodies : dict of int to viser.FrameHandle
        The node of each body that has a shape, by the body's number.

    Examples
    --------
    >>> scene = RobotScene(server, Robot.load("panda.urdf").model)                   # doctest: +SKIP
    >>> scene.show(q)                                                                # doctest: +SKIP
    """

    def __init__(
        self, server: Any, model: Any, name: str = "/robot", *, leave_out: tuple[str, ...] = ()
    ) -> None:
        self._server, self.model = server, model
        self._data = import_mujoco().MjData(model)
        shapes, self.notes = collect_shapes(model, leave_out)
        self.bodies: dict[int, Any] = {}
        with server.atomic():
            for body, parts in shapes.items():
                node = f"{name}/{body}"
                self.bodies[body] = server.scene.add_frame(node, show_axes=False)
                for k, shape in enumerate(parts):
                    server.scene.add_mesh_simple(
                        f"{node}/{k}",
                        shape.vertices,
                        shape.faces,
                        color=shape.rgba[:3],
                        opacity=None if shape.rgba[3] >= 1 else shape.rgba[3],
                        flat_shading=shape.is_flat,
                        side="double",
                        cast_shadow=False,
                        receive_shadow=False,
                    )
        self._sent = np.full((model.nbody, 7), np.inf)
        self.show(model.qpos0)

    def show(self, q: ArrayLike) -> None:
        """Show the robot in a posture.

        Parameters
        ----------
        q : array_like of shape (nq,)
            Joint positions, in radians or metres; of a `Robot` in the order of its joints.

        Raises
        ------
        DataError
            There are not as many numbers, or some are not finite.
        """
        q = np.asarray(q, dtype=np.float64)
        if q.shape != (self.model.nq,) or not np.isfinite(q).all():
            raise DataError(
                f"a posture of the robot is {self.model.nq} finite numbers, one for each joint, not {q.shape}"
            )
        self._data.qpos = q
        import_mujoco().mj_kinematics(self.model, self._data)
        poses = np.concatenate([self._data.xpos, self._data.xquat], axis=1)
        moved = np.abs(poses - self._sent).max(axis=1) > STILL
        with self._server.atomic():
            for body in np.flatnonzero(moved).tolist():
                if body in self.bodies:
                    self.bodies[body].position, self.bodies[body].wxyz = poses[body, :3], poses[body, 3:]
        self._sent = np.where(moved[:, None], poses, self._sent)
