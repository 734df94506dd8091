"""From velocities of both hands to motion of the whole body, by mink (section 4.3).

Every step solves one quadratic program over the velocities of all joints,

    min  Σ_hands ‖J q̇ - ẋ‖² + ε² ‖q̇ + k (q - q_posture)‖²     so that joints stay in their limits
                                                            and the feet on the floor,

with mink's frame tasks, posture task and configuration limit, and the solver DAQP.
"""

from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reproduction.plants.humanoid import Humanoid
from unconstrain.errors import UnconstrainError

Array = NDArray[np.float64]

POSTURE_COST = 1e-3
"""ε: what a radian off the posture costs, in metres off the hands' way."""

LEG_COST = 4.0
"""Times ε for joints between the feet and the pelvis: a robot reaches with its arms first, then bows."""

POSTURE_RATE = 0.5
"""k: how fast the body is drawn back to its posture where the hands leave it free, in 1/s."""

BALANCE_COST = 0.05
"""What a metre of the centre of mass off its place over the feet costs, in metres off the hands' way."""

SETTLING_BALANCE_COST = 10.0
"""The same while a posture is brought to stand, in radians off the posture: balance comes first there."""

DAMPING = 1e-8
"""Keeps the quadratic program definite in directions no task minds."""

SETTLING_STEPS = 12
"""Steps in which a posture is brought to stand on its feet."""


def import_mink() -> ModuleType:
    """Import the package `mink` and its solver. Raises `UnconstrainError` where they are not installed."""
    try:
        import mink
        import qpsolvers

        if "daqp" not in qpsolvers.available_solvers:
            raise ImportError("qpsolvers finds no daqp")
    except ImportError as error:
        raise UnconstrainError(
            f"whole-body motion is controlled by mink and DAQP, which cannot be imported here ({error}): "
            "pip install 'unconstrain[sim]'"
        ) from error
    return mink


