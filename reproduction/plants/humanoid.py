"""A humanoid of 27 joints: the project's own model, or a real robot by path (sections 4.3 and 4.4)."""

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from unconstrain.robots import Robot, RobotError, import_mujoco

if TYPE_CHECKING:
    import mujoco

Array = NDArray[np.float64]

MODEL = Path(__file__).parent / "models" / "humanoid.xml"
HANDS = ("left_hand", "right_hand")
FEET = ("left_foot", "right_foot")

STRETCH, STRETCH_STEPS = (1.0, 0.0, 0.3), 400
"""Where the hands of a robot without an outstretched posture are drawn to, in metres from home; beyond reach."""


@dataclass(frozen=True, eq=False)
class Humanoid:
    """A robot with two hands, its pelvis standing still, x forward and z up.

    Parameters
    ----------
    robot : Robot
        Its base stands still.
    hands : (str, str)
        Frames of the left and the right hand.
    feet : (str, str) or None
        Frames of the feet that whole-body motion keeps on the floor; None for a base that stands still.
    home : ndarray of shape (n,)
        The default standing posture q0: the file's keyframe "home", or else all joints at zero, moved into the limits.
    """

    robot: Robot
    hands: tuple[str, str]
    feet: tuple[str, str] | None
    home: Array

    @classmethod
    def load(
        cls,
        path: str | os.PathLike[str] | None = None,
        *,
        lock: Iterable[str] | Mapping[str, float] = (),
        hands: str | Iterable[str] = (),
        feet: str | Iterable[str] = (),
    ) -> "Humanoid":
        """Load the project's own humanoid, or any robot from an MJCF or URDF file.

        Parameters
        ----------
        path : str or path, optional
            Of the robot's file; without it the humanoid that comes with these experiments.
        lock : iterable of str, or mapping from str to float
            Joints to hold still, as for `Robot`; names may also come in one string, with commas.
        hands : iterable of str
            Names of the left and the right hand's frame; needed for any robot but our own. "LEFT,RIGHT" will do.
        feet : iterable of str
            Names of the left and the right foot's body, to be kept on the floor while the pelvis moves; without
            them another robot's base stands still.

        Returns
        -------
        Humanoid
            At home.

        Raises
        ------
        RobotError
            If there is no such file, joint or frame, or not two hands.
        """
        robot = Robot.load(
            MODEL if path is None else path, lock=split_names(lock) if isinstance(lock, str) else lock
        )
        hands, feet = split_names(hands), split_names(feet)
        if path is None:
            hands, feet = hands or HANDS, feet or FEET
        for name, frames, allowed in (("hands", hands, (2,)), ("feet", feet, (0, 2))):
            if len(frames) not in allowed:
                raise RobotError(
                    f"a humanoid has two {name} and {len(frames)} are named: name the left and the right frame "
                    f"among {', '.join(robot.frames)}"
                )
            for frame in frames:
                robot.pose(np.zeros((1, robot.n)), frame)
        home = _keyframe(robot, "home")
        home = np.clip(np.zeros(robot.n), *robot.limits.T) if home is None else home
        return cls(robot, (hands[0], hands[1]), (feet[0], feet[1]) if feet else None, home)

    @property
    def n(self) -> int:
        """The number of joints."""
        return self.robot.n

    def hand_motion(self, Q: Array) -> tuple[Array, Array]:
        """Compute where both hands are, and their Jacobians.

        `Robot.pose` and `Robot.jacobian` give the same one frame at a time; here one pass over the robot serves
        all of it, which matters to the million postures of an experiment.

        Parameters
        ----------
        Q : ndarray of shape (N, n)
            Postures, in radians.

        Returns
        -------
        positions : ndarray of shape (N, 2, 3)
            Of both hands in metres, left first.
        jacobians : ndarray of shape (N, 2, 3, n)
            Of the positions.
        """
        mj, model, data = import_mujoco(), self.robot.model, self._data
        X, J = np.empty((len(Q), 2, 3)), np.empty((len(Q), 2, 3, self.n))
        for q, x, jacobian in zip(Q, X, J, strict=True):
            data.qpos = q
            mj.mj_kinematics(model, data)
            mj.mj_comPos(model, data)  # Jacobians are taken from the motion axes this fills in
            for hand, (positions, index, body) in enumerate(self._hand_frames):
                x[hand] = positions[index]
                mj.mj_jac(model, data, jacobian[hand], None, x[hand], body)
        return X, J

    @cached_property
    def floor(self) -> float:
        """Height of the floor in metres: the robot's lowest point at home."""
        model, data = self.robot.model, self._data
        data.qpos = self.home
        import_mujoco().mj_kinematics(model, data)
        centre, half = model.geom_aabb[:, :3], model.geom_aabb[:, 3:]
        turn = data.geom_xmat.reshape(-1, 3, 3)[:, 2]
        lowest = data.geom_xpos[:, 2] + np.sum(turn * centre, axis=1) - np.sum(np.abs(turn) * half, axis=1)
        return float(lowest.min())

    @cached_property
    def outstretched(self) -> Array:
        """A posture (n,) with both arms outstretched.

        The file's keyframe of that name; else from home both hands are drawn far out to the front by
        `q ← q + Jᵀe`, inside the joint limits.
        """
        posture = _keyframe(self.robot, "outstretched")
        if posture is not None:
            return posture
        q = self.home.copy()
        target = self.hand_motion(q[None])[0][0] + STRETCH
        for _ in range(STRETCH_STEPS):
            X, J = self.hand_motion(q[None])
            error = target - X[0]
            error *= np.minimum(1.0, 0.1 / np.linalg.norm(error, axis=1, keepdims=True))
            q = np.clip(q + np.einsum("hdn,hd->n", J[0], error), *self.robot.limits.T)
        return q

    def draw_postures(self, n: int, rng: np.random.Generator, variance: float = 0.1) -> Array:
        """Draw postures (n, joints) ~ N(q0, variance I), clipped to the joint limits and free of self-collision.

        A posture in which the robot touches itself, otherwise than it does at home, is drawn anew. The variance is in
        rad².
        """
        postures = np.empty((n, self.n))
        for i in range(n):
            while True:
                q = self.home + np.sqrt(variance) * rng.standard_normal(self.n)
                q = np.clip(q, *self.robot.limits.T)
                if not self.touches_itself(q):
                    postures[i] = q
                    break
        return postures

    def touches_itself(self, q: Array) -> bool:
        """Tell whether two bodies of the robot are in contact at posture q (n,) that are not at home."""
        return bool(self._contacts(q) - self._contacts_at_home)

    @cached_property
    def _contacts_at_home(self) -> set[tuple[int, int]]:
        return self._contacts(self.home)

    @cached_property
    def _data(self) -> "mujoco.MjData":
        return import_mujoco().MjData(self.robot.model)

    @cached_property
    def _hand_frames(self) -> list[tuple[Array, int, int]]:
        """For each hand: the positions of all frames of its kind, its place among them, and the body it is on."""
        model, data = self.robot.model, self._data
        sites = {model.site(i).name: i for i in range(model.nsite)}
        bodies = {model.body(i).name: i for i in range(model.nbody)}
        return [
            (data.xpos, bodies[hand], bodies[hand])
            if hand in bodies
            else (data.site_xpos, sites[hand], int(model.site_bodyid[sites[hand]]))
            for hand in self.hands
        ]

    def _contacts(self, q: Array) -> set[tuple[int, int]]:
        mj, model, data = import_mujoco(), self.robot.model, self._data
        data.qpos[:] = q
        mj.mj_kinematics(model, data)
        mj.mj_collision(model, data)
        bodies = model.geom_bodyid[data.contact.geom.reshape(-1, 2)]
        return {(int(a), int(b)) for a, b in np.sort(bodies, axis=1)}


def split_names(given: str | Iterable[str]) -> tuple[str, ...]:
    """Take names given one by one, or in one string with commas."""
    if isinstance(given, str):
        return tuple(name.strip() for name in given.split(",") if name.strip())
    return tuple(given)


def _keyframe(robot: Robot, name: str) -> Array | None:
    model = robot.model
    found = [k for k in range(model.nkey) if model.key(k).name == name]
    return model.key_qpos[found[0]].copy() if found else None
