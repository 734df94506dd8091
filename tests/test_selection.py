import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.base import clone
from sklearn.linear_model import Ridge
from sklearn.preprocessing import SplineTransformer

import unconstrain as uc
from unconstrain import judging
from unconstrain import limit_cycle as toy
from unconstrain.demo import draw_recordings, make_policy
from unconstrain.fitting import solve as selection
from unconstrain.selection import candidates

DEMOS = toy.demonstrate(random_state=0)
X, U, EPISODES = DEMOS.states, DEMOS.actions, DEMOS.episodes


def joints(n_episodes=40, length=25, n=4, random_state=0):
    rng = np.random.default_rng(random_state)
    x = rng.uniform(-1, 1, size=(n_episodes * length, n))
    N = uc.constraints.projection(rng.normal(size=(n_episodes, 2, n))).repeat(length, axis=0)
    Pi = -0.3 * np.sign(x) * np.abs(x) ** 0.5
    return x, np.einsum("nij,nj->ni", N, Pi), Pi, np.repeat(np.arange(n_episodes), length)


def test_on_the_limit_cycle_the_choice_is_among_the_best_though_no_truth_is_seen():
    demos = draw_recordings(0)[0]
    best = uc.select_policy("auto", demos.states, demos.actions, demos.episodes)
    unseen = toy.demonstrate(random_state=1)
    errors = {
        name: uc.metrics.unconstrained_policy_error(unseen.policy, policy.predict(unseen.states))
        for name, policy in best.policies.items()
    }
    assert errors[best.name] <= 2 * min(errors.values())
    # It turns: neither one joint at a time nor downhill.
    assert best.table["decoupled"].error > 30 * best.table[best.name].error
    assert best.table["potential"].error > 30 * best.table[best.name].error


def test_joints_that_go_their_own_way_are_recognised():
    states, actions, Pi, episodes = joints()
    best = uc.select_policy("auto", states, actions, episodes)
    assert best.name in ("decoupled", "decoupled, coarse")
    error = uc.metrics.unconstrained_policy_error(Pi, best.policy.predict(states))
    assert uc.metrics.normalized(error, Pi) < 0.01


def test_the_winner_is_the_candidate_fitted_to_everything():
    policy = uc.ParametricPolicy(uc.NormalizedRBF(), alpha="cv")
    best = uc.select_policy({"rbf": policy, "line": uc.ParametricPolicy()}, X, U, EPISODES)
    assert best.name == "rbf"
    expected = policy.fit(X, U, groups=EPISODES)
    np.testing.assert_array_equal(best.policy.predict(X), expected.predict(X))
    assert best.table["rbf"].alpha == expected.alpha_
    assert best.table["rbf"].n_parameters == expected.weights_.size
    fixed = uc.ParametricPolicy(uc.NormalizedRBF(), alpha=1e-3)
    chosen = uc.select_policy([fixed], X, U, EPISODES).policy
    assert chosen.alpha == chosen.alpha_ == 1e-3
    np.testing.assert_allclose(chosen.predict(X), fixed.fit(X, U, groups=EPISODES).predict(X), atol=1e-8)


CENTERS = X[::100].copy()


def held_out_predictions(policy, X, U, groups):
    """What a copy of the policy, fitted anew to the other folds, predicts for each."""
    predictions = np.empty_like(U)
    for train, test in selection.splits(len(U), groups):
        several = groups is not None and len(np.unique(groups[train])) > 1
        left = clone(policy).fit(X[train], U[train], groups=groups[train] if several else None)
        predictions[test] = left.predict(X[test])
    return predictions


