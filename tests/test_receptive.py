"""Receptive fields are right however wide or narrow they are, and however far the states."""

import numpy as np
import pytest

from unconstrain.receptive import activations, blend, normalized_activations

X, C = np.random.default_rng(0).normal(size=(20, 3)), np.random.default_rng(1).normal(size=(5, 3))


@pytest.mark.parametrize("scale", [1e-100, 1.0, 1e100])
def test_only_the_ratio_of_distance_to_width_matters(scale):
    for f in (activations, normalized_activations):
        np.testing.assert_allclose(f(scale * X, scale * C, scale * 0.7), f(X, C, 0.7), rtol=1e-9)


@pytest.mark.parametrize("width", [5e-324, 1e-200])
def test_the_narrowest_field_is_active_at_its_centre_only(width):
    np.testing.assert_array_equal(activations(C, C, width), np.eye(5))
    np.testing.assert_array_equal(normalized_activations(C, C, width), np.eye(5))


def test_the_widest_field_is_active_everywhere():
    np.testing.assert_array_equal(activations(X, C, 1e300), np.ones((20, 5)))


def test_far_from_all_centres_the_nearest_is_left():
    np.testing.assert_allclose(normalized_activations(1e20 * X, C, 1.0).sum(axis=1), 1.0)


@pytest.mark.parametrize("distance", [1e8, 1e20, 1e150, 1e200])
def test_however_far_the_centre_in_that_direction_is_active(distance):
    b = normalized_activations(distance * X, C, 1.0)
    np.testing.assert_array_equal(np.argmax(b, axis=1), np.argmax(X @ C.T, axis=1))
    np.testing.assert_allclose(b.sum(axis=1), 1.0)


@pytest.mark.parametrize("distance", [1e3, 1e10, 1e16, 1e20])
def test_one_state_and_a_batch_agree_where_centres_tie(distance):
    ticks = np.linspace(-1, 1, 6)
    grid = np.stack(np.meshgrid(ticks, ticks, ticks), axis=-1).reshape(-1, 3)
    far = distance * np.random.default_rng(0).integers(-2, 3, size=(60, 3)) + 0.5
    one_by_one = np.concatenate([normalized_activations(x[None], grid, 0.5) for x in far])
    np.testing.assert_array_equal(normalized_activations(far, grid, 0.5), one_by_one)


def test_near_and_far_say_the_same_where_they_meet():
    direction = X[:1] / np.linalg.norm(X[0])
    near, far = (normalized_activations(d * direction, 0.1 * C, 1.0) for d in (30.2, 30.5))
    np.testing.assert_allclose(near, far, rtol=0.2)
    exact = np.exp(30.5 * direction @ (0.1 * C).T - 0.5 * np.sum((0.1 * C) ** 2, axis=1))
    np.testing.assert_allclose(far, exact / exact.sum(), rtol=1e-10)


@pytest.mark.parametrize("width", [0.7, np.array([0.4, 2.0, 1.0]), 0.02])
@pytest.mark.parametrize("far", [0.0, 300.0])
def test_a_blend_is_that_of_the_normalised_activations(width, far):
    rng = np.random.default_rng(0)
    X, centers = 1e3 + rng.uniform(-1, 1, (5000, 3)), 1e3 + rng.uniform(-1, 1, (12, 3))
    X[2500, 0] += far  # one state alone, far from all centres
    rows = rng.normal(size=(12, 2))
    expected = normalized_activations(X, centers, width) @ rows
    found = np.concatenate([(sums / total).T for _, sums, total in blend(X, centers, width, rows)])
    np.testing.assert_allclose(found, expected, rtol=0, atol=3e-13 / np.min(width) ** 2)
    assert len(list(blend(X[:0], centers, width, rows))) == 0
