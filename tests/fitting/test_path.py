"""Reduced moments solve as eigenvectors do, and choose the same λ."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import unconstrain as uc
from unconstrain.fitting import path
from unconstrain.fitting.banded import Banded
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
        reduced = Path.of(moments)
    expected = moments.decompose().solve(alphas, toward)
    np.testing.assert_allclose(reduced.solve(alphas, toward), expected, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("P", [5, 130])
def test_eigenvalues_that_rounding_leaves_below_zero_count_as_zero(P):
    rng = np.random.default_rng(0)
    values = np.append(-1e-3, np.linspace(1.0, 2.0, P - 1))
    Q = np.linalg.qr(rng.standard_normal((P, P)))[0]
    H, y, decays = (Q * values) @ Q.T, rng.standard_normal((P, 1, 1)), np.array([1e-4, 1.0])
    lifted = Q @ ((Q.T @ y[:, 0]) / (np.maximum(values, 0.0)[:, None] + decays))
    np.testing.assert_allclose(
        Tridiagonal.of(H[None]).solve(decays, y[None])[0, :, 0, 0], lifted[:, 0], rtol=1e-9
    )
    np.testing.assert_allclose(Banded.of(H, 8).solve(decays, y)[:, 0, 0], lifted[:, 0], rtol=1e-9)


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
    found = [policy.fit(X, U, groups=groups) for policy in policies]
    chosen = [(policy.alpha_, policy.held_out_risk_) for policy in found]
    monkeypatch.setattr("unconstrain.fitting.decay.Path", _BySpectrum)
    for policy, (alpha, held_out) in zip(policies, chosen, strict=True):
        policy.fit(X, U, groups=groups)
        assert policy.alpha_ == alpha
        # Below 1e-10 of the mean eigenvalue, eigenvectors left out what is rounding.
        np.testing.assert_allclose(held_out, policy.held_out_risk_, rtol=1e-4)
        np.testing.assert_allclose(held_out[4:], policy.held_out_risk_[4:], rtol=1e-6)