@settings(deadline=None, max_examples=10)
@given(
    st.sampled_from(
        [
            uc.ParametricPolicy(alpha=1e-3, risk="inconsistency"),
            uc.ParametricPolicy(alpha=1e-3, risk="direct"),
            uc.ParametricPolicy(
                uc.NormalizedRBF(centers=CENTERS, width=0.5), risk="inconsistency", alpha=1e-3
            ),
            uc.LocallyLinearPolicy(centers=CENTERS, width=0.5, risk="inconsistency", alpha=1e-3),
        ]
    ),
    st.booleans(),
    st.integers(2, 40),
)
def test_leaving_a_fold_out_of_the_sums_is_fitting_without_it(policy, episodic, n_episodes):
    rows = n_episodes > EPISODES
    groups = EPISODES[rows] if episodic else None
    table = uc.select_policy({"it": policy}, X[rows], U[rows], groups).table
    predictions = held_out_predictions(policy, X[rows], U[rows], groups)
    free = np.full(len(predictions), float(policy.risk == "direct"))
    expected = uc.metrics.shown_error(U[rows], predictions, free)
    assert table["it"].error == pytest.approx(expected, rel=1e-6)
    assert table["it"].explained == pytest.approx(uc.metrics.explained(U[rows], predictions, free))


@pytest.mark.parametrize("n_episodes", [2, 3])
def test_so_few_episodes_that_alpha_is_chosen_within_one(n_episodes):
    rows = n_episodes > EPISODES
    best = uc.select_policy([uc.ParametricPolicy(alpha="cv")], X[rows], U[rows], EPISODES[rows])
    assert np.isfinite(best.table.rows[0].error)


def test_standard_errors_are_those_of_the_folds():
    policy = uc.ParametricPolicy(risk="inconsistency", alpha=1e-3)
    row = uc.select_policy([policy], X, U, EPISODES).table.rows[0]
    predictions = held_out_predictions(policy, X, U, EPISODES)
    errors = [
        uc.metrics.inconsistency(U[test], predictions[test]) for _, test in selection.splits(len(X), EPISODES)
    ]
    assert row.standard_error == pytest.approx(np.std(errors, ddof=1) / np.sqrt(5), rel=1e-6)


def test_a_candidate_that_fails_is_listed_with_its_sentence():
    done = []
    best = uc.select_policy(
        {
            "square": uc.ParametricPolicy(uc.DecoupledFeatures()),
            "risky": uc.ParametricPolicy(risk="none"),
            "broken": uc.ParametricPolicy(SplineTransformer(n_knots=1)),
            "line": uc.ParametricPolicy(),
        },
        X,
        U[:, 0],
        EPISODES,
        progress=lambda row: done.append(row.name),
    )
    assert best.name == "line"
    assert best.policy.predict(X).shape == (len(X),)
    assert "as many actions as states" in best.table["square"].problem
    assert "risk must be one of" in best.table["risky"].problem
    assert best.table["broken"].problem
    assert done == ["square", "risky", "broken", "line"]
    text = str(best)
    assert text.startswith("| candidate")
    assert "square: DecoupledFeatures needs" in text
    assert text.endswith("chosen: line")
    assert "nan" not in text


RISKS = ("direct", "inconsistency", "adaptive")


@pytest.mark.parametrize(
    ("free", "noise"), [(0.0, 0.05), (0.0, 0.2), (0.5, 0.05), (0.5, 0.2), (1.0, 0.05), (1.0, 0.2)]
)
def test_the_order_of_errors_is_that_of_the_true_ones(free, noise):
    demos = toy.demonstrate(noise=noise, free=free, constrained=free < 1, random_state=0)
    unseen = toy.demonstrate(random_state=1)
    best = uc.select_policy(
        {risk: make_policy(risk) for risk in RISKS}, demos.states, demos.actions, demos.episodes
    )
    true = {
        risk: uc.metrics.unconstrained_policy_error(unseen.policy, policy.predict(unseen.states))
        for risk, policy in best.policies.items()
    }
    assert best.table.measure == judging.OF_WHAT_IS_SHOWN
    for one, other in itertools.combinations(RISKS, 2):
        if true[one] != pytest.approx(true[other]):  # "all free" is ordinary regression
            assert (best.table[one].error < best.table[other].error) == (true[one] < true[other]), (
                one,
                other,
            )


