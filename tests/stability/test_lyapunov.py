"""The Lyapunov function itself: one critical point, a right gradient, and steps over which it falls."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from unconstrain.stability import Lyapunov, learn_lyapunov

seeds = st.integers(0, 2**32 - 1)


def random_lyapunov(rng, d, n_terms=3):
    roots = rng.normal(size=(n_terms + 1, d, d))
    matrices = roots @ roots.transpose(0, 2, 1)
    matrices[0] += 0.05 * np.eye(d)
    return Lyapunov(matrices, rng.normal(size=(n_terms, d)))


@settings(max_examples=50)
@given(seed=seeds, d=st.integers(1, 5))
def test_it_rises_along_every_ray_so_the_goal_is_its_only_critical_point(seed, d):
    rng = np.random.default_rng(seed)
    V = random_lyapunov(rng, d)
    E = rng.normal(size=(50, d)) * 10.0 ** rng.uniform(-6, 3, size=(50, 1))
    along = np.sum(E * V.gradient(E), axis=1)
    assert np.all(V.value(E) > 0)
    assert np.all(along >= 2 * V.value(E) * (1 - 1e-9))
    assert V.value(np.zeros((1, d))) == 0
    assert not V.gradient(np.zeros((1, d))).any()


@settings(max_examples=30)
@given(seed=seeds, d=st.integers(1, 4))
def test_the_gradient_is_that_of_the_value(seed, d):
    rng = np.random.default_rng(seed)
    V = random_lyapunov(rng, d)
    E, h = 2 * rng.normal(size=(20, d)), 1e-6
    slopes = [(V.value(E + h * row) - V.value(E - h * row)) / (2 * h) for row in np.eye(d)]
    assert np.allclose(np.transpose(slopes), V.gradient(E), rtol=1e-5, atol=1e-5)


@settings(max_examples=50)
@given(seed=seeds, d=st.integers(1, 4), size=st.floats(-3, 2))
def test_it_falls_over_the_share_of_a_step_that_is_allowed_and_over_parts_of_it(seed, d, size):
    rng = np.random.default_rng(seed)
    V = random_lyapunov(rng, d)
    E = rng.normal(size=(50, d)) * 10.0 ** rng.uniform(-2, 1, size=(50, 1))
    W = rng.normal(size=(50, d)) * 10.0**size
    W *= -np.sign(np.sum(V.gradient(E) * W, axis=1))[:, None]  # downhill
    near = V.near(E)
    share = V.longest_share(near, W / near.unit[:, None])[:, None]
    slope = np.sum(V.gradient(E) * W, axis=1)
    for part in (0.1, 0.5, 1.0):
        promised = 0.5 * part * share[:, 0] * slope
        assert np.all(V.value(E + part * share * W) - V.value(E) <= promised + 1e-9 * V.value(E))


def test_nothing_overflows_far_away():
    V = random_lyapunov(np.random.default_rng(0), 3)
    gradient = V.near(np.full((1, 3), 1e140)).gradient
    assert np.isfinite(gradient).all()
    assert gradient.any()


def test_it_learns_a_movement_that_first_leads_away_from_the_goal():
    """No quadratic falls along half a turn about the goal that goes out and comes back."""
    angle = np.linspace(np.pi, 0.3, 400)
    E = np.stack([2 + 2 * np.cos(angle), 1.5 * np.sin(angle)], axis=1)[::-1]
    U = np.gradient(E, 0.01, axis=0)
    E, U = E[:-1], U[:-1]
    changes = {}
    for n_terms in (0, 3):
        V = learn_lyapunov(E, U, np.zeros_like(E), ((2, True),), n_terms=n_terms)
        g = V.gradient(E)
        rises = np.maximum(0.0, np.sum(g * U, axis=1) / np.linalg.norm(g, axis=1))
        changes[n_terms] = np.sqrt(np.mean(rises**2) / np.mean(np.sum(U**2, axis=1)))
    assert changes[3] < 0.01
    assert changes[3] <= changes[0]


def test_parts_that_are_no_plain_numbers_are_round():
    rng = np.random.default_rng(0)
    E = rng.normal(size=(200, 5))
    V = learn_lyapunov(E, -E + rng.normal(size=(200, 5)), -0.1 * E, ((2, True), (3, False)))
    assert np.allclose(V.matrices[0, 2:, 2:], V.matrices[0, 2, 2] * np.eye(3))
    assert not V.matrices[0, :2, 2:].any()
    assert not V.matrices[1:, 2:].any()
    assert not V.matrices[1:, :, 2:].any()
