"""Variances are recovered from squared residuals, and none is below zero."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unconstrain.fitting.noise import KINDS, Noise, Squares

seeds = st.integers(0, 2**32 - 1)


def variances(noise):
    return np.array([noise.action, noise.speed])


def simulate(rng, truth, guess, N=60_000):
    """Residuals of actions as free ones: across the policy, along it, and of constrained ones."""
    length2, share = rng.uniform(0.05, 4, N), rng.uniform(0.05, 1, N)
    one, zero = np.ones(N), np.zeros(N)
    parts = []
    for contributions in ((one, zero), (one, length2), (one, share**2 * length2)):
        c = np.array(contributions)
        variance = variances(truth) @ c
        square = variance * rng.normal(size=N) ** 2
        parts.append((one, square, variances(guess) @ c, contributions))
    return Squares.sum(parts)


@pytest.mark.parametrize("truth", [Noise(0.04), Noise(0.04, 0.02), Noise(0.01, 0.05)])
def test_variances_are_found_by_scoring(truth):
    kinds = tuple(kind for kind, value in zip(KINDS, variances(truth), strict=True) if value)
    guess = Noise(0.1, 0.1 if truth.speed else 0.0)
    for _ in range(4):
        guess = simulate(np.random.default_rng(0), truth, guess).estimate(kinds)
    np.testing.assert_allclose(variances(guess), variances(truth), rtol=0.1, atol=1e-3)


@given(seeds, st.sampled_from([KINDS[:1], KINDS]), st.floats(-30, 30))
def test_no_variance_is_negative_in_any_unit(seed, kinds, exponent):
    rng = np.random.default_rng(seed)
    unit = 10.0**exponent
    N = int(rng.integers(1, 6))
    number, square = rng.uniform(0, 2, N), rng.normal(size=N)  # squares of bent spheres may be below zero
    c = rng.uniform(0, 1, (2, N))
    variance = 0.1 + rng.uniform(size=N)
    found = [
        Squares.sum([(number, square * by, variance * by, (c[0], c[1] * by))]).estimate(kinds)
        for by in (1.0, unit)
    ]
    assert all(np.all(variances(noise) >= 0) and np.isfinite(variances(noise)).all() for noise in found)
    if kinds == KINDS[:1]:
        assert found[1].action == pytest.approx(found[0].action * unit)


def test_squares_add():
    rng = np.random.default_rng(1)
    whole = [(np.ones(10), rng.random(10), np.ones(10), (np.ones(10), rng.random(10)))]
    halves = [
        [(n[part], s[part], v[part], tuple(c[part] for c in cs)) for n, s, v, cs in whole]
        for part in (slice(5), slice(5, 10))
    ]
    total, added = Squares.sum(whole), Squares.sum(halves[0]) + Squares.sum(halves[1])
    np.testing.assert_allclose(total.matrix, added.matrix)
    np.testing.assert_allclose(total.vector, added.vector)
    assert total.count == pytest.approx(added.count)


def test_without_residuals_there_is_no_noise():
    assert Squares(np.zeros((2, 2)), np.zeros(2), 0.0).estimate(KINDS) == Noise(0.0, 0.0)