@pytest.mark.parametrize(
    ("risks", "projections", "measure"),
    [
        (["inconsistency"], None, judging.INCONSISTENCY),
        (["direct"], None, judging.OF_WHOLE_ACTIONS),
        (["direct", "inconsistency"], None, judging.OF_WHAT_IS_SHOWN),
        (["adaptive"], None, judging.OF_WHAT_IS_SHOWN),
        (["adaptive", "direct"], DEMOS.projections, judging.OF_WHAT_IS_KNOWN),
    ],
)
def test_the_table_says_what_it_judges_by(risks, projections, measure):
    policies = {risk: uc.ParametricPolicy(risk=risk) for risk in risks}
    table = uc.select_policy(policies, X, U, EPISODES, projections=projections).table
    assert table.measure == measure
    assert measure in str(table)
    assert {row.name for row in table} == set(risks)


def test_where_risks_differ_and_none_infers_contact_a_fit_that_does_is_the_judge():
    free = toy.demonstrate(noise=0.2, constrained=False, random_state=0)
    data = (free.states, free.actions, free.episodes)
    two, three = (uc.select_policy({r: make_policy(r) for r in risks}, *data) for risks in (RISKS[:2], RISKS))
    assert two.name == "direct"
    for name in RISKS[:2]:
        assert two.table[name].error == pytest.approx(three.table[name].error)


def test_candidates_are_left_alone_and_named_apart():
    policies = [uc.ParametricPolicy(), uc.ParametricPolicy(), uc.LocallyLinearPolicy(n_centers=9)]
    table = uc.select_policy(policies, X[:200], U[:200], EPISODES[:200], n_jobs=2).table
    assert {row.name for row in table} == {
        "ParametricPolicy()",
        "ParametricPolicy() (2)",
        "LocallyLinearPolicy(n_centers=9)",
    }
    assert not any(hasattr(policy, "solution_") for policy in policies)
    assert [row.error for row in table] == sorted(row.error for row in table)


@pytest.mark.parametrize(("n", "d"), [(1, 1), (2, 2), (7, 7), (6, 3), (27, 27)])
def test_default_candidates_can_be_solved_in_seconds_whatever_the_dimension(n, d):
    named = candidates(n, d)
    assert ("decoupled, coarse" in named) == ("potential" in named) == (n == d)
    X, U = np.random.default_rng(0).normal(size=(120, n)), np.random.default_rng(1).normal(size=(120, d))
    for name, policy in named.items():
        *models, parameters, _ = (
            policy.set_params(alpha=1.0, risk="inconsistency").fit(X, U).moments_[0].g.shape
        )
        assert np.prod(models) * parameters**3 <= 1.1e9, name


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: uc.select_policy("best", X, U), 'or "auto"'),
        (lambda: uc.select_policy([], X, U), "no candidates"),
        (lambda: uc.select_policy([Ridge()], X, U), "must be a policy of unconstrain, got Ridge"),
        (lambda: uc.select_policy("auto", X, U[:3]), "inconsistent numbers"),
        (lambda: uc.select_policy("auto", X, 0 * U), "all actions are zero"),
        (lambda: uc.select_policy("auto", X, U, np.zeros(len(X))), "at least two episodes"),
        (lambda: uc.select_policy("auto", X, U, [1, 2]), "one label a sample"),
        (
            lambda: uc.select_policy([uc.ParametricPolicy(uc.DecoupledFeatures())], X, U[:, 0]),
            "^DecoupledFeatures needs as many actions",
        ),
    ],
)
def test_mistakes_are_told_in_one_sentence(call, sentence):
    with pytest.raises(uc.errors.UnconstrainError, match=sentence) as caught:
        call()
    assert "\n" not in str(caught.value)
