"""How a constrained action moves over its sphere from one sample to the next."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unconstrain.fitting.drift import LEAST, MOST, Drift, Drifts, Steps
from unconstrain.fitting.sphere import Sphere

seeds = st.integers(0, 2**32 - 1)


def walk(rng, d, N, drift, jump, noise=0.0):
    """Unit predictions, and actions whose direction from the centre drifts and jumps."""
    P = np.zeros((N, d))
    P[:, 0] = 2.0
    m = np.empty((N, d))
    for t in range(N):
        fresh = t == 0 or rng.random() < jump
        m[t] = rng.normal(size=d) if fresh else m[t - 1] + drift * rng.normal(size=d)
        m[t] /= np.linalg.norm(m[t])
    return Sphere.of(P / 2 + m + noise * rng.normal(size=(N, d)), P)


def settle(sphere, variance, drift=None):
    """Estimate the drift of samples that are all constrained."""
    N = len(sphere.radius)
    starts, drift = np.arange(N) == 0, drift or Drift()
    for _ in range(30):
        steps = Steps.of(sphere, np.full(N, variance), starts, drift)
        drift = steps.sum(1.0 - starts).estimate()
    return drift, steps


@pytest.mark.parametrize("d", [2, 3, 7])
def test_a_persistent_direction_is_recognised(d):
    rng = np.random.default_rng(d)
    drift, steps = settle(walk(rng, d, 3000, drift=0.05, jump=0.02), 1e-8)
    assert drift.square == pytest.approx(0.05**2, rel=0.25)
    assert drift.jump == pytest.approx(0.02, abs=0.012)
    assert np.median(steps.log_kept[1:]) > 1.0
    anywhere, steps = settle(walk(rng, d, 3000, drift=0.0, jump=1.0), 1e-8)
    assert anywhere.jump > 0.8 or anywhere.square > 0.5
    assert steps.log_kept.mean() == pytest.approx(0.0, abs=0.05)


def test_noise_does_not_pass_for_drift():
    sphere = walk(np.random.default_rng(0), 3, 4000, drift=0.0, jump=0.0, noise=0.1)
    drift, _ = settle(sphere, 0.01)
    assert drift.square < 0.3 * 0.02


def test_relative_densities_average_to_one_over_the_sphere():
    """Wherever the sample before it lay, the density of the direction, relative to anywhere, is a density."""
    rng = np.random.default_rng(0)
    for d in (1, 2, 5):
        P = np.tile(2 * np.eye(d)[0], (40_000, 1))
        m = rng.normal(size=P.shape)
        m /= np.linalg.norm(m, axis=1, keepdims=True)
        steps = Steps.of(
            Sphere.of(P / 2 + m, P), np.full(len(P), 1e-3), np.arange(len(P)) == 0, Drift(0.2, 0.3)
        )
        density = np.exp(steps.log_kept[1:])
        assert abs(density.mean() - 1) < 6 * density.std() / np.sqrt(len(density))


@given(seeds, st.integers(1, 5), st.floats(-300, 300), st.booleans())
def test_estimates_stay_within_bounds(seed, d, exponent, at_rest):
    rng = np.random.default_rng(seed)
    U, P = rng.normal(size=(2, 20, d))
    if at_rest:
        P[::2] = 0.0
        U[::3] = 0.0
    kept, starts = rng.random(20), rng.random(20) < 0.2
    starts[0] = True
    steps = Steps.of(Sphere.of(U, P), np.full(20, 10.0**exponent), starts, Drift())
    assert np.isfinite(steps.log_kept).all()
    np.testing.assert_array_equal(steps.log_kept[starts], 0.0)
    drifts = steps.sum(kept) + Drifts()
    assert 0 <= drifts.near <= drifts.pairs + 1e-9
    drift = drifts.estimate()
    assert LEAST <= drift.square <= MOST
    assert 0 < drift.jump <= 1
    assert Drifts().estimate() == Drift()
