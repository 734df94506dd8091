import pytest

import unconstrain as uc
from unconstrain.demo import draw_recordings, make_policy
from unconstrain.evaluation import compare_risks
from unconstrain.limit_cycle import demonstrate

DEMOS = demonstrate(20, random_state=0)
DATA = (DEMOS.states, DEMOS.actions, DEMOS.episodes)
RBF = make_policy("adaptive")


def test_all_risks_are_judged_on_the_same_episodes():
    found = compare_risks(RBF, *DATA)
    assert found.policy.risk == "adaptive"
    assert not hasattr(RBF, "solution_")
    assert list(found.rows) == ["adaptive", "inconsistency", "direct"]
    assert found.rows["adaptive"] is found.kept
    assert found.kept.explained > 0.9 > found.rows["direct"].explained
    assert found.better is None
    assert found.chosen is None


def test_the_direct_policy_is_told_what_is_better():
    found = compare_risks(make_policy("direct"), *DATA)
    assert found.policy.risk == "direct"
    assert found.kept is found.rows["direct"]
    assert found.better in ("adaptive", "inconsistency")


@pytest.mark.parametrize("noise", [0.05, 0.3])
@pytest.mark.parametrize("risk", ["direct", "inconsistency", "adaptive"])
def test_where_all_is_free_and_noisy_nothing_is_better_than_ordinary_regression(risk, noise):
    free = demonstrate(10, noise=noise, constrained=False, random_state=0)
    policy = uc.ParametricPolicy(uc.NormalizedRBF(), risk=risk)
    found = compare_risks(policy, free.states, free.actions, free.episodes)
    assert found.rows["adaptive"].error == pytest.approx(found.rows["direct"].error)
    assert found.rows["inconsistency"].error > found.rows["direct"].error
    assert found.better in ((None,) if risk != "inconsistency" else ("adaptive", "direct", None))


def test_on_the_demos_data_nothing_is_better_than_what_was_inferred():
    training, _ = draw_recordings(0)
    found = compare_risks(make_policy("adaptive"), training.states, training.actions, training.episodes)
    errors = {risk: row.error for risk, row in found.rows.items()}
    assert errors["adaptive"] < errors["inconsistency"] < errors["direct"]
    assert found.better is None


def test_a_policy_can_be_chosen_first():
    seen = []
    found = compare_risks(None, *DATA, progress=lambda row: seen.append(row.name))
    assert found.chosen is not None
    assert seen[-3:] == ["adaptive", "inconsistency", "direct"]
    assert found.chosen[next(iter(found.chosen)).name].error == pytest.approx(found.kept.error)


def test_known_projections_are_used_and_judged_by():
    found = compare_risks(RBF, *DATA, projections=DEMOS.projections)
    assert found.policy.n_known_constraints_ == len(DEMOS)
    assert found.measure == "held-out error of what is known"


def test_a_policy_that_cannot_be_fitted_is_told():
    with pytest.raises(uc.errors.PolicyError, match="n_centers"):
        compare_risks(uc.ParametricPolicy(uc.NormalizedRBF(0)), *DATA)
