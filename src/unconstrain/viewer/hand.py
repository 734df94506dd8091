"""The place of a robot's hand, by forward kinematics of states that are its joints."""

import threading
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.robots import import_mujoco
from unconstrain.robots.robot import Robot
from unconstrain.spaces import Phased, SecondOrder, Space

Array = NDArray[np.float64]

ROUNDS, DAMPING = 20, 1e-3
"""Of the inverse kinematics: how often it is corrected, and by which length (in metres) it is damped."""


class OnePosture:
    """Forward kinematics of one posture at a time, which a rollout asks for at every step.

    Parameters
    ----------
    robot : Robot
        The robot; its own methods are for many postures, and take a hundred times as long for one.
    site : str
        One of its frames.
    """

    def __init__(self, robot: Robot, site: str) -> None:
        self._mujoco = import_mujoco()
        self._model, self._data = robot.model, self._mujoco.MjData(robot.model)
        kind = self._mujoco.mjtObj.mjOBJ_BODY
        self._id = self._mujoco.mj_name2id(self._model, kind, site)
        self._is_body = self._id >= 0
        if not self._is_body:
            self._id = self._mujoco.mj_name2id(self._model, self._mujoco.mjtObj.mjOBJ_SITE, site)
        self._lock = threading.Lock()

    def solve(self, q: Array) -> tuple[Array, Array]:
        """Compute where the frame is, and how joints move it.

        Parameters
        ----------
        q : ndarray of shape (robot.n,)
            Positions of the joints.

        Returns
        -------
        place : ndarray of shape (3,)
            In metres.
        J : ndarray of shape (3, robot.n)
            Jacobian of the place.
        """
        mujoco, model, data = self._mujoco, self._model, self._data
        J = np.zeros((3, model.nv))
        with self._lock:
            data.qpos[:] = q
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            place = (data.xpos if self._is_body else data.site_xpos)[self._id].copy()
            (mujoco.mj_jacBody if self._is_body else mujoco.mj_jacSite)(model, data, J, None, self._id)
        return place, J


class Hand:
    """Where a frame of a robot is, whose joints the states are.

    Parameters
    ----------
    robot : Robot
        The robot.
    site : str
        One of its frames.
    space : Space
        Of the states.
    state_names : sequence of str
        Of the n states. If they are the joints' names they may be in another order.

    Raises
    ------
    DataError
        There are other states than joints, or some that are neither numbers nor angles.
    RobotError
        The robot has no such frame.
    """

    def __init__(self, robot: Robot, site: str, space: Space, state_names: Sequence[str]) -> None:
        places = space.of if isinstance(space, Phased | SecondOrder) else space
        names = list(state_names)[: places.n_states]
        if places.n_states != places.n_actions or len(names) != robot.n:
            raise DataError(
                f"the robot has {robot.n} joints, {', '.join(robot.joints)}, and the policy's states are "
                f"{places.words}: lock the other joints with lock=, or leave out robot="
            )
        self.robot, self.site = robot, site
        self.by_name = sorted(names) == sorted(robot.joints)
        self.order = [names.index(joint) for joint in robot.joints] if self.by_name else list(range(robot.n))
        self.n_actions = space.n_actions
        self.names = tuple(f"{axis} (m)" for axis in "xyz")
        robot.pose(np.zeros((1, robot.n)), site)  # raises an error where there is no such frame
        self._one = OnePosture(robot, site)

    def joints(self, X: Array) -> Array:
        """Return the positions of the joints.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, robot.n)
            In the robot's order, radians or metres.
        """
        return X[:, self.order]

    def place(self, X: Array) -> Array:
        """Return where the hand is; see `Coordinates.place`."""
        if len(X) == 1:
            return self._one.solve(self.joints(X)[0])[0][None]
        return self.robot.pose(self.joints(X), self.site)[0]

    def tangents(self, X: Array) -> Array:
        """Return the Jacobians of its position; see `Coordinates.tangents`."""
        J = np.zeros((len(X), 3, self.n_actions))
        if len(X) == 1:
            J[0][:, self.order] = self._one.solve(self.joints(X)[0])[1]
        else:
            J[:, :, self.order] = self.robot.jacobian(self.joints(X), self.site)[:, :3]
        return J

    def put(self, x: Array, place: Array) -> Array:
        """Return the state nearby whose hand is at a place, or as near as it gets; see `Coordinates.put`."""
        found = x.copy()
        for _ in range(ROUNDS):
            at, J = self._one.solve(found[self.order])
            away = place - at
            if np.linalg.norm(away) < DAMPING:
                break
            turn = J.T @ np.linalg.solve(J @ J.T + DAMPING * np.eye(3), away)
            found[self.order] = np.clip(found[self.order] + turn, *self.robot.limits.T)
        return found
