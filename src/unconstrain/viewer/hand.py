"""The place of a robot's hand, by forward kinematics of states that are its joints."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.robots.robot import Robot
from unconstrain.spaces import Phased, SecondOrder, Space

Array = NDArray[np.float64]

ROUNDS, DAMPING = 20, 1e-3
"""Of the inverse kinematics: how often it is corrected, and by which length (in metres) it is damped."""


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
        self.names = tuple(f"{axis} of {site} (m)" for axis in "xyz")
        robot.pose(np.zeros((1, robot.n)), site)

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
        return self.robot.pose(self.joints(X), self.site)[0]

    def tangents(self, X: Array) -> Array:
        """Return the Jacobians of its position; see `Coordinates.tangents`."""
        J = np.zeros((len(X), 3, self.n_actions))
        J[:, :, self.order] = self.robot.jacobian(self.joints(X), self.site)[:, :3]
        return J

    def put(self, x: Array, place: Array) -> Array:
        """Return the state nearby whose hand is at a place, or as near as it gets; see `Coordinates.put`."""
        found = x.copy()
        for _ in range(ROUNDS):
            away = place - self.place(found[None])[0]
            if np.linalg.norm(away) < DAMPING:
                break
            J = self.robot.jacobian(self.joints(found[None]), self.site)[0, :3]
            turn = J.T @ np.linalg.solve(J @ J.T + DAMPING * np.eye(3), away)
            found[self.order] = np.clip(found[self.order] + turn, *self.robot.limits.T)
        return found
