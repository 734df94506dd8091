"""A robot file becomes joints, limits, poses and Jacobians, whatever its meshes."""

import sys
from importlib.metadata import distribution

import numpy as np
import pytest

pytest.importorskip("mujoco")

from unconstrain.errors import DataError, UnconstrainError
from unconstrain.robots import Robot, RobotError

FINGERS = ["panda_finger_joint1", "panda_finger_joint2"]
HAND = "panda_hand_tcp"


def example(name: str):
    """A robot file of the package example-robot-data."""
    (found,) = [file for file in distribution("example-robot-data").files or [] if file.name == name]
    return found.locate()


PANDA = Robot.load(example("panda.urdf"), lock=FINGERS)


def postures(robot: Robot, count: int = 20) -> np.ndarray:
    return np.random.default_rng(0).uniform(*robot.limits.T, (count, robot.n))


def test_panda_has_seven_joints_within_limits():
    assert PANDA.n == 7
    assert PANDA.joints[0] == "panda_joint1"
    np.testing.assert_allclose(PANDA.limits[3], [-3.0718, -0.0698])
    assert "link0.dae" in PANDA.notes[0]


@pytest.mark.parametrize(("robot", "frame"), [(PANDA, HAND), (PANDA, "panda_link4")])
def test_jacobian_is_the_derivative_of_the_pose(robot, frame):
    Q, h = postures(robot), 1e-6
    J = robot.jacobian(Q, frame)
    _, turn = robot.pose(Q, frame)
    for j, step in enumerate(h * np.eye(robot.n)):
        (ahead, turned), (behind, back) = robot.pose(Q + step, frame), robot.pose(Q - step, frame)
        np.testing.assert_allclose(J[:, :3, j], (ahead - behind) / (2 * h), atol=1e-8)
        spin = (turned - back) / (2 * h) @ turn.swapaxes(1, 2)
        np.testing.assert_allclose(
            J[:, 3:, j], np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1), atol=1e-8
        )


def test_locking_a_joint_is_keeping_it_still():
    held = {
        "panda_joint2": 0.3,
        "panda_joint4": -1.1,
        "panda_finger_joint1": 0.02,
        "panda_finger_joint2": 0.0,
    }
    robot, whole = Robot.load(example("panda.urdf"), lock=held), Robot.load(example("panda.urdf"))
    Q = postures(robot)
    all_joints = np.empty((len(Q), whole.n))
    for j, name in enumerate(whole.joints):
        all_joints[:, j] = held[name] if name in held else Q[:, robot.joints.index(name)]
    for frame in (HAND, "panda_leftfinger"):
        for mine, theirs in zip(robot.pose(Q, frame), whole.pose(all_joints, frame), strict=True):
            np.testing.assert_allclose(mine, theirs, atol=1e-12)


def test_a_humanoid_with_its_pelvis_held():
    robot = Robot.load(example("g1_29dof_rev_1_0.urdf"))
    assert robot.n == 29
    assert robot.model.nmesh > 0
    assert {"left_rubber_hand", "right_rubber_hand"} <= set(robot.frames)


MJCF = """<mujoco><worldbody><body name="base">{root}<geom size=".1"/>
<body name="arm"><joint name="a"/><geom size=".1"/><site name="tip" pos="1 0 0"/></body></body></worldbody></mujoco>"""


def test_mjcf_with_a_site(tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(MJCF.format(root=""))
    robot = Robot.load(path)
    np.testing.assert_array_equal(robot.limits, [[-np.inf, np.inf]])
    np.testing.assert_allclose(robot.pose([[np.pi / 2]], "tip")[0], [[0, 1, 0]], atol=1e-15)
    np.testing.assert_allclose(robot.jacobian([[0.0]], "tip")[0, :, 0], [0, 1, 0, 0, 0, 1], atol=1e-15)


def test_a_floating_base_is_fixed_by_locking_it(tmp_path):
    path = tmp_path / "floats.xml"
    path.write_text(MJCF.format(root='<freejoint name="root"/>'))
    with pytest.raises(RobotError, match='lock it, lock=\\["root"\\]'):
        Robot.load(path)
    assert Robot.load(path, lock="root").joints == ("a",)


def test_mesh_paths_without_a_package_and_damaged_meshes(tmp_path):
    (tmp_path / "bad.stl").write_bytes(b"no mesh")
    urdf = """<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/>
      <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
      <visual><geometry><mesh filename="{mesh}"/></geometry></visual></link>
      <joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>"""
    path = tmp_path / "r.urdf"
    for mesh, note in [("bad.stl", "left out visual shapes"), ("package://p/none.stl", "left out meshes")]:
        path.write_text(urdf.format(mesh=mesh))
        robot = Robot.load(path, package_dirs=[tmp_path])
        assert robot.n == 1
        assert robot.notes[0].startswith(note)


def files(folder):
    (folder / "text.xml").write_text("joints: 7")
    (folder / "scene.xml").write_text("<scene/>")
    (folder / "broken.xml").write_text("<mujoco><nonsense/></mujoco>")
    (folder / "still.xml").write_text("<mujoco/>")
    return folder


@pytest.mark.parametrize(
    ("kind", "call", "sentence"),
    [
        (RobotError, lambda d: Robot.load(d / "none.urdf"), "there is no robot file"),
        (RobotError, lambda d: Robot.load(d), "there is no robot file"),
        (RobotError, lambda d: Robot.load(d / "text.xml"), "text.xml is not an XML file"),
        (RobotError, lambda d: Robot.load(d / "scene.xml"), "neither an MJCF nor a URDF"),
        (RobotError, lambda d: Robot.load(d / "broken.xml"), "MuJoCo cannot read broken.xml"),
        (RobotError, lambda d: Robot.load(d / "still.xml"), "no joint that moves"),
        (RobotError, lambda d: PANDA.pose(postures(PANDA), "elbow"), "no frame 'elbow': it has world"),
        (RobotError, lambda d: Robot(PANDA.spec, lock=["wrist"]), "no joint 'wrist' to lock"),
        (RobotError, lambda d: Robot(PANDA.spec, lock={"panda_joint1": np.nan}), "a finite position only"),
        (DataError, lambda d: PANDA.pose([[0.0] * 3], HAND), "has 7 joints"),
        (DataError, lambda d: PANDA.jacobian([[np.nan] * 7], HAND), "NaN or infinity"),
    ],
)
def test_mistakes_are_told_in_a_sentence(tmp_path, kind, call, sentence):
    with pytest.raises(kind, match=sentence) as told:
        call(files(tmp_path))
    assert "\n" not in str(told.value)


def test_without_mujoco_a_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(UnconstrainError, match=r"pip install 'unconstrain\[sim\]'"):
        Robot.load(example("panda.urdf"))
