"""The node of the gallery converts ROS 2's messages, of which rosbags has the definitions, without ROS."""

import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

import unconstrain as uc

rosbags = pytest.importorskip("rosbags.typesys")

NODE = runpy.run_path(str(Path(__file__).parents[2] / "examples" / "ros2_node.py"), run_name="node")
TYPES = rosbags.get_typestore(rosbags.Stores.ROS2_JAZZY).types
JOINTS = ["shoulder", "elbow", "wrist"]


def joint_state(**positions: float):
    """A message as ROS 2 would bring it."""
    time = TYPES["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    none = np.empty(0)
    return TYPES["sensor_msgs/msg/JointState"](
        header=TYPES["std_msgs/msg/Header"](stamp=time, frame_id=""),
        name=list(positions),
        position=np.array(list(positions.values())),
        velocity=none,
        effort=none,
    )


def test_joints_may_come_in_any_order_and_there_may_be_more():
    message = joint_state(wrist=3.0, finger=9.0, shoulder=1.0, elbow=2.0)
    np.testing.assert_array_equal(NODE["read_state"](message, JOINTS), [1.0, 2.0, 3.0])


def test_a_missing_joint_is_named():
    with pytest.raises(uc.errors.DataError, match="no position of elbow: they have wrist, shoulder"):
        NODE["read_state"](joint_state(wrist=3.0, shoulder=1.0), JOINTS)


def test_a_joint_without_a_position_is_missing():
    message = joint_state(shoulder=1.0, elbow=2.0, wrist=3.0)
    message.position = message.position[:2]
    with pytest.raises(uc.errors.DataError, match="no position of wrist"):
        NODE["read_state"](message, JOINTS)


def test_a_position_that_is_not_a_number_is_refused():
    with pytest.raises(uc.errors.DataError, match="not all numbers"):
        NODE["read_state"](joint_state(shoulder=1.0, elbow=np.nan, wrist=3.0), JOINTS)


def test_the_command_is_a_step_ahead_and_names_its_joints():
    Duration = TYPES["builtin_interfaces/msg/Duration"]
    none = np.empty(0)
    point = TYPES["trajectory_msgs/msg/JointTrajectoryPoint"](none, none, none, none, Duration(0, 0))
    header = joint_state().header
    trajectory = TYPES["trajectory_msgs/msg/JointTrajectory"](header, [], [])
    state, action = np.array([1.0, 2.0, 3.0]), np.array([0.5, -0.5, 0.0])
    NODE["write_command"](trajectory, point, JOINTS, state, action, 1.25)
    assert trajectory.joint_names == JOINTS
    assert (point.time_from_start.sec, point.time_from_start.nanosec) == (1, 250_000_000)
    np.testing.assert_allclose(trajectory.points[0].positions, state + 1.25 * action)


def test_the_node_acts_on_a_whole_message_and_reports_another(tmp_path, monkeypatch):
    X = np.random.default_rng(0).normal(size=(50, 3))
    policy = uc.ParametricPolicy(risk="direct").fit(X, -X)
    policy.compile().save(tmp_path / "step.npz")
    sent, errors = [], []
    whole = joint_state(elbow=2.0, wrist=3.0, shoulder=1.0)

    def create_node(name):
        logger = SimpleNamespace(error=lambda text, **_: errors.append(text))
        return SimpleNamespace(
            create_publisher=lambda kind, topic, depth: SimpleNamespace(publish=sent.append),
            create_subscription=lambda kind, topic, act, depth: [act(joint_state(wrist=0.0)), act(whole)],
            get_logger=lambda: logger,
        )

    for name, contents in {
        "rclpy": {"init": lambda: None, "create_node": create_node, "spin": lambda node: None},
        "sensor_msgs.msg": {"JointState": None},
        "trajectory_msgs.msg": {
            "JointTrajectory": SimpleNamespace,
            "JointTrajectoryPoint": lambda: SimpleNamespace(time_from_start=SimpleNamespace()),
        },
    }.items():
        module = ModuleType(name)
        module.__dict__.update(contents)
        monkeypatch.setitem(sys.modules, name.partition(".")[0], module)
        monkeypatch.setitem(sys.modules, name, module)
    NODE["main"](tmp_path / "step.npz", JOINTS, dt=0.1)
    assert errors == ["the joint states have no position of shoulder, elbow: they have wrist"]
    ((point,),) = [message.points for message in sent]
    np.testing.assert_allclose(point.positions, [0.9, 1.8, 2.7], atol=1e-4)
