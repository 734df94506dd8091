"""A robot in viser's scene: its shapes are those of the model, where MuJoCo says they are."""

import importlib.metadata
from pathlib import Path

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.robots import Robot

mujoco = pytest.importorskip("mujoco")
pytest.importorskip("viser")

from unconstrain.viewer import RobotScene, server  # noqa: E402
from unconstrain.viewer.shapes import collect_shapes  # noqa: E402

ARM = """
<mujoco>
  <asset>
    <material name="red" rgba="0.8 0.1 0.1 0.5"/>
    <mesh name="wedge" vertex="0 0 0  1 0 0  0 1 0  0 0 1"/>
  </asset>
  <worldbody>
    <geom name="table" type="box" size="0.4 0.3 0.01" rgba="0.7 0.6 0.4 1"/>
    <body name="upper" pos="0 0 0.2">
      <joint name="shoulder" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 0 0 0.5" size="0.05" material="red"/>
      <geom type="box" size="0.2 0.2 0.2" group="3" rgba="0 1 0 1"/>
      <body name="fore" pos="0 0 0.5">
        <joint name="elbow" axis="0 1 0"/>
        <geom type="mesh" mesh="wedge" rgba="0 0 1 1" contype="0" conaffinity="0" group="1"/>
        <geom type="sphere" size="0.3"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture
def served():
    started = server.start(port=0)
    yield started
    started.stop()


def test_shapes_have_the_colours_and_places_of_the_geoms():
    model = mujoco.MjModel.from_xml_string(ARM)
    shapes, notes = collect_shapes(model)
    assert notes == ()
    assert {body: len(parts) for body, parts in shapes.items()} == {0: 1, 1: 1, 2: 1}
    (capsule,), (wedge,) = shapes[1], shapes[2]
    np.testing.assert_allclose(capsule.rgba, (0.8, 0.1, 0.1, 0.5), atol=1e-6)
    np.testing.assert_allclose(capsule.vertices.min(axis=0), [-0.05, -0.05, -0.05], atol=2e-3)
    np.testing.assert_allclose(capsule.vertices.max(axis=0), [0.05, 0.05, 0.55], atol=2e-3)
    # MuJoCo moves meshes to their centre of mass; in the body's frame they are where the file has them.
    corners = np.array([[0, 0, 0], [0, 0, 1], [0, 1, 0], [1, 0, 0]])
    np.testing.assert_allclose(np.unique(wedge.vertices.round(5), axis=0), corners, atol=1e-5)
    assert collect_shapes(model, ("table",))[0].keys() == {1, 2}


def test_bodies_are_where_mujoco_has_them_and_only_those_that_moved_are_sent(served, monkeypatch):
    model = mujoco.MjModel.from_xml_string(ARM)
    scene, data = RobotScene(served, model), mujoco.MjData(model)
    data.qpos = [0.3, -1.0]
    scene.show(data.qpos)
    mujoco.mj_kinematics(model, data)
    for body, node in scene.bodies.items():
        np.testing.assert_allclose(node.position, data.xpos[body], atol=1e-12)
        np.testing.assert_allclose(node.wxyz, data.xquat[body], atol=1e-12)
    sent = []
    monkeypatch.setattr(
        type(scene.bodies[2]), "position", property(fset=lambda self, _: sent.append(self.name))
    )
    scene.show([0.3, -0.9])
    assert sent == ["/robot/2"]
    with pytest.raises(uc.errors.DataError, match="2 finite numbers"):
        scene.show([0.0, np.nan])


def test_a_real_arm_by_urdf(served, monkeypatch):
    files = importlib.metadata.files("example-robot-data") or []
    found = [file for file in files if file.name == "panda.urdf"]
    if not found:
        pytest.skip("example-robot-data has no Panda")
    robot = Robot.load(Path(str(found[0].locate())), lock=["panda_finger_joint1", "panda_finger_joint2"])
    model, arrived, add = robot.model, {}, served.scene.add_mesh_simple

    def record(name, vertices, faces, **style):
        arrived[name] = vertices
        return add(name, vertices, faces, **style)

    monkeypatch.setattr(served.scene, "add_mesh_simple", record)
    scene = RobotScene(served, model)
    q = np.array([0.3, 0.4, 0.0, -1.8, 0.0, 2.2, 0.8])
    scene.show(q)
    hand = robot.model.body("panda_hand").id
    np.testing.assert_allclose(
        scene.bodies[hand].position, robot.pose(q[None], "panda_hand")[0][0], atol=1e-9
    )
    meshes = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_MESH)
    assert len(meshes) == 9
    for geom in meshes:
        mesh, turn = int(model.geom_dataid[geom]), np.zeros(9)
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
        expected = model.mesh_vert[first : first + count] @ turn.reshape(3, 3).T + model.geom_pos[geom]
        drawn = arrived[f"/robot/{model.geom_bodyid[geom]}/0"]
        # Vertices on sharp edges are there once for each side.
        np.testing.assert_array_equal(np.unique(drawn.round(5), axis=0), np.unique(expected.round(5), axis=0))


def test_in_uc_view_the_robot_follows_the_time_line():
    robot = Robot(mujoco.MjSpec.from_string(ARM))
    t = np.linspace(0, 2, 41)
    X = np.stack([np.sin(t), 0.5 * np.cos(t)], axis=1)
    U = np.stack([np.cos(t), -0.5 * np.sin(t)], axis=1)
    demos = uc.Demonstrations(X, U, time=t, state_names=robot.joints)
    policy = uc.ParametricPolicy(uc.NormalizedRBF(n_centers=9), risk="direct").fit(demos)
    page = uc.view(policy, demos, robot=robot, site="fore", port=0)
    try:
        assert page.settle()
        page.timeline.go_to(1.0)
        movement = page.stage.movement
        state = movement.states[[np.searchsorted(movement.time, 1.0 - 1e-9)]]
        fore = page.stage.server.scene._handle_from_node_name["/robot/2"]
        np.testing.assert_allclose(fore.position, robot.pose(state, "fore")[0][0], atol=1e-6)
    finally:
        page.close()
