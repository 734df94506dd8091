"""Reduced moments solve as eigenvectors do, and choose the same λ."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import unconstrain as uc
from unconstrain.fitting import path, unlocked
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.path import Path
from unconstrain.fitting.tridiagonal import Tridiagonal


def random_moments(rng, batch, P, K, n_samples):
    V = rng.standard_normal((*batch, n_samples, P))
    targets = rng.standard_normal((*batch, n_samples, K))
    Vt = V.swapaxes(-1, -2)
    return Moments(
        Vt @ V, Vt @ targets, np.sum(targets**2, axis=(-1, -2)), np.full(batch, float(n_samples)), 9
    )


@settings(deadline=None, max_examples=25)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([1, 2, 7, 96, 97, 150, 200]),
    st.integers(1, 3),
    st.booleans(),
    st.booleans(),
)
def test_reduced_solves_as_eigenvectors_do(seed, P, K, is_wide, has_targets):
    rng = np.random.default_rng(seed)
    moments = random_moments(rng, () if P > 100 else (3,), P, K, 2 * P + 3)
    alphas = np.geomspace(1e-3, 1e3, 4)
    toward = rng.standard_normal((P, 4, K)) if has_targets else None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(path, "WIDE", 0 if is_wide else 1000)
        patch.setattr(path, "FEW", 0)
        reduced = Path.of(moments)
    expected = moments.decompose().solve(alphas, toward)
    np.testing.assert_allclose(reduced.solve(alphas, toward), expected, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("is_wide", [False, True])
def test_directions_that_no_sample_shows_are_left_out_as_by_eigenvectors(is_wide, monkeypatch):
    monkeypatch.setattr(path, "WIDE", 0 if is_wide else 1000)
    monkeypatch.setattr(path, "FEW", 0)
    rng = np.random.default_rng(0)
    few, many = random_moments(rng, (), 9, 1, 6), random_moments(rng, (), 9, 1, 20)
    both = Moments(np.stack([few.H, many.H]), np.stack([few.g, many.g]), np.ones(2), np.ones(2))
    alphas, toward = np.array([1e-16, 1.0]), rng.standard_normal((9, 2, 1))
    reduced = Path.of(both)
    assert reduced.is_reduced.tolist() == [False, True]
    np.testing.assert_allclose(
        reduced.solve(alphas, toward), both.decompose().solve(alphas, toward), rtol=1e-9
    )


@pytest.mark.parametrize("P", [2, 30, 140])
def test_without_the_lock_it_is_the_same_routine(P, monkeypatch):
    moments = random_moments(np.random.default_rng(0), (3,), P, 1, 2 * P)
    found = Tridiagonal.of(moments.H)
    monkeypatch.setattr(unlocked, "_routine", lambda: None)
    plain = Tridiagonal.of(moments.H)
    np.testing.assert_array_equal(found.diagonal, plain.diagonal)
    np.testing.assert_array_equal(found.factors, plain.factors)
    for one, other in zip(found.basis, plain.basis, strict=True):
        np.testing.assert_array_equal(one, other)


class _BySpectrum:
    """What solved for many λ before."""

    def __init__(self, moments):
        self.spectrum = moments.decompose()

    @classmethod
    def of(cls, moments):
        return cls(moments)

    def solve(self, decays, toward=None):
        return self.spectrum.solve(decays, toward)


@pytest.mark.parametrize("is_wide", [False, True])
@pytest.mark.parametrize("risk", ["inconsistency", "direct", "corrected"])
def test_the_same_lambda_is_chosen_as_by_eigenvectors(risk, is_wide, monkeypatch):
    rng = np.random.default_rng(1)
    X = rng.uniform(-1, 1, (600, 3))
    U = np.sin(3 * X) + 0.1 * rng.standard_normal(X.shape)
    groups = np.arange(600) // 20
    policies = (
        uc.ParametricPolicy(uc.NormalizedRBF(n_centers=30, random_state=0), risk=risk),
        uc.LocallyLinearPolicy(n_centers=6, risk=risk, random_state=0),
    )
    monkeypatch.setattr(path, "WIDE", 0 if is_wide else 1000)
    monkeypatch.setattr(path, "FEW", 0)
    found = [policy.fit(X, U, groups=groups) for policy in policies]
    chosen = [(policy.alpha_, policy.held_out_risk_) for policy in found]
    monkeypatch.setattr("unconstrain.fitting.decay.Path", _BySpectrum)
    for policy, (alpha, held_out) in zip(policies, chosen, strict=True):
        policy.fit(X, U, groups=groups)
        assert policy.alpha_ == alpha
        np.testing.assert_allclose(held_out, policy.held_out_risk_, rtol=1e-6)
