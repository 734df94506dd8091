"""The humanoid, what stands in its hands' way, and its whole-body control."""

import importlib.metadata
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import unconstrain as uc
from reproduction.plants import barrier
from reproduction.plants.barrier import CLEARANCE, Barrier, Wall, find_blocking
from reproduction.plants.humanoid import Humanoid
from reproduction.plants.whole_body import WholeBody

pytest.importorskip("mujoco")
pytest.importorskip("mink")

points = arrays(np.float64, (4, 3), elements=st.floats(-2, 2))


@pytest.fixture(scope="module")
def humanoid():
    return Humanoid.load()


def g1() -> Path:
    files = importlib.metadata.files("example-robot-data") or []
    found = [file for file in files if file.name == "g1_29dof_rev_1_0.urdf"]
    return Path(str(found[0].locate())) if found else pytest.skip("example-robot-data has no G1")


def test_our_own_robot_has_27_joints_two_hands_and_plausible_proportions(humanoid):
    assert humanoid.n == 27
    assert np.isfinite(humanoid.robot.limits).all()
    assert humanoid.floor == pytest.approx(0.0, abs=1e-3)
    (left, right), _ = (each[0] for each in humanoid.hand_motion(humanoid.home[None]))
    np.testing.assert_allclose(left * [1, -1, 1], right, atol=1e-12)
    model = humanoid.robot.model
    assert 1.2 < humanoid.robot.pose(humanoid.home[None], "torso")[0][0, 2] + 0.6 < 1.4
    assert 25 < model.body_mass.sum() < 60
    for posture in (humanoid.home, humanoid.outstretched):
        assert ((humanoid.robot.limits[:, 0] <= posture) & (posture <= humanoid.robot.limits[:, 1])).all()
        assert not humanoid.touches_itself(posture)


def test_hands_and_jacobians_are_those_of_the_robot_and_of_differences(humanoid):
    Q = humanoid.draw_postures(3, np.random.default_rng(0))
    X, J = humanoid.hand_motion(Q)
    for hand, frame in enumerate(humanoid.hands):
        np.testing.assert_allclose(X[:, hand], humanoid.robot.pose(Q, frame)[0], atol=1e-12)
        np.testing.assert_allclose(J[:, hand], humanoid.robot.jacobian(Q, frame)[:, :3], atol=1e-12)
    step = 1e-6 * np.eye(humanoid.n)
    ahead, _ = humanoid.hand_motion(Q[0] + step)
    behind, _ = humanoid.hand_motion(Q[0] - step)
    np.testing.assert_allclose(np.moveaxis(ahead - behind, 0, -1) / 2e-6, J[0], atol=1e-8)


def test_draw_postures_are_within_limits_free_of_contact_and_as_spread_as_asked(humanoid):
    Q = humanoid.draw_postures(200, np.random.default_rng(1))
    assert ((humanoid.robot.limits[:, 0] <= Q) & (humanoid.robot.limits[:, 1] >= Q)).all()
    assert not any(humanoid.touches_itself(q) for q in Q[:20])
    waist = humanoid.robot.joints.index("waist_yaw")
    assert Q[:, waist].std() == pytest.approx(np.sqrt(0.1), rel=0.2)
    crossed = humanoid.home.copy()
    for side, sign in (("left", -1), ("right", 1)):
        crossed[humanoid.robot.joints.index(f"{side}_shoulder_yaw")] = 1.4 * sign
        crossed[humanoid.robot.joints.index(f"{side}_shoulder_pitch")] = 0.0
    assert humanoid.touches_itself(crossed)


@given(points, arrays(np.float64, (4, 2, 3, 2), elements=st.floats(-1, 1)))
@settings(deadline=None, max_examples=60)
def test_moving_along_a_boxs_normal_leaves_it_at_the_rate_of_one(x, corners):
    low, high = corners.min(axis=-1), corners.max(axis=-1)
    box = Barrier(low, high)
    distance, normal = box.nearest(x)
    solid = np.isfinite(distance)
    assert (solid == np.all(high > low, axis=-1)).all()
    np.testing.assert_allclose(np.linalg.norm(normal[solid], axis=-1), 1.0)
    for k in range(2):
        further, _ = box.nearest(x + 0.01 * normal[:, k])
        outside = solid[:, k] & (distance[:, k] > 0)
        np.testing.assert_allclose(further[outside, k], distance[outside, k] + 0.01, atol=1e-9)


