"""The arm for MuJoCo's dynamics: its servos, and the grip or the table that constrains its hand."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from reproduction.plants import arm
from unconstrain.errors import UnconstrainError
from unconstrain.robots import Robot, import_mujoco

TIMESTEP = 0.001
"""Seconds: dynamics and servos run at 1 kHz."""

SERVO_GAIN = 50.0
"""k in N m s/rad, the same in all joints."""

GRIPPED, TABLE = "gripped", "table"
SCENARIOS = (GRIPPED, TABLE)
"""The hand held in space, or sliding on a table."""

TIP = "tip"
"""Middle of the sphere at the end of the arm: what slides on the table."""
TIP_RADIUS = 0.018
"""In metres."""


def stage(scenario: str) -> Robot:
    """Equip the arm with servos, and with what constrains it: a grip on the hand, or a table it hangs above.

    Raises `UnconstrainError` for an unknown scenario, or where the extra `sim` is not installed.
    """
    mujoco = import_mujoco()
    if scenario not in SCENARIOS:
        raise UnconstrainError(f"there is no scenario {scenario!r}: choose one of {', '.join(SCENARIOS)}")
    spec = arm.load_robot().spec.copy()
    spec.option.timestep = TIMESTEP
    # Servo and joint damping are stiff at this gain; the implicit integrator takes them in its stride.
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # Its controller compensates gravity, as that of the real arm does.
    spec.option.gravity = [0.0, 0.0, 0.0]
    for i in range(arm.JOINTS):
        servo = spec.add_actuator(name=f"servo{i + 1}", target=f"joint{i + 1}")
        servo.trntype = mujoco.mjtTrn.mjTRN_JOINT
        servo.set_to_velocity(kv=SERVO_GAIN)
    last = spec.body("link7")
    last.add_site(name=TIP, pos=[0, 0, arm.OFFSETS[-1] - TIP_RADIUS], size=[1.2 * TIP_RADIUS] * 3)
    if scenario == GRIPPED:
        _add_grip(spec)
    else:
        _add_table(spec)
    return Robot(spec)


def stage_episode(scenario: str, start: NDArray[np.float64], table: NDArray[np.float64]) -> Robot:
    """Stage the arm with the grip or the table where it was in an episode, to be drawn.

    Parameters
    ----------
    scenario : str
        One of `SCENARIOS`.
    start : array (7,)
        Joint angles at the start of the episode, in radians.
    table : array (7,)
        Position and quaternion of the table.

    Returns
    -------
    Robot
        With the grip where the hand was, or with the table.
    """
    spec = stage(scenario).spec.copy()
    if scenario == GRIPPED:
        spec.body("grip").pos = arm.pose(start[None])[0][0]
    else:
        spec.body("table").pos, spec.body("table").quat = table[:3], table[3:]
    return Robot(spec)


def _add_grip(spec: Any) -> None:
    mujoco = import_mujoco()
    grip = spec.worldbody.add_body(name="grip", mocap=True)
    grip.add_site(name="held", size=[0.03] * 3, rgba=[0.0, 0.45, 0.7, 0.6])
    hold = spec.add_equality(name="hold", type=mujoco.mjtEq.mjEQ_CONNECT, objtype=mujoco.mjtObj.mjOBJ_SITE)
    hold.name1, hold.name2 = arm.HAND, "held"
    # As stiff as the time step allows, and nearly without give: the hand stays within fractions of a millimetre.
    hold.solref, hold.solimp = [2 * TIMESTEP, 1.0], [0.999, 0.9999, 0.001, 0.5, 2.0]


def _add_table(spec: Any) -> None:
    mujoco = import_mujoco()
    spec.body("base").quat = [0.0, 1.0, 0.0, 0.0]  # hangs from the ceiling
    table = spec.worldbody.add_body(name="table", mocap=True)
    top = table.add_geom(name="top", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0.75, 0.75, 0.01])
    top.rgba = [0.62, 0.5, 0.38, 1.0]
    tip = next(geom for geom in spec.geoms if geom.name == "fingertip")
    for geom in (top, tip):
        geom.contype, geom.conaffinity, geom.condim = 1, 1, 1  # one dimension: no friction
        geom.solref, geom.solimp = [2 * TIMESTEP, 1.0], [0.999, 0.9999, 0.001, 0.5, 2.0]
    sensor = spec.add_sensor(name="touch", type=mujoco.mjtSensor.mjSENS_TOUCH, objname=TIP)
    sensor.objtype = mujoco.mjtObj.mjOBJ_SITE
