"""Loops that numba compiles give what NumPy gives."""

import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import unconstrain as uc
from unconstrain import loops
from unconstrain.features import FullFeatures
from unconstrain.fitting.chain import Chain, smooth
from unconstrain.fitting.kernels import parametric, reference
from unconstrain.fitting.observation import observe
from unconstrain.fitting.region import Region

pytest.importorskip("numba")


@pytest.fixture(autouse=True)
def however_few(monkeypatch):
    monkeypatch.setattr(loops, "WORTH", 0)


@settings(max_examples=25, deadline=None)
@given(
    n=st.integers(1, 9), d=st.integers(2, 8), N=st.integers(1, 400), single=st.booleans(), weighed=st.booleans(),
    seed=st.integers(0, 99),
)  # fmt: skip
def test_moments_are_those_of_the_equations(n, d, N, single, weighed, seed):
    rng = np.random.default_rng(seed)
    X, U = rng.normal(size=(N, n)), rng.normal(size=(N, d)) * rng.choice([0.0, 1.0, 30.0], size=(N, 1))
    X, U = (np.asfortranarray(each.astype(np.float32 if single else np.float64)) for each in (X, U))
    weights = rng.choice([0.0, 0.5, 2.0], size=N) if weighed else None
    features, observation = FullFeatures().fit(X.astype(float), d), observe("inconsistency", U)
    exact = reference.moments(features, X, observation, weights)
    found = parametric.of_tiles(loops.load("moments"), features, X, observation, weights)
    for name in ("H", "g", "squares", "weight"):
        expected = getattr(exact, name)
        np.testing.assert_allclose(
            getattr(found, name), expected, rtol=1e-9, atol=1e-11 * (1 + np.abs(expected).max())
        )
    assert found.n_samples == N


@pytest.mark.parametrize("n", [1, 3, 9])
@pytest.mark.parametrize("coarseness", [0, 2, 5])
def test_boxes_are_those_of_numpy(n, coarseness, monkeypatch):
    rng = np.random.default_rng(n)
    Z = rng.normal(size=(20_000, n)) * rng.uniform(0.1, 30, size=n)
    Z[0], Z[1] = 1e300, -1e300
    unit = rng.uniform(0.5, 2.0, size=n)
    found = Region.of(Z, unit, coarseness)
    monkeypatch.setattr(loops, "WORTH", np.inf)
    plain = Region.of(Z, unit, coarseness)
    assert found.coarseness == plain.coarseness
    np.testing.assert_array_equal(found.boxes, plain.boxes)


def test_states_on_edges_lie_in_the_boxes_of_numpy(monkeypatch):
    unit = np.array([0.3, 0.7])
    Z = (
        np.random.default_rng(0).integers(-40, 40, size=(5000, 2)) * (0.25 * unit) / 3 * 3
    )  # or a rounding aside
    found = Region.of(Z, unit, 2)
    assert found.distance(Z).max() == 0
    monkeypatch.setattr(loops, "WORTH", np.inf)
    np.testing.assert_array_equal(found.boxes, Region.of(Z, unit, 2).boxes)


def test_the_chain_is_that_of_numpy(monkeypatch):
    rng = np.random.default_rng(0)
    logs, starts = rng.normal(size=(2, 3000)) * 30, rng.random(3000) < 0.01
    logs[0, 5:9], starts[0] = -np.inf, True
    found = smooth(*logs, starts, Chain())
    monkeypatch.setattr(loops, "WORTH", np.inf)
    plain = smooth(*logs, starts, Chain())
    np.testing.assert_allclose(found[0], plain[0], atol=1e-12)
    np.testing.assert_allclose(found[1], plain[1], rtol=1e-9)
    np.testing.assert_allclose(found[3], plain[3], atol=1e-12)


def test_without_numba_the_fit_is_the_same(monkeypatch):
    rng = np.random.default_rng(0)
    X, U = rng.normal(size=(2, 5000, 3))
    fits = []
    for there in (True, False):
        loops.load.cache_clear()
        if not there:
            monkeypatch.setitem(sys.modules, "unconstrain.loops.moments", None)
            monkeypatch.delattr("unconstrain.loops.moments", raising=False)
            assert loops.load("moments") is None
        fits.append(uc.ParametricPolicy(alpha=0.1, risk="inconsistency").fit(X, U).predict(X[:9]))
    loops.load.cache_clear()
    np.testing.assert_allclose(*fits, rtol=1e-9)