class WholeBody:
    """A humanoid whose hands are commanded and whose other joints follow.

    With feet named, the pelvis moves and the feet stay where they stand at home; without, the base stands still.

    Parameters
    ----------
    humanoid : Humanoid
        To be moved.
    model : mujoco.MjModel, optional
        To share with a scene that shows it: what `make_floating` compiles to, with things added around the robot.

    Attributes
    ----------
    model, data : mujoco.MjModel, mujoco.MjData
        Of the robot in its present posture.
    """

    def __init__(self, humanoid: Humanoid, model: Any = None):
        mink = import_mink()
        self.humanoid = humanoid
        self.model = make_floating(humanoid).compile() if model is None else model
        self._configuration = mink.Configuration(self.model)
        self.data = self._configuration.data
        self._joints = [int(self.model.joint(name).qposadr[0]) for name in humanoid.robot.joints]
        self._upright = self.model.qpos0.copy()
        self._upright[self._joints] = humanoid.home
        self._configuration.update(self._upright)

        self._limits = [mink.ConfigurationLimit(self.model)]
        self._hands = [mink.FrameTask(hand, self._kind(hand), 1.0, 0.0) for hand in humanoid.hands]
        self._posture = mink.PostureTask(self.model, cost=self._posture_costs())
        self._feet = [mink.FrameTask(foot, self._kind(foot), 1.0, 1.0) for foot in humanoid.feet or ()]
        self._balance = [mink.ComTask(cost=[BALANCE_COST, BALANCE_COST, 0.0])] if self._feet else []
        for task in [*self._feet, *self._balance]:
            task.set_target_from_configuration(self._configuration)

    @property
    def hands(self) -> Array:
        """Positions (2, 3) of both hands in metres, left first."""
        frames = zip(self.humanoid.hands, self._hands, strict=True)
        return np.stack(
            [
                self._configuration.get_transform_frame_to_world(name, task.frame_type).translation()
                for name, task in frames
            ]
        )

    @property
    def posture(self) -> Array:
        """Joint positions (n,) in radians, in the order of the robot's joints."""
        return self.data.qpos[self._joints].copy()

    def stand(self, q: Array) -> None:
        """Take up the posture q (n,), as far as that is possible standing on both feet and in balance.

        The feet are where they are at home, the centre of mass stays above the same point, and every joint is as
        near to q as these allow. The posture reached is the one the body returns to when the hands leave it free.
        """
        mink = import_mink()
        wanted = self._upright.copy()
        wanted[self._joints] = q
        self._configuration.update(wanted)
        if self._feet:
            nearest = mink.PostureTask(self.model, cost=1.0)
            nearest.set_target(wanted)
            balance = mink.ComTask(cost=[SETTLING_BALANCE_COST, SETTLING_BALANCE_COST, 0.0])
            balance.set_target(self._balance[0].target_com)
            for _ in range(SETTLING_STEPS):
                self._solve([nearest, balance], 1.0)
        self._posture.set_target(self._configuration.q)

    def move(self, velocities: Array, dt: float) -> Array:
        """Move the hands with the velocities asked for, as far as the body can.

        Parameters
        ----------
        velocities : ndarray of shape (2, 3)
            In m/s, left hand first.
        dt : float
            For how many seconds.

        Returns
        -------
        ndarray of shape (2, 3)
            The velocities the hands really had when the motion began, J q̇. Their difference from those asked for is
            the tracking error of whole-body control.
        """
        mink = import_mink()
        self._posture.gain = POSTURE_RATE * dt
        jacobians = []
        for name, task, velocity in zip(self.humanoid.hands, self._hands, velocities, strict=True):
            now = self._configuration.get_transform_frame_to_world(name, task.frame_type)
            there = now.translation() + dt * velocity
            task.set_target(mink.SE3.from_rotation_and_translation(now.rotation(), there))
            jacobian = self._configuration.get_frame_jacobian(name, task.frame_type)
            jacobians.append(now.rotation().as_matrix() @ jacobian[:3])
        qdot = self._solve([*self._hands, self._posture, *self._balance], dt)
        return np.stack([jacobian @ qdot for jacobian in jacobians])

    def _solve(self, tasks: list[Any], dt: float) -> Array:
        mink = import_mink()
        try:
            qdot = mink.solve_ik(
                self._configuration, tasks, dt, "daqp", DAMPING, limits=self._limits, constraints=self._feet
            )
        except mink.NoSolutionFound:
            # The feet cannot be held within the joint limits from here: stay, and let the tracking error show it.
            return np.zeros(self.model.nv)
        self._configuration.integrate_inplace(qdot, dt)
        return qdot

    def _posture_costs(self) -> Array:
        costs = np.full(self.model.nv, POSTURE_COST)
        for foot in self.humanoid.feet or ():
            body = self._body(foot)
            # Up to the pelvis, the body that has the world for a parent.
            while self.model.body_parentid[body]:
                first = self.model.body_dofadr[body]
                costs[first : first + self.model.body_dofnum[body]] = LEG_COST * POSTURE_COST
                body = self.model.body_parentid[body]
        return costs

    def _body(self, frame: str) -> int:
        if self._kind(frame) == "site":
            return int(self.model.site(frame).bodyid[0])
        return int(self.model.body(frame).id)

    def _kind(self, frame: str) -> str:
        bodies = {self.model.body(i).name for i in range(self.model.nbody)}
        return "body" if frame in bodies else "site"


def make_floating(humanoid: Humanoid) -> Any:
    """Copy the robot's `mujoco.MjSpec`, its pelvis free to move where it has feet to stand on."""
    spec = humanoid.robot.spec.copy()
    for key in list(spec.keys):  # postures without the pelvis' place in them
        spec.delete(key)
    if humanoid.feet:
        spec.worldbody.first_body().add_freejoint().name = "floating_base"
    return spec
