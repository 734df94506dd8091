"""Projections from where obstacles are."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import unconstrain as uc
from unconstrain import constraints
from unconstrain.errors import UnconstrainError


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), m=st.integers(1, 4), within=st.floats(0, 2))
def test_a_sample_is_free_exactly_where_no_point_of_an_obstacle_is_near(seed, m, within):
    rng = np.random.default_rng(seed)
    X, centres = rng.normal(size=(40, m)), rng.normal(size=(2, m))
    sides, radius = rng.uniform(0, 2, m), rng.uniform(0, 1)
    # The nearest point of each: the position clipped to the box, or on the way to the sphere's centre.
    in_box = np.clip(X, centres[0] - sides / 2, centres[0] + sides / 2)
    away = X - centres[1]
    length = np.linalg.norm(away, axis=1, keepdims=True)
    in_sphere = centres[1] + away * np.minimum(1.0, radius / length)
    nearest = np.minimum(*(np.linalg.norm(X - point, axis=1) for point in (in_box, in_sphere)))
    obstacles = [(centres[0], sides), (centres[1], radius)]
    np.testing.assert_allclose(constraints.obstacle_distances(X, obstacles), nearest, atol=1e-12)
    N = constraints.from_obstacles(X, obstacles, within, d=2)
    sure = np.abs(nearest - within) > 1e-9
    np.testing.assert_array_equal(np.isfinite(N).all(axis=(1, 2))[sure], (nearest > within)[sure])
    np.testing.assert_array_equal(N[np.isfinite(N[:, 0, 0])] - np.eye(2), 0.0)


def test_what_a_box_bends_is_not_learnt():
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, size=(600, 2))
    policy, U = np.tile([1.0, 0.0], (600, 1)), np.tile([1.0, 0.0], (600, 1))
    bent = constraints.obstacle_distances(X, [([0.0, 0.0], [0.4, 0.4])]) <= 0.2
    U[bent] = [0.5, 0.5]  # N π of N = ûûᵀ: it goes round the box
    N = constraints.from_obstacles(X, [([0.0, 0.0], [0.4, 0.4])], 0.2)
    known = uc.ParametricPolicy(risk="inconsistency").fit(X, U, projections=N)
    direct = uc.ParametricPolicy(risk="direct").fit(X, U)
    off = [np.abs(each.predict(X) - policy).max() for each in (known, direct)]
    assert off[0] < 1e-6
    assert off[1] > 0.05


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (([[0.0, 0.0]], [], 1.0), "there are no obstacles"),
        (([[0.0, 0.0]], [([0.0], [1.0])], 1.0), "obstacle 0 must have a centre of 2 numbers"),
        (([[0.0, 0.0]], [([0.0, 0.0], [1.0, -1.0])], 1.0), "size of obstacle 0 must be lengths"),
        (([0.0, 0.0], [([0.0], 1.0)], 1.0), "a row a sample"),
        (([[0.0]], [([0.0], 1.0)], -1.0), "within"),
    ],
)
def test_mistakes(arguments, sentence):
    with pytest.raises(UnconstrainError, match=sentence):
        constraints.from_obstacles(*arguments)