def test_a_hand_is_blocked_only_when_near_and_led_nearer():
    wall = Wall(np.zeros((1, 3)), np.array([[-1.0, 0.0, 0.0]]))
    hands = np.array([[[-0.5 * CLEARANCE, 0.2, 0.0], [-2 * CLEARANCE, -0.2, 0.0]]])
    towards, away = np.ones((1, 2, 3)), -np.ones((1, 2, 3))
    rows, blocked = find_blocking(wall, hands, towards)
    assert blocked.tolist() == [[True, False]]
    np.testing.assert_allclose(rows[0, 0, 0], [-1, 0, 0])
    assert not find_blocking(wall, hands, away)[1].any()


@pytest.mark.parametrize(("width", "open_at"), [(0.25, 0.0), (-0.1, None), (0.0, None)])
def test_the_gap_is_where_it_should_be(width, open_at):
    made = barrier.make_with_gap([width], 0.3, 0.6, thickness=0.02, span=0.9, height=0.3)
    y = np.linspace(-0.4, 0.4, 81)
    distance, _ = barrier.make_with_gap(
        np.full(81, width), 0.3, 0.6, thickness=0.02, span=0.9, height=0.3
    ).nearest(np.stack([np.full(81, 0.3), y, np.full(81, 0.7)], axis=1))
    free = distance.min(axis=1) > 0
    np.testing.assert_array_equal(free, np.abs(y) < max(width, 0) / 2 - 1e-12)
    assert made.low.shape == (1, 2, 3)
    assert free.any() == (open_at is not None)


def test_the_whole_body_carries_the_hands_and_keeps_its_feet(humanoid):
    body = WholeBody(humanoid)
    body.stand(humanoid.draw_postures(1, np.random.default_rng(3))[0])
    feet = [body.data.body(foot).xpos.copy() for foot in humanoid.feet]
    start, v = body.hands, np.array([[0.1, 0.02, 0.05], [0.1, -0.02, 0.03]])
    for _ in range(50):
        np.testing.assert_allclose(body.move(v, 0.02), v, atol=2e-3)
    np.testing.assert_allclose(body.hands - start, v, atol=2e-3)
    for foot, place in zip(humanoid.feet, feet, strict=True):
        np.testing.assert_allclose(body.data.body(foot).xpos, place, atol=1e-5)
    limits = humanoid.robot.limits
    assert ((limits[:, 0] - 1e-6 <= body.posture) & (body.posture <= limits[:, 1] + 1e-6)).all()


def test_a_robot_of_the_users_own_with_joints_locked_and_hands_named():
    robot = Humanoid.load(
        g1(), lock="waist_roll_joint, waist_pitch_joint", hands="left_rubber_hand,right_rubber_hand"
    )
    assert robot.n == 27
    assert robot.feet is None
    (home, out), _ = robot.hand_motion(np.stack([robot.home, robot.outstretched]))
    assert (out[:, 0] > home[:, 0] + 0.1).all()


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"hands": "left_hand"}, "two hands and 1 are named"),
        ({"hands": "left_hand,no_hand"}, "no frame 'no_hand'"),
        ({"lock": "no_joint"}, "no joint 'no_joint'"),
        ({"path": "missing.xml", "hands": "a,b"}, "no robot file"),
        ({"feet": "left_foot"}, "two feet and 1 are named"),
    ],
)
def test_mistakes_are_told_in_one_sentence(options, sentence):
    with pytest.raises(uc.errors.UnconstrainError, match=sentence) as error:
        Humanoid.load(**options)
    assert "\n" not in str(error.value)
