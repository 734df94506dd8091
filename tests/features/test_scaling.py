"""Standardised states: of mean zero and spread one, whatever they were, and finite where they do not spread."""

import numpy as np
import pytest

from unconstrain.features.scaling import Scaling


@pytest.mark.parametrize("unit", [1e-140, 1e-6, 1.0, 1e140])
@pytest.mark.parametrize("shift", [0.0, 1e6])
def test_states_have_mean_zero_and_spread_one(unit, shift):
    X = (np.random.default_rng(0).normal(size=(200, 2)) + shift) * unit
    weights = np.random.default_rng(1).random(200)
    for given in (None, weights):
        Z = Scaling.of(X, given)(X)
        np.testing.assert_allclose(np.average(Z, axis=0, weights=given), 0.0, atol=1e-8)
        np.testing.assert_allclose(np.average(Z**2, axis=0, weights=given), 1.0, rtol=1e-8)


@pytest.mark.parametrize("value", [0.0, 0.1, -3e8, 1e-320, 1e150])
def test_a_column_without_spread_has_a_unit(value):
    X = np.full((30, 1), value) * (1 + 1e-16 * np.random.default_rng(0).normal(size=(30, 1)))
    scaling = Scaling.of(X)
    assert np.isfinite(scaling.spread).all()
    assert (scaling.spread > 0).all()
    assert np.abs(scaling(X)).max() < 1e-12
    assert np.isfinite(scaling(X + 1.0)).all()


def test_single_precision_is_counted_in_double():
    X = np.random.default_rng(0).normal(size=(50, 3)).astype(np.float32)
    assert Scaling.of(X)(X).dtype == np.float64
