"""The arm moves as its Denavit–Hartenberg figures say, under constraints on its hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from reproduction.plants import arm
from unconstrain.errors import DataError, UnconstrainError
from unconstrain.robots import TaskConstraint

postures = arrays(np.float64, (3, 7), elements=st.floats(-2.0, 2.0))


def test_stretched_out_the_arm_points_up():
    place, turn = arm.pose(np.zeros((1, 7)))
    np.testing.assert_array_equal(turn[0], np.eye(3))
    np.testing.assert_allclose(place[0], [0, 0, 0.31 + 0.4 + 0.39 + 0.078])


@settings(max_examples=20, deadline=None)
@given(postures)
def test_jacobian_is_the_derivative_of_the_pose(Q):
    J, (_, turn), h = arm.jacobian(Q), arm.pose(Q), 1e-6
    for j, step in enumerate(h * np.eye(7)):
        (ahead, turned), (behind, back) = arm.pose(Q + step), arm.pose(Q - step)
        np.testing.assert_allclose(J[:, :3, j], (ahead - behind) / (2 * h), atol=1e-9)
        spin = (turned - back) / (2 * h) @ turn.swapaxes(1, 2)
        omega = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
        np.testing.assert_allclose(J[:, 3:, j], omega, atol=1e-9)


def test_mujoco_sees_the_same_arm():
    pytest.importorskip("mujoco")
    robot, Q = arm.load_robot(), np.vstack([np.zeros(7), arm.draw_starts(50, 1)])
    np.testing.assert_allclose(robot.limits, arm.LIMITS[:, None] * [-1, 1])
    np.testing.assert_allclose(robot.jacobian(Q, arm.HAND), arm.jacobian(Q), atol=1e-13)
    for theirs, ours in zip(robot.pose(Q, arm.HAND), arm.pose(Q), strict=True):
        np.testing.assert_allclose(theirs, ours, atol=1e-13)


@pytest.mark.parametrize(("p", "x", "slope"), [(2.0, 0.5, -0.05), (1.5, 0.25, -0.0375), (1.5, -1.0, 0.075)])
def test_the_policy_is_the_gradient_of_the_paper(p, x, slope):
    np.testing.assert_allclose(arm.PowerPolicy(p)(np.full((1, 7), x)), slope)


@settings(max_examples=10, deadline=None)
@given(postures, st.sampled_from(["1-2-3", "4-5-6", "1-3-5", "2-4-6", "1,2,3"]))
def test_projections_block_the_rows_and_nothing_else(Q, text):
    constraint, J = TaskConstraint.parse(text), arm.jacobian(Q)
    N = constraint.projections(J)
    np.testing.assert_allclose(constraint.rows(J) @ N, 0, atol=1e-8)
    np.testing.assert_allclose(N @ N, N, atol=1e-10)
    np.testing.assert_allclose(N, N.swapaxes(1, 2), atol=1e-12)


def test_projections_in_a_singular_posture():
    J = arm.jacobian(np.zeros((1, 7)))
    N = TaskConstraint.parse("1-2-3").projections(J)
    assert np.trace(N[0]) == pytest.approx(7 - 1), "stretched out, the hand can move along x only"


def test_demonstrations_move_as_the_projected_policy_says():
    demos = arm.demonstrate("1-3-5", arm.PowerPolicy(1.8), n_episodes=5, length=30, random_state=0)
    assert len(demos) == 150
    N, J = demos.projections, arm.jacobian(demos.states)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", N, demos.policy), demos.actions, atol=1e-15)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", J, demos.actions)[:, [0, 2, 4]], 0, atol=1e-12)
    first = demos.states.reshape(5, 30, 7)
    np.testing.assert_allclose(np.diff(first, axis=1), demos.actions.reshape(5, 30, 7)[:, :-1], atol=1e-14)
    assert np.all(np.abs(first[:, 0]) <= arm.LIMITS / 2)


def test_the_hand_stays_where_it_is_under_123():
    demos = arm.demonstrate("1-2-3", n_episodes=3, length=100, step=0.02, random_state=0)
    place = arm.pose(demos.states)[0].reshape(3, 100, 3)
    assert np.abs(place - place[:, :1]).max() < 1e-4


def test_the_same_seed_gives_the_same_movements():
    one, two, other = (
        arm.demonstrate(n_episodes=2, length=5, random_state=seed).states for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(one, two)
    assert np.any(one != other)


@pytest.mark.parametrize(
    ("kind", "call", "sentence"),
    [
        (DataError, lambda: arm.pose([[0.0] * 6]), "has 7 joints"),
        (DataError, lambda: arm.jacobian([[np.inf] * 7]), "NaN or infinity"),
        (UnconstrainError, lambda: arm.PowerPolicy(1.0), "a power above 1"),
        (UnconstrainError, lambda: arm.demonstrate(length=0), "at least one episode and sample"),
        (UnconstrainError, lambda: arm.demonstrate(n_episodes=10**10), "would take"),
    ],
)
def test_mistakes_are_told_in_a_sentence(kind, call, sentence):
    with pytest.raises(kind, match=sentence) as told:
        call()
    assert "\n" not in str(told.value)
