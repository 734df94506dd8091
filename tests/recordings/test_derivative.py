import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from unconstrain.errors import DataError
from unconstrain.recordings.derivative import differentiate, spans_window, window_samples

coefficients = st.lists(st.floats(-10, 10), min_size=1, max_size=4)


@settings(deadline=None)
@given(
    coefficients,
    st.integers(1, 3),
    st.integers(12, 80),
    st.floats(0, 0.4),
    st.integers(0, 2**32 - 1),
)
def test_polynomials_are_differentiated_exactly_under_jitter(c, polyorder, n_samples, jitter, seed):
    rng = np.random.default_rng(seed)
    time = (np.arange(n_samples) + jitter * rng.uniform(-1, 1, n_samples)) / n_samples + 5.0
    polynomial = np.polynomial.Polynomial(c[: polyorder + 1])
    slopes = differentiate(polynomial(time)[:, None], time, window=5 / n_samples, polyorder=polyorder)
    truth = polynomial.deriv()(time)
    scale = np.abs(np.array(c)).max() * 5.0**polyorder * n_samples
    np.testing.assert_allclose(slopes[:, 0], truth, rtol=0, atol=1e-11 * max(scale, 1e-300))


@settings(deadline=None)
@given(st.floats(-1e3, 1e3), st.floats(-3, 3), st.integers(0, 2**32 - 1))
def test_linear_in_the_states_and_blind_to_the_origin_of_time(shift, factor, seed):
    rng = np.random.default_rng(seed)
    X, t = rng.normal(size=(40, 2)), np.cumsum(rng.uniform(0.015, 0.025, 40))
    slopes = differentiate(X, t)
    np.testing.assert_allclose(differentiate(factor * X + 1.0, t), factor * slopes, atol=1e-9)
    np.testing.assert_allclose(differentiate(X, t + shift), slopes, atol=1e-6)


def test_a_noisy_circle_at_50_hz():
    rng = np.random.default_rng(0)
    t = np.arange(500) * 0.02 + rng.uniform(-1e-3, 1e-3, 500)
    circle = np.column_stack([np.cos(3 * t), np.sin(3 * t)])
    truth = 3 * np.column_stack([-np.sin(3 * t), np.cos(3 * t)])
    slopes = differentiate(circle + rng.normal(scale=1e-3, size=circle.shape), t, window=0.2)
    assert np.sqrt(np.mean((slopes - truth)[10:-10] ** 2)) < 0.05


def test_window_in_samples():
    assert window_samples(0.02, 0.2) == 11
    assert window_samples(0.02, 1e-9) == 3
    assert window_samples(0.02, 1e-9, polyorder=3) == 5
    assert window_samples(0.02, 1e-9, polyorder=1) == 3
    assert spans_window(np.arange(11) * 0.02, 0.2)
    assert not spans_window(np.arange(10) * 0.02, 0.2)
    assert not spans_window(np.zeros(1), 0.2)


def test_bursts_of_stamps_do_not_make_an_endless_grid():
    t = np.sort(np.concatenate([np.arange(20) * 1.0, np.arange(20) + 1e-9, np.arange(20) + 2e-9]))
    assert differentiate(t[:, None], t, window=2.0) == pytest.approx(np.ones((60, 1)), abs=1e-3)


@pytest.mark.parametrize(
    ("states", "time", "options", "sentence"),
    [
        (np.ones(5), np.arange(5.0), {}, "are needed"),
        (np.ones((5, 1)), np.arange(4.0), {}, "are needed"),
        (np.ones((5, 1)), np.array([0, 1, 1, 2, 3.0]), {}, "does not increase at row 2"),
        (np.ones((5, 1)), np.arange(5.0), {"window": 9}, "too few for a window of 9 s"),
        (np.ones((1, 1)), np.zeros(1), {}, "too few"),
        (np.ones((5, 1)), np.arange(5.0), {"window": 0}, "window must be"),
        (np.ones((5, 1)), np.arange(5.0), {"polyorder": 4}, "polyorder must be"),
    ],
)
def test_what_cannot_be_differentiated_is_told(states, time, options, sentence):
    with pytest.raises(DataError, match=sentence):
        differentiate(states, time, **options)
