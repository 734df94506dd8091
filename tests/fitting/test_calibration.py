"""Deviations of what was inferred: folds left out, misfit that repeats, and how many true actions they hold."""

import numpy as np
import pytest
from sklearn.preprocessing import PolynomialFeatures

import unconstrain as uc
from unconstrain import limit_cycle
from unconstrain.fitting.calibration import Calibration
from unconstrain.fitting.posterior import Posterior

NINETY = 1.6448536269514722


def cycle(seed=0, n=40, **options):
    return limit_cycle.demonstrate(n, **({"noise": 0.05, "free": 0.5} | options), random_state=seed)


def cubic(**options):
    return uc.ParametricPolicy(PolynomialFeatures(3), **options)


def learn(policy, demos):
    """Learn from the arrays alone: of demonstrations the projections would be known."""
    return policy.fit(demos.states, demos.actions, groups=demos.episodes)


def test_the_folds_spread_is_half_of_the_jackknife_of_policies_solved_without_each():
    policy = learn(cubic(), cycle())
    calibration = policy.calibration()
    w = np.array([policy.accumulator_.solve(policy.alpha_, without=k).w for k in range(5)])
    apart = w - w.mean(axis=0)
    np.testing.assert_allclose(calibration.spread, 0.5 * 4 / 5 * apart.T @ apart, rtol=1e-9)


def test_covariances_of_noise_folds_and_misfit_add_up():
    policy = learn(cubic(), cycle())
    moments = policy.accumulator_.moments()
    decay = policy.model_.decay(moments)
    plain = Posterior.of(moments, decay=decay, noise=0.1).covariance
    spread = np.eye(len(plain))
    found = Calibration(0.1, 3.0, spread).posterior(moments, decay)
    np.testing.assert_allclose(found.covariance, 4.0 * plain + spread)
    assert found.apart == pytest.approx(4.0)
    np.testing.assert_allclose(Calibration(0.1).posterior(moments, decay).covariance, plain)


@pytest.mark.parametrize("policy", [uc.ParametricPolicy(), uc.LocallyLinearPolicy(n_centers=4)])
def test_misfit_is_found_where_the_model_is_coarse(policy):
    demos = cycle(free=1.0)
    assert learn(policy, demos).calibration().misfit > 3 * learn(cubic(), demos).calibration().misfit


def test_without_folds_or_episodes_the_noise_is_what_there_is():
    demos = cycle(n=10)
    one = learn(cubic(alpha=1e-6), demos).calibration()
    assert one.spread is None
    alone = cubic().fit(demos.states, demos.actions)
    assert alone.calibration() == Calibration(alone.solution_.belief.noise.action)
    assert learn(uc.ParametricPolicy(risk="inconsistency"), demos).calibration() is None


@pytest.mark.parametrize(
    "policy", [uc.ParametricPolicy(uc.NormalizedRBF(9)), uc.LocallyLinearPolicy(n_centers=6)]
)
def test_deviations_have_the_unit_of_the_actions_and_none_of_the_states(policy):
    demos = cycle(n=15)
    plain = learn(policy, demos).predict(demos.states, return_cov=True)[1]
    other = uc.Demonstrations(3.0 + 4.0 * demos.states, 7.0 * demos.actions, episodes=demos.episodes)
    covariance = learn(policy, other).predict(other.states, return_cov=True)[1]
    np.testing.assert_allclose(covariance, 49.0 * plain, rtol=0, atol=0.01 * 49.0 * plain.max())


def test_a_policy_without_its_sums_reports_by_the_noise_alone(tmp_path):
    demos = cycle(n=15)
    policy = learn(cubic(), demos)
    policy.save(tmp_path / "policy.skops")
    loaded = uc.load_policy(tmp_path / "policy.skops")
    known = uc.identifiability(
        policy, demos.states, demos.actions, groups=demos.episodes
    ).posterior.covariance
    noise = uc.identifiability(
        loaded, demos.states, demos.actions, groups=demos.episodes
    ).posterior.covariance
    assert loaded.calibration().noise == pytest.approx(policy.noise_**2 / policy.solution_.evidence)
    assert loaded.calibration().spread is None
    assert np.trace(known) >= np.trace(noise) > 0


@pytest.mark.parametrize(
    ("features", "least"), [(PolynomialFeatures(3), 0.85), (uc.NormalizedRBF(36), 0.7)], ids=["cubic", "RBF"]
)
def test_ninety_percent_of_the_truth_on_movements_not_seen_lies_in_the_interval(features, least):
    inside = []
    for seed in range(5):
        policy = learn(uc.ParametricPolicy(features), cycle(seed))
        test = cycle(1000 + seed, noise=0.0)
        P, deviation = policy.predict(test.states, return_std=True)
        inside.append(np.mean(np.abs(P - test.policy) <= NINETY * deviation))
    assert least <= np.mean(inside) <= 0.99
