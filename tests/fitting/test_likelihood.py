"""Log-likelihoods of actions, and gradients that say where the policy is."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unconstrain.fitting.likelihood import Views
from unconstrain.fitting.noise import Noise
from unconstrain.fitting.sphere import blurred

seeds = st.integers(0, 2**32 - 1)
noises = st.builds(
    Noise,
    st.floats(0.01, 1.0),
    st.one_of(st.just(0.0), st.floats(0.001, 0.5)),
)


def views(U, P, noise, ranks=None):
    return Views(U, P, noise, np.full(len(U), float(U.shape[1])) if ranks is None else ranks)


def slope(log, P, h=1e-5):
    """Differentiate `log(P)` numerically, (N, d)."""
    return np.stack([(log(P + h * e) - log(P - h * e)) / (2 * h) for e in np.eye(P.shape[1])], axis=1)


@given(seeds, st.integers(1, 6), noises)
def test_a_free_sample_is_normal_about_the_policy(seed, d, noise):
    rng = np.random.default_rng(seed)
    U, P = rng.normal(size=(5, d)), rng.normal(size=(5, d))
    S = noise.action * np.eye(d) + noise.speed * P[:, :, None] * P[:, None]
    E = U - P
    expected = -0.5 * (
        np.einsum("ni,nij,nj->n", E, np.linalg.inv(S), E) + np.linalg.slogdet(2 * np.pi * S)[1]
    )
    np.testing.assert_allclose(views(U, P, noise).whole.log, expected, rtol=1e-9, atol=1e-9)


@given(seeds, st.integers(1, 6), noises)
def test_the_gradient_of_a_free_sample_is_its_slope(seed, d, noise):
    rng = np.random.default_rng(seed)
    U, P = rng.normal(size=(5, d)), rng.normal(size=(5, d))
    numeric = slope(lambda P: views(U, P, noise).whole.log, P)
    np.testing.assert_allclose(
        views(U, P, noise).whole.gradient, numeric, rtol=1e-5, atol=1e-5 * np.abs(numeric).max()
    )


@given(seeds, st.integers(1, 6), noises)
def test_a_policy_at_rest_is_drawn_to_a_free_action(seed, d, noise):
    U = np.random.default_rng(seed).normal(size=(4, d))
    here = views(U, np.zeros_like(U), noise).whole
    np.testing.assert_allclose(here.gradient, U / noise.action)
    near = views(U, np.full_like(U, 1e-9), noise).whole
    np.testing.assert_allclose(near.gradient, here.gradient, rtol=1e-5, atol=1e-6 / noise.action)


def test_nothing_is_seen_where_nothing_is_let_through():
    zero = np.zeros((2, 3))
    whole = views(zero, zero, Noise(1e-8), np.zeros(2)).whole
    np.testing.assert_array_equal(whole.log, 0.0)
    np.testing.assert_array_equal(whole.gradient, 0.0)


@given(seeds, st.integers(2, 7), noises)
def test_the_gradient_of_a_constrained_sample_is_that_of_its_distance(seed, d, noise):
    """`log p(u) + (d-1) log ρ`, but for ρ / (ρ² + s²) in place of 1 / ρ."""
    rng = np.random.default_rng(seed)
    U, P = rng.normal(size=(5, d)), rng.normal(size=(5, d))

    def log(P):
        seen = views(U, P, noise)
        return seen.constrained.log + (d - 1) * np.log(seen.sphere.from_center)

    seen = views(U, P, noise)
    rho, variance = seen.sphere.from_center, seen.constrained.variance
    bounded = -(d - 1) / 2 * (rho / (rho**2 + variance) - 1 / rho)
    expected = slope(log, P) + bounded[:, None] * seen.sphere.out
    got = seen.constrained.gradient
    np.testing.assert_allclose(
        got, expected, rtol=1e-4, atol=1e-4 * (np.abs(expected).max() + (1 / rho).max())
    )


@pytest.mark.parametrize("d", [2, 7])
def test_wherever_on_the_sphere_actions_lie_the_truth_is_not_pulled_away_from(d):
    """The expected gradient vanishes to O(s²/R²) times its size; that of the plain likelihood does not."""
    rng = np.random.default_rng(d)
    p = np.zeros(d)
    p[0] = 2.0
    s, N = 0.05, 400_000
    for m in rng.normal(size=(3, d)):
        v = p / 2 + m / np.linalg.norm(m)
        U = v + s * rng.normal(size=(N, d))
        seen = views(U, np.tile(p, (N, 1)), Noise(s**2))
        gradient, plain = seen.constrained.gradient, blurred(seen.sphere, np.full(N, s**2)).by_policy
        # In units of the deviation of one sample's gradient, 1/s: a policy that is off by e pulls by e/s².
        mean, error = gradient.mean(axis=0) * s, gradient.std(axis=0) * s / np.sqrt(N)
        assert np.all(np.abs(mean) < 5 * error + 3 * d * s**2)
        out = seen.sphere.out.mean(axis=0)
        assert plain.mean(axis=0) @ out * s > 0.3 * (d - 1) * s
        np.testing.assert_allclose(seen.constrained.square.mean(), s**2, rtol=0.02)


@given(seeds, st.sampled_from([1, 2, 7]), st.floats(-6, 2))
def test_the_square_of_a_constrained_sample_is_its_variance_on_average(seed, d, exponent):
    """Over actions drawn from the marginal itself the score of the variance vanishes, whatever noise and radius are."""
    rng = np.random.default_rng(seed)
    N, s = 20_000, 10.0**exponent
    P = np.tile(rng.normal(size=d), (N, 1))
    m = rng.normal(size=(N, d))
    m /= np.linalg.norm(m, axis=1, keepdims=True)
    U = P / 2 + np.linalg.norm(P[0]) / 2 * m + s * rng.normal(size=(N, d))
    square = views(U, P, Noise(s**2)).constrained.square
    assert abs(square.mean() - s**2) < 6 * square.std() / np.sqrt(N)


@given(seeds, st.integers(1, 7), st.sampled_from([1e-14, 1.0, 1e14]))
def test_all_is_finite_at_rest(seed, d, variance):
    rng = np.random.default_rng(seed)
    some, zero = rng.normal(size=(3, d)), np.zeros((3, d))
    for U, P in ((some, zero), (zero, some), (zero, zero), (some, some), (some / 2, some)):
        for noise in (Noise(variance), Noise(variance, 0.1)):
            seen = views(U, P, noise)
            parts = [*vars(seen.whole).values(), *vars(seen.constrained).values()]
            assert all(np.isfinite(part).all() for part in parts)
