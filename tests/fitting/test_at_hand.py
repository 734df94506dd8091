"""Going on from a policy at hand ends where a fit anew ends, or is given up for one."""

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.errors import PolicyError
from unconstrain.fitting.at_hand import ALL_FREE, GROWN, LESS_LIKELY
from unconstrain.fitting.gains import NOTICEABLE
from unconstrain.limit_cycle import demonstrate
from unconstrain.policies.inferred import describe_inferred

KINDS = {
    "linear": uc.ParametricPolicy,
    "rbf": lambda: uc.ParametricPolicy(uc.NormalizedRBF(n_centers=16)),
    "local": lambda: uc.LocallyLinearPolicy(n_centers=15),
}


@pytest.fixture(scope="module")
def demos():
    seen = demonstrate(24, noise=0.05, free=0.5, random_state=3)
    return uc.Demonstrations(seen.states, seen.actions, seen.episodes)


@pytest.fixture(scope="module")
def anew(demos):
    return {kind: make().fit(demos) for kind, make in KINDS.items()}


def _passes(policy):
    return sum(entry["run"] != "all constrained" for entry in policy.history_)


@pytest.mark.parametrize("kind", KINDS)
def test_after_one_more_episode_the_answer_is_that_of_a_fit_anew_in_fewer_passes(demos, anew, kind):
    before = KINDS[kind]().fit(demos.select(demos.episodes != 3))
    warm = KINDS[kind]().fit(demos, start=before)
    assert "from the policy at hand" in describe_inferred(warm)
    assert warm.log_likelihood_ > anew[kind].log_likelihood_ - NOTICEABLE
    P = anew[kind].predict(demos.states)
    apart = np.sqrt(np.mean((P - warm.predict(demos.states)) ** 2))
    assert apart < 0.02 * np.sqrt(np.mean(P**2))
    assert _passes(warm) < 0.5 * _passes(anew[kind])


@pytest.mark.parametrize("factor", [-2.0, 0.5])
def test_from_a_policy_of_something_else_the_answer_is_no_worse(demos, anew, factor):
    # Half as long, actions are likelier than any explanation of these can be.
    wrong = KINDS["linear"]().fit(demos.states, factor * demos.actions, groups=demos.episodes)
    warm = KINDS["linear"]().fit(demos, start=wrong)
    assert warm.log_likelihood_ > anew["linear"].log_likelihood_ - NOTICEABLE
    if factor == 0.5:
        assert LESS_LIKELY in describe_inferred(warm)
        np.testing.assert_array_equal(warm.weights_, anew["linear"].weights_)


def test_where_no_contact_was_found_there_is_nothing_to_go_on_from(demos):
    X = demos.states
    U = np.tanh(X) + 0.05 * np.random.default_rng(0).standard_normal(X.shape)
    before = uc.ParametricPolicy(uc.NormalizedRBF(n_centers=9)).fit(X, U, groups=demos.episodes)
    warm = uc.ParametricPolicy(uc.NormalizedRBF(n_centers=9)).fit(X, U, groups=demos.episodes, start=before)
    assert ALL_FREE in describe_inferred(warm)
    np.testing.assert_array_equal(warm.weights_, before.weights_)


def test_the_growth_is_counted_from_the_last_fit_anew_not_from_the_last_fit(demos):
    policy = uc.ParametricPolicy().fit(demos.select(demos.episodes < 11))
    for episodes in (14, 18, 23):
        policy.fit(demos.select(demos.episodes < episodes), start=policy)
        assert (GROWN in describe_inferred(policy)) == (episodes == 23)


@pytest.mark.parametrize(
    "start", [uc.ParametricPolicy(), "inconsistency", uc.LocallyLinearPolicy(n_centers=15)], ids=str
)
def test_what_is_no_start_is_said(demos, start):
    if start == "inconsistency":
        start = uc.ParametricPolicy(risk="inconsistency").fit(demos)
    with pytest.raises(PolicyError, match="start= needs a ParametricPolicy"):
        uc.ParametricPolicy().fit(demos, start=start)
    with pytest.raises(PolicyError, match="partial_fit"):
        uc.ParametricPolicy(risk="inconsistency").fit(demos, start=start)
