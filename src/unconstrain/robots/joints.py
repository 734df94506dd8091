"""Joints that shall not move are taken out of a robot."""

from typing import TYPE_CHECKING

import numpy as np

from unconstrain.errors import RobotError
from unconstrain.robots.simulator import import_mujoco

if TYPE_CHECKING:
    import mujoco


def lock_joint(spec: "mujoco.MjSpec", name: str, position: float) -> None:
    """Take a joint out of `spec`, and leave its body where the joint holds it at `position`.

    Couplings with other joints and actuators of the joint go with it.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Is changed.
    name : str
        Of the joint.
    position : float
        In radians or metres. A joint with several degrees of freedom can only be locked at 0.

    Raises
    ------
    RobotError
        If there is no such joint, or it cannot be locked at that position.
    """
    mujoco = import_mujoco()
    joint = next((joint for joint in spec.joints if joint.name == name), None)
    if joint is None:
        known = ", ".join(joint.name for joint in spec.joints)
        raise RobotError(f"there is no joint {name!r} to lock: the joints are {known}")
    if not np.isfinite(position):
        raise RobotError(f"joint {name!r} can be locked at a finite position only, not {position}")
    body = joint.parent
    if position:
        turn, moved = np.array([1.0, 0, 0, 0]), np.zeros(3)
        axis = joint.axis / np.linalg.norm(joint.axis)
        if joint.type == mujoco.mjtJoint.mjJNT_HINGE:
            mujoco.mju_axisAngle2Quat(turn, axis, position)
            mujoco.mju_rotVecQuat(moved, joint.pos, turn)
            moved = joint.pos - moved
        elif joint.type == mujoco.mjtJoint.mjJNT_SLIDE:
            moved = position * axis
        else:
            raise RobotError(f"joint {name!r} has several degrees of freedom: lock it without a position")
        shift, quat = np.zeros(3), np.zeros(4)
        mujoco.mju_rotVecQuat(shift, moved, body.quat)
        mujoco.mju_mulQuat(quat, body.quat, turn)
        body.pos, body.quat = body.pos + shift, quat
    for equality in list(spec.equalities):
        if equality.type == mujoco.mjtEq.mjEQ_JOINT and name in (equality.name1, equality.name2):
            spec.delete(equality)
    for actuator in list(spec.actuators):
        if actuator.target == name:
            spec.delete(actuator)
    spec.delete(joint)
