"""A noise of the actions that is known beforehand."""

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.errors import PolicyError
from unconstrain.limit_cycle import demonstrate

DEMOS = demonstrate(n_episodes=20, noise=0.05, free=0.3, random_state=0)
RBF = uc.NormalizedRBF(n_centers=25, random_state=0)


def fit(demos=DEMOS, **options):
    return uc.ParametricPolicy(RBF, **options).fit(demos.states, demos.actions, groups=demos.episodes)


def test_inference_does_not_go_below_it():
    found = fit().noise_
    assert fit(noise=0.2 * found).noise_ == pytest.approx(found, rel=1e-6)
    assert fit(noise=3 * found).noise_ >= 3 * found * (1 - 1e-9)


def test_the_correction_takes_away_no_more_than_it():
    found = fit(risk="corrected").noise_
    assert fit(risk="corrected", noise=0.5 * found).noise_ == pytest.approx(0.5 * found)
    assert fit(risk="corrected", noise=2 * found).noise_ == pytest.approx(found)


def test_demonstrations_bring_it_and_the_option_overrules_it():
    found = fit(risk="corrected").noise_
    known = uc.Demonstrations(DEMOS.states, DEMOS.actions, DEMOS.episodes, noise=0.5 * found)
    policy = uc.ParametricPolicy(RBF, risk="corrected").fit(known)
    assert policy.noise is None
    assert policy.noise_ == pytest.approx(0.5 * found)
    assert uc.ParametricPolicy(RBF, risk="corrected", noise=0.0).fit(known).noise_ == pytest.approx(found)
    chosen = uc.select_policy([uc.ParametricPolicy(RBF, risk="corrected")], known)
    assert chosen.policy.noise_ == pytest.approx(0.5 * found)


def test_more_samples_and_a_file_keep_it(tmp_path):
    policy = fit(risk="corrected", noise=1e-3)
    policy.save(tmp_path / "a.skops", resumable=True)
    again = uc.load_policy(tmp_path / "a.skops")
    assert again.noise == 1e-3
    again.partial_fit(DEMOS.states, DEMOS.actions, groups=DEMOS.episodes)
    assert again.noise_ == pytest.approx(1e-3)


@pytest.mark.parametrize("noise", [-1.0, np.nan, "much"])
@pytest.mark.parametrize("policy", [uc.ParametricPolicy, uc.LocallyLinearPolicy])
def test_what_is_no_noise_is_refused(policy, noise):
    with pytest.raises(PolicyError, match="noise must be"):
        policy(noise=noise).fit(DEMOS.states, DEMOS.actions)
