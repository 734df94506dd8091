"""Samples of wide models are held, and solved by conjugate gradients: the answer is that of their moments."""

import tracemalloc

import numpy as np
import pytest
from sklearn.preprocessing import PolynomialFeatures

import unconstrain as uc
from unconstrain.errors import DataError
from unconstrain.fitting import wide
from unconstrain.fitting.observation import Expanded, observe
from unconstrain.fitting.wide.decay import WideDecay
from unconstrain.fitting.wide.held import HeldSamples

N, D = 300, 3


def movements(seed=0):
    rng = np.random.default_rng(seed)
    X = np.cumsum(0.1 * rng.normal(size=(N, D)), axis=0) + rng.normal(size=D)
    Pi = np.sin(X) - X
    a = np.repeat(rng.normal(size=(N // 30, D)), 30, axis=0)
    a /= np.linalg.norm(a, axis=1, keepdims=True)
    bent = np.repeat(np.arange(N // 30) % 2 == 0, 30)
    projections = np.where(bent[:, None, None], np.eye(D) - a[:, :, None] * a[:, None, :], np.eye(D))
    U = np.einsum("nij,nj->ni", projections, Pi) + 0.02 * rng.normal(size=(N, D))
    return X, U, np.repeat(np.arange(N // 30), 30), projections


@pytest.fixture
def held(monkeypatch):
    """Let models be wide from one parameter on."""

    def choose(is_held):
        for name in ("WIDE", "WIDE_FOR_CHOICE"):
            monkeypatch.setattr(wide.held, name, 0 if is_held else 10**9)

    return choose


FEATURES = {
    "rbf": uc.NormalizedRBF(n_centers=12),
    "linear": None,
    "intercept": PolynomialFeatures(2),
}


def both(held, fit):
    found = []
    for is_held in (False, True):
        held(is_held)
        found.append(fit())
        assert found[-1].accumulator_.holds is is_held
    return found


@pytest.mark.parametrize("risk", ["inconsistency", "direct"])
@pytest.mark.parametrize(
    ("kind", "alpha"),
    # Folds of the linear policy are standardised together, so that its λ may be another of those that are as good.
    [("rbf", 1e-3), ("linear", 1e-3), ("intercept", 1e-3), ("rbf", "cv"), ("intercept", "cv")],
)
def test_held_samples_give_the_answer_of_their_moments(held, kind, risk, alpha):
    X, U, groups, _ = movements()
    weights = np.random.default_rng(1).uniform(0.0, 2.0, N)
    summed, by_passes = both(
        held,
        lambda: uc.ParametricPolicy(FEATURES[kind], risk=risk, alpha=alpha).fit(
            X, U, groups=groups, sample_weight=weights
        ),
    )
    assert by_passes.alpha_ == pytest.approx(summed.alpha_)
    P = summed.predict(X)
    assert np.sqrt(np.mean((by_passes.predict(X) - P) ** 2) / np.mean(P**2)) < 1e-6


def test_held_out_risks_are_those_of_moments_also_of_a_small_subset(held, monkeypatch):
    X, U, groups, _ = movements()
    monkeypatch.setattr(wide.preconditioner, "MOST_ROWS", 60)

    def fit():
        return uc.ParametricPolicy(uc.NormalizedRBF(n_centers=60), risk="inconsistency").fit(
            X, U, groups=groups
        )

    summed, by_passes = both(held, fit)
    assert by_passes.alpha_ == pytest.approx(summed.alpha_)
    risks = np.interp(np.log(by_passes.alphas_), np.log(summed.alphas_), summed.held_out_risk_)
    np.testing.assert_allclose(by_passes.held_out_risk_, risks, rtol=1e-3)


def test_known_projections_and_contact_are_learnt_alike(held):
    X, U, groups, projections = movements()
    projections[::2] = np.nan

    def fit():
        policy = uc.ParametricPolicy(uc.NormalizedRBF(n_centers=12), alpha=1e-3)
        return policy.fit(X, U, groups=groups, projections=projections)

    summed, by_passes = both(held, fit)
    P = summed.predict(X)
    assert np.sqrt(np.mean((by_passes.predict(X) - P) ** 2) / np.mean(P**2)) < 1e-2
    assert by_passes.free_share_ == pytest.approx(summed.free_share_, abs=0.01)


def test_more_samples_files_and_uncertainty(held, tmp_path):
    X, U, groups, _ = movements()
    half = groups < 5

    def fit():
        policy = uc.ParametricPolicy(uc.NormalizedRBF(n_centers=12), risk="inconsistency", alpha=1e-3)
        policy.fit(X[half], U[half], groups=groups[half])
        policy.save(tmp_path / "policy.skops", resumable=True)
        loaded = uc.load_policy(tmp_path / "policy.skops")
        return loaded.partial_fit(X[~half], U[~half], groups=groups[~half])

    summed, by_passes = both(held, fit)
    for one, other in zip(
        summed.predict(X, return_std=True), by_passes.predict(X, return_std=True), strict=True
    ):
        np.testing.assert_allclose(other, one, rtol=1e-5, atol=1e-6)


def test_what_an_observation_weighs_is_the_product_with_its_rows():
    rng = np.random.default_rng(0)
    U, P = rng.normal(size=(20, D)), rng.normal(size=(20, 2, D))
    projections = np.tile(np.diag([1.0, 1.0, 0.0]), (20, 1, 1))
    known = np.arange(20) % 3 == 0
    expanded = Expanded.of(
        P[:, 0],
        U,
        np.ones(20),
        *rng.uniform(size=(3, 20)),
        *rng.normal(size=(2, 20, D)),
        known=known,
        projections=projections[known],
    )
    projections[1::2] = np.nan
    for observation in (
        observe("inconsistency", U),
        observe("inconsistency", U, projections),
        observe("direct", U),
        expanded,
    ):
        weights = observation.row_weights
        weights = np.ones(observation.rows.shape[:2]) if weights is None else weights
        A = np.einsum("nk,nki,nkj->nij", weights, observation.rows, observation.rows)
        np.testing.assert_allclose(observation.weigh(P), np.einsum("nij,nlj->nli", A, P), atol=1e-12)


def test_the_parameters_that_are_used_are_counted(held):
    X, U, _, _ = movements()
    held(False)
    policy = uc.ParametricPolicy(uc.NormalizedRBF(n_centers=60), risk="inconsistency", alpha=1e-3).fit(X, U)
    moments, model = policy.accumulator_.moments(), policy.model_
    exact = model.decay(moments).used(moments, 1e-3)
    estimated = WideDecay([HeldSamples.of(model, X, observe("inconsistency", U))]).used(1e-3)
    assert estimated == pytest.approx(exact, rel=0.05)


def test_twenty_thousand_parameters_take_no_square_of_them(held):
    rng = np.random.default_rng(0)
    X, U = rng.normal(size=(200, 4)), rng.normal(size=(200, 4))
    policy = uc.ParametricPolicy(
        uc.NormalizedRBF(centers=rng.normal(size=(5_000, 4)), width=1.0), risk="inconsistency", alpha=1e-2
    )
    tracemalloc.start()
    try:
        policy.fit(X, U)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert policy.accumulator_.holds
    assert peak < 100e6  # their H would be 3.2 GB


def test_what_is_not_solved_is_said(held, monkeypatch):
    held(True)
    X, U, _, _ = movements()
    policy = uc.ParametricPolicy(uc.NormalizedRBF(n_centers=60), risk="inconsistency", alpha=1e-9)
    monkeypatch.setattr(wide.decay.Subset, "factorize", lambda self, decay: lambda R: R)
    monkeypatch.setattr(
        WideDecay.systems, "__kwdefaults__", WideDecay.systems.__kwdefaults__ | {"most_steps": 3}
    )
    with pytest.warns(UserWarning, match="were not found exactly in 3 passes"):
        policy.fit(X, U)
    with pytest.raises(DataError, match="at least two episodes"):
        uc.ParametricPolicy(uc.NormalizedRBF(n_centers=9), risk="direct").fit(X, U, groups=np.zeros(N))
