"""A barrier takes away motion into it and nothing else."""

import numpy as np
import pytest

from unconstrain.spaces import Numbers
from unconstrain.viewer.barriers import Box, InTheWay, Plane
from unconstrain.viewer.coordinates import Axes, Picked
from unconstrain.viewer.following import Follower, Wanted, is_held
from unconstrain.viewer.frame import Frame

WALL = Plane(np.zeros(3), np.array([1.0, 0.0, 0.0]))
CUBE = Box(np.zeros(3), np.full(3, 2.0))


@pytest.mark.parametrize(
    ("barrier", "point", "step", "normal"),
    [
        (WALL, [0.1, 0, 0], [-0.2, 1, 0], [1, 0, 0]),
        (WALL, [0.1, 0, 0], [-0.05, 1, 0], [0, 0, 0]),  # which ends before it
        (WALL, [0.1, 0, 0], [0.2, 1, 0], [0, 0, 0]),
        (WALL, [-0.1, 0, 0], [-0.1, 0, 0], [1, 0, 0]),  # behind it, deeper
        (WALL, [-0.1, 0, 0], [0.05, 0, 0], [0, 0, 0]),  # behind it, outwards
        (CUBE, [1.1, 0, 0], [-0.2, 0.3, 0], [1, 0, 0]),
        (CUBE, [1.1, 0, 0], [-5, 0, 0], [1, 0, 0]),  # right through it
        (CUBE, [1.1, 1.5, 0], [-0.2, -0.1, 0], [0, 0, 0]),  # past its edge
        (CUBE, [1.1, 1.2, 0], [-0.4, -0.4, 0], [0, 1, 0]),  # by the face it would pass last
        (CUBE, [1.0, 0, 0], [0, 1, 0], [0, 0, 0]),  # along its face
        (CUBE, [0.9, 0, 0], [-0.1, 0, 0], [1, 0, 0]),
        (CUBE, [0.9, 0, 0], [0.1, 0, 0], [0, 0, 0]),
    ],
)
def test_what_leads_into_it_is_told_by_its_normal(barrier, point, step, normal):
    found = barrier.normals(np.array([point], dtype=float), np.array([step], dtype=float))
    np.testing.assert_array_equal(found[0], normal)


def test_nothing_gets_in_whatever_is_in_the_way():
    rng = np.random.default_rng(0)
    axes = Axes(Numbers(3), ["x", "y", "z"], np.zeros(3))
    frame = Frame(np.array([0.1, 0.2, 0.3]), 2.0, -np.ones(3), np.ones(3))
    among = InTheWay([WALL, CUBE], Picked(axes, [2, 0, 1]), frame, 0.1)
    X, U = rng.normal(size=(500, 3)), 5.0 * rng.normal(size=(500, 3))
    P = among.frame.to_scene(among.coordinates.place(X))
    outside = (P[:, 0] > 0) & (np.abs(P) > 1).any(axis=1)
    N = among.projections(X[outside], U[outside])
    left = np.einsum("nij,nj->ni", N, U[outside])
    Q = among.frame.to_scene(among.coordinates.place(X[outside] + 0.1 * left))
    assert Q[:, 0].min() >= -1e-12
    assert np.abs(Q).max(axis=1).min() >= 1 - 1e-12
    free = (np.eye(3) == N).all(axis=(1, 2))
    assert 0.2 < free.mean() < 0.9
    np.testing.assert_array_equal(left[free], U[outside][free])


def test_a_rollout_slides_along_a_plane_and_is_the_policys_elsewhere(policy):
    axes = Axes(policy.space_, ["x", "y"], np.zeros(2))
    frame = Frame(np.zeros(2), 1.0, -np.ones(2), np.ones(2))
    follower, seen = Follower(policy), Picked(axes, [0, 1])
    start = np.array([0.7, 0.3])
    free = follower.follow(Wanted(start, 200, 0.01), seen, frame)
    expected = policy.rollout(start, steps=200, dt=0.01)
    np.testing.assert_allclose(free.states, expected.states, atol=1e-9)
    assert follower.is_compiled
    assert free.states[:, 1].min() < -0.3
    floor = Plane(np.array([0.0, -0.2, 0.0]), np.array([0.0, 1.0, 0.0]))
    held = follower.follow(Wanted(start, 200, 0.01, [floor]), seen, frame)
    touching = is_held(held)
    assert held.states[:, 1].min() >= -0.2
    assert 0.1 < touching.mean() < 0.9
    first = int(touching.argmax())
    np.testing.assert_allclose(held.states[:first], free.states[:first])
    np.testing.assert_allclose(held.actions[touching, 0], held.policy[touching, 0])
    assert not held.actions[touching, 1].any()
