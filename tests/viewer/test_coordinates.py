"""What is shown of states, and the way back."""

from importlib.metadata import PackageNotFoundError, distribution

import numpy as np
import pytest

from unconstrain.errors import DataError
from unconstrain.spaces import Angle, Numbers, Phased, Product, Rotation, SecondOrder
from unconstrain.viewer.coordinates import Axes, Picked, finite_differences

SPACES = {
    "numbers": Numbers(4),
    "angles": Product.of(Angle(), Numbers(1), Angle(360.0)),
    "pose": Product.of(Numbers(3), Rotation("wxyz")),
    "phased": Phased(Numbers(3), 2.0),
    "with velocities": SecondOrder(Numbers(3)),
}


def states(space, count=5):
    steps = 0.4 * np.random.default_rng(0).normal(size=(count, space.n_actions))
    X = np.repeat(space.origin[None], count, axis=0)
    return space.step(space.step(X, steps, 1.0), steps[::-1], 1.0)


@pytest.mark.parametrize("name", SPACES)
def test_a_state_put_to_a_place_is_shown_there(name):
    space = SPACES[name]
    X = states(space)
    axes = Axes(space, [f"x{i}" for i in range(space.n_states)], X[0])
    assert len(axes.names) == space.n_actions
    seen = Picked(axes, [0, 2])
    here, there = seen.place(X), seen.place(X)[::-1]
    for x, place, own in zip(X, there, here, strict=True):
        moved = seen.put(x, place)
        np.testing.assert_allclose(seen.place(moved[None])[0], place, atol=1e-9)
        np.testing.assert_allclose(seen.place(seen.put(moved, own)[None])[0], own, atol=1e-9)
        np.testing.assert_allclose(axes.values(moved[None])[0, 1], axes.values(x[None])[0, 1], atol=1e-9)
    if not isinstance(space, SecondOrder):
        np.testing.assert_allclose(seen.tangents(X), finite_differences(seen, space, X), atol=1e-6)


def test_what_cannot_be_picked_is_told():
    axes = Axes(Numbers(3), ["x", "y", "z"], np.zeros(3))
    for which in ([], [0, 0], [3], [0, 1, 2, 3]):
        with pytest.raises(DataError, match="two or three different ones of x, y, z"):
            Picked(axes, which)


@pytest.fixture(scope="module")
def robot():
    pytest.importorskip("mujoco")
    from unconstrain.robots import Robot

    try:
        files = distribution("example-robot-data").files or []
    except PackageNotFoundError:
        pytest.skip("example-robot-data is not installed")
    (found,) = [file for file in files if file.name == "panda.urdf"]
    return Robot.load(found.locate(), lock=["panda_finger_joint1", "panda_finger_joint2"])


def test_a_hand_is_where_the_robot_says_and_goes_where_it_is_dragged(robot):
    from unconstrain.viewer.hand import Hand

    names = robot.joints[::-1]
    hand = Hand(robot, "panda_hand_tcp", Numbers(7), names)
    q = np.array([0.1, -0.3, 0.2, -2.2, 0.1, 2.0, 0.8])
    x = q[::-1].copy()
    np.testing.assert_allclose(hand.place(x[None]), robot.pose(q[None], "panda_hand_tcp")[0], atol=1e-12)
    np.testing.assert_allclose(hand.tangents(x[None]), hand.tangents(np.stack([x, x]))[:1], atol=1e-12)
    np.testing.assert_allclose(
        hand.tangents(x[None]), finite_differences(hand, Numbers(7), x[None]), atol=1e-5
    )
    goal = hand.place(x[None])[0] + [0.05, -0.08, 0.04]
    np.testing.assert_allclose(hand.place(hand.put(x, goal)[None])[0], goal, atol=2e-3)
    with pytest.raises(DataError, match="the robot has 7 joints"):
        Hand(robot, "panda_hand_tcp", Numbers(3), ["x", "y", "z"])
