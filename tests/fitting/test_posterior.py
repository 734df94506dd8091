"""How sure a fit is: the evidence against brute force, the posterior against sampling, and its calibration."""

import numpy as np
import pytest
from hypothesis import given, settings
from scipy.optimize import minimize_scalar
from scipy.stats import multivariate_normal
from sklearn.preprocessing import PolynomialFeatures

import unconstrain as uc
from tests.problems import problems
from unconstrain import limit_cycle as toy
from unconstrain.fitting.posterior import Posterior
from unconstrain.motion import directions

NINETY = 1.6448536269514722


def linear_problem(seed, samples=400, noise=0.1):
    """A linear policy seen along random directions, with noise along them: the model holds all of the truth."""
    rng = np.random.default_rng(seed)
    X, W = rng.normal(size=(samples, 3)), rng.normal(size=(3, 3))
    unit = directions(rng.normal(size=(samples, 3)))[0]
    along = np.einsum("nd,nd->n", unit, X @ W) + noise * rng.normal(size=samples)
    return X, along[:, None] * unit, W, rng


def test_the_evidence_is_the_likelihood_of_the_data():
    X, U, _, _ = linear_problem(0, samples=30)
    policy = uc.ParametricPolicy(risk="inconsistency").fit(X, U)
    posterior = policy.posterior()
    unit, r = directions(U)
    V = policy.features_.along(X, unit)
    noise, decay = float(posterior.noise), float(posterior.decay)
    covariance = noise * (np.eye(len(r)) + V @ V.T / decay)
    direct = multivariate_normal(np.zeros(len(r)), covariance).logpdf(r)
    assert float(posterior.log_evidence) == pytest.approx(direct, rel=1e-6)

    def surprise(log_decay):
        K = np.eye(len(r)) + V @ V.T / np.exp(log_decay)
        noise = r @ np.linalg.solve(K, r) / len(r)
        return 0.5 * (len(r) * np.log(noise) + np.linalg.slogdet(K)[1])

    best = minimize_scalar(surprise, bounds=(-10, 10), method="bounded", options={"xatol": 1e-6})
    assert np.log(decay) == pytest.approx(best.x, abs=0.01)


def test_noise_is_found_from_moments():
    X, U, _, _ = linear_problem(1, samples=4000)
    assert np.sqrt(uc.ParametricPolicy(risk="inconsistency").fit(X, U).posterior().noise) == pytest.approx(
        0.1, rel=0.05
    )


def test_ninety_percent_of_the_truth_lies_in_the_interval_where_the_model_is_right():
    inside = []
    for seed in range(40):
        X, U, W, rng = linear_problem(seed, samples=60)
        test = rng.normal(size=(50, 3))
        P, deviation = uc.ParametricPolicy(risk="inconsistency").fit(X, U).predict(test, return_std=True)
        inside.append(np.mean(np.abs(P - test @ W) <= NINETY * deviation))
    assert np.mean(inside) == pytest.approx(0.9, abs=0.04)


@pytest.mark.parametrize(
    "policy",
    [
        uc.ParametricPolicy(),
        uc.ParametricPolicy(PolynomialFeatures(2)),
        uc.ParametricPolicy(uc.DecoupledFeatures(6)),
        uc.ParametricPolicy(uc.PotentialFeatures(uc.NormalizedRBF(8))),
        uc.ParametricPolicy(uc.NormalizedRBF(8), risk="direct"),
    ],
    ids=["linear", "polynomial", "decoupled", "potential", "direct"],
)
def test_covariance_is_that_of_policies_drawn_from_the_posterior(policy):
    rng = np.random.default_rng(0)
    demos = toy.demonstrate(6, noise=0.1, random_state=0)
    policy.fit(demos.states, demos.actions)
    at = demos.states[::80]
    P, covariance = policy.predict(at, return_cov=True)
    posterior = policy.posterior()
    jitter = 1e-12 * np.trace(posterior.covariance) * np.eye(len(posterior.mean))
    root = np.linalg.cholesky(posterior.covariance + jitter)
    draws = posterior.mean + np.einsum("pq,sqk->spk", root, rng.normal(size=(1000, *posterior.mean.shape)))
    actions = np.array([policy.features_.evaluate(at, w.T.reshape(-1)) for w in draws]) - P
    sampled = np.einsum("sni,snj->nij", actions, actions) / len(actions)
    scale = np.einsum("njj->n", covariance)[:, None, None]
    np.testing.assert_allclose(sampled / scale, covariance / scale, atol=0.15)
    deviation = policy.predict(at, return_std=True)[1]
    np.testing.assert_allclose(deviation, np.sqrt(np.einsum("njj->nj", covariance)))


