"""A robot whose base stands still: joints, limits, poses and Jacobians, by MuJoCo."""

import copy
import os
from collections.abc import Iterable, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.errors import DataError, RobotError
from unconstrain.robots.files import read_spec
from unconstrain.robots.joints import lock_joint
from unconstrain.robots.simulator import import_mujoco, one_line

if TYPE_CHECKING:
    import mujoco

Array = NDArray[np.float64]


class Robot:
    """A robot whose base stands still and whose joints each have one degree of freedom.

    Parameters
    ----------
    spec : mujoco.MjSpec
        What to simulate; `Robot.load` reads one from a file. It is copied.
    lock : iterable of str, or mapping from str to float
        Joints that shall not move: they are held at 0, or at the given position (radians or metres). Lock the
        free joint of a robot on a floating base to fix it.
    notes : iterable of str
        What was left out in reading, a sentence each.

    Attributes
    ----------
    model : mujoco.MjModel
    spec : mujoco.MjSpec
        What the model was compiled from, joints locked: copy it to add tables and balls.
    joints : tuple of str
        Names of the n joints that move, in the order of the columns of Q.
    limits : ndarray of shape (n, 2)
        Lower and upper limits, in radians or metres; infinite where the file gives none.
    notes : tuple of str

    Raises
    ------
    RobotError
        If a locked joint is not there, a joint has several degrees of freedom, or no joint is left to move.
    UnconstrainError
        If MuJoCo, which comes with the extra `sim`, is not installed.

    Examples
    --------
    >>> arm = Robot.load("panda.urdf", lock=["finger_joint1", "finger_joint2"])      # doctest: +SKIP
    >>> arm.jacobian(Q, "panda_hand_tcp")                                              # doctest: +SKIP
    """

    model: "mujoco.MjModel"
    spec: "mujoco.MjSpec"

    def __init__(
        self,
        spec: "mujoco.MjSpec",
        lock: Iterable[str] | Mapping[str, float] = (),
        notes: Iterable[str] = (),
    ):
        mujoco = import_mujoco()
        self.spec = spec.copy()
        self.notes = tuple(notes)
        locked = dict(lock) if isinstance(lock, Mapping) else dict.fromkeys(_names(lock), 0.0)
        for name, position in locked.items():
            lock_joint(self.spec, name, position)
        try:
            self.model = self.spec.compile()
        except ValueError as error:
            raise RobotError(f"MuJoCo cannot simulate this robot: {one_line(error)}") from error
        scalar = [int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)]
        for joint in map(self.model.joint, range(self.model.njnt)):
            if self.model.jnt_type[joint.id] not in scalar:
                raise RobotError(
                    f"joint {joint.name!r} has several degrees of freedom, and a fixed-base robot has one per "
                    f'joint: lock it, lock=["{joint.name}"]'
                )
        if not self.model.njnt:
            raise RobotError("this robot has no joint that moves: lock fewer, or load another file")
        self.joints = tuple(self.model.joint(i).name for i in range(self.model.njnt))
        limited = self.model.jnt_limited.astype(bool)[:, None]
        self.limits = np.where(limited, self.model.jnt_range, [-np.inf, np.inf])

    @classmethod
    def load(
        cls,
        path: str | os.PathLike[str],
        lock: Iterable[str] | Mapping[str, float] = (),
        package_dirs: Iterable[str | os.PathLike[str]] = (),
    ) -> "Robot":
        """Read a robot from an MJCF (.xml) or URDF (.urdf) file.

        Frames that are fixed to one another keep their names. A URDF's meshes that are missing, or of a kind
        MuJoCo does not read, are left out and listed in `notes`: they change neither kinematics nor inertias.

        Parameters
        ----------
        path : str or path
            Of the file.
        lock : iterable of str, or mapping from str to float
            Joints to hold still, as for `Robot`.
        package_dirs : iterable of str or path
            Where to look for a mesh named ``package://name/rest``: folders that hold packages, or are one. The
            folders above the file are searched as well.

        Returns
        -------
        Robot
            Ready for poses and Jacobians.

        Raises
        ------
        RobotError
            If the file is missing or not a robot, or the robot cannot be used (see `Robot`).
        """
        spec, notes = read_spec(path, package_dirs)
        try:
            return cls(spec, lock, notes)
        except RobotError as error:
            raise RobotError(f"{Path(path).name}: {error}") from error

    def __repr__(self) -> str:
        return f"<robot of {self.n} joints: {', '.join(self.joints)}>"

    @property
    def n(self) -> int:
        """The number of joints that move."""
        return len(self.joints)

    @property
    def frames(self) -> tuple[str, ...]:
        """Names that `pose` and `jacobian` understand: the robot's bodies and sites."""
        bodies = [self.model.body(i).name for i in range(self.model.nbody)]
        sites = [self.model.site(i).name for i in range(self.model.nsite)]
        return tuple(dict.fromkeys(name for name in bodies + sites if name))

    def pose(self, Q: ArrayLike, frame: str) -> tuple[Array, Array]:
        """Compute where a frame is in the world.

        Parameters
        ----------
        Q : array_like of shape (N, n)
            Joint positions, in radians or metres.
        frame : str
            One of `frames`.

        Returns
        -------
        positions : ndarray of shape (N, 3)
            Of the frame's origin, in metres.
        rotations : ndarray of shape (N, 3, 3)
            Their columns are the frame's axes.

        Raises
        ------
        RobotError
            If the frame is not there.
        DataError
            If the postures are not finite or of the wrong shape.
        """
        kind, index = self._find(frame)
        batch = self._at(Q)
        place = batch.bind("xpos" if kind == "body" else "site_xpos")
        turn = batch.bind("xmat" if kind == "body" else "site_xmat")
        batch.forward(stage=int(import_mujoco().mjtStage.mjSTAGE_POS))
        return place[:, index].copy(), turn[:, index].reshape(-1, 3, 3).copy()

    def jacobian(self, Q: ArrayLike, frame: str) -> Array:
        """Compute the geometric Jacobians J of a frame: ``(v, ω) = J q̇``.

        Parameters
        ----------
        Q : array_like of shape (N, n)
            Joint positions, in radians or metres.
        frame : str
            One of `frames`.

        Returns
        -------
        ndarray of shape (N, 6, n)
            Rows 1 to 3 give the velocity v of the frame's origin (m/s), rows 4 to 6 the angular velocity ω
            (rad/s), both in the world.

        Raises
        ------
        RobotError, DataError
            As for `pose`.
        """
        kind, index = self._find(frame)
        place, _ = self.pose(Q, frame)
        body = index if kind == "body" else int(self.model.site_bodyid[index])
        return np.concatenate(self._at(Q).jac(body, place), axis=1)

    def _find(self, frame: str) -> tuple[str, int]:
        """Return the kind of a frame, "body" or "site", and its index among those."""
        for kind, count in (("body", self.model.nbody), ("site", self.model.nsite)):
            for i in range(count):
                if getattr(self.model, kind)(i).name == frame:
                    return kind, i
        raise RobotError(f"the robot has no frame {frame!r}: it has {', '.join(self.frames)}")

    def _at(self, Q: ArrayLike) -> "mujoco.batch.Batch":
        try:
            Q = np.asarray(Q, dtype=np.float64)
        except (TypeError, ValueError):
            raise DataError(f"postures of the robot must be numbers, an array (N, {self.n})") from None
        if Q.ndim != 2 or Q.shape[1] != self.n:
            raise DataError(
                f"the robot has {self.n} joints: give postures of shape (N, {self.n}), not {Q.shape}"
            )
        if not np.isfinite(Q).all():
            raise DataError("a posture of the robot has NaN or infinity: give finite joint positions")
        batch = import_mujoco().batch.Batch(self._kinematic, len(Q), 1)
        batch.qpos = Q
        return batch

    @cached_property
    def _kinematic(self) -> "mujoco.MjModel":
        """The model without contacts and equalities, which would only cost time where nothing moves."""
        flags = import_mujoco().mjtDisableBit
        model = copy.copy(self.model)
        model.opt.disableflags |= int(flags.mjDSBL_CONTACT) | int(flags.mjDSBL_CONSTRAINT)
        return model


def _names(lock: Iterable[str]) -> list[str]:
    return [lock] if isinstance(lock, str) else list(lock)