def test_local_models_are_a_mixture_and_agree_with_a_single_one():
    X, U, _, _ = linear_problem(3)
    # λ of next to nothing: by itself each would choose its own, since one decays to zero and the other to all data.
    one = uc.LocallyLinearPolicy(centers=np.zeros((1, 3)), width=1e4, alpha=1e-8, risk="inconsistency").fit(
        X, U
    )
    whole = uc.ParametricPolicy(alpha=1e-8, risk="inconsistency").fit(X, U)
    for of_local, of_whole in zip(
        one.predict(X, return_cov=True), whole.predict(X, return_cov=True), strict=True
    ):
        np.testing.assert_allclose(of_local, of_whole, rtol=1e-3, atol=1e-6)
    for risk in ("inconsistency", "direct"):
        policy = uc.LocallyLinearPolicy(n_centers=5, risk=risk).fit(X, U)
        covariance = policy.predict(X, return_cov=True)[1]
        assert np.linalg.eigvalsh(covariance).min() >= -1e-9 * covariance.max()


def test_deviation_is_wide_where_the_data_are_silent():
    demos = toy.demonstrate(40, noise=0.05, random_state=0)
    left = demos.select(demos.states[:, 0] < -0.1)
    for policy in (
        uc.ParametricPolicy(uc.NormalizedRBF(centers="grid", width=0.5)),
        uc.LocallyLinearPolicy(),
    ):
        policy.fit(left.states, left.actions)
        deviation = policy.predict(np.array([[-0.5, 0.0], [0.8, 0.0]]), return_std=True)[1]
        assert np.all(deviation[1] > 3 * deviation[0])


def test_streams_know_how_sure_they_are():
    X, U, _, _ = linear_problem(4)
    whole, pieces = (
        uc.ParametricPolicy(risk="inconsistency").fit(X, U),
        uc.ParametricPolicy(risk="inconsistency"),
    )
    for part in (slice(150), slice(150, None)):
        pieces.partial_fit(X[part], U[part])
    np.testing.assert_allclose(
        pieces.predict(X, return_std=True)[1], whole.predict(X, return_std=True)[1], rtol=1e-6
    )


@settings(deadline=None, max_examples=20)
@given(problems(min_samples=6))
def test_posterior_is_finite_and_positive_for_any_data(problem):
    X, _, _, U, _ = problem
    if not np.any(U):
        return
    for policy in (uc.ParametricPolicy(alpha=1e-6), uc.LocallyLinearPolicy(n_centers=2, alpha=1e-6)):
        P, deviation = policy.fit(X, U).predict(X, return_std=True)
        assert P.shape == deviation.shape
        assert np.isfinite(deviation).all()
        assert isinstance(policy.posterior(), Posterior)


def test_shapes_follow_the_actions_and_mistakes_are_told():
    X = np.random.default_rng(0).normal(size=(30, 2))
    policy = uc.ParametricPolicy().fit(X, X[:, 0])
    assert [a.shape for a in policy.predict(X, return_std=True)] == [(30,), (30,)]
    assert [a.shape for a in policy.predict(X, return_cov=True)] == [(30,), (30,)]
    with pytest.raises(uc.errors.PolicyError, match="return_std or return_cov, not both"):
        policy.predict(X, return_std=True, return_cov=True)
