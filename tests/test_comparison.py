import pytest

import unconstrain as uc
from unconstrain.comparison import compare_risks
from unconstrain.demo import make_policy
from unconstrain.limit_cycle import demonstrate

DEMOS = demonstrate(20, random_state=0)
DATA = (DEMOS.states, DEMOS.actions, DEMOS.episodes)
RBF = make_policy()


def test_both_risks_are_judged_on_the_same_episodes():
    found = compare_risks(RBF, *DATA)
    assert found.policy.risk == "inconsistency"
    assert not hasattr(RBF, "solution_")
    assert list(found.by_risk()) == ["inconsistency", "direct"]
    assert found.by_risk()["inconsistency"] is found.kept
    assert found.kept.explained > 0.9 > found.other.explained
    assert found.chosen is None


def test_the_direct_policy_is_compared_with_the_other():
    found = compare_risks(uc.ParametricPolicy(risk="direct"), *DATA)
    assert (found.policy.risk, found.other_risk) == ("direct", "inconsistency")
    assert list(found.by_risk()) == ["inconsistency", "direct"]
    assert found.by_risk()["direct"] is found.kept


def test_a_policy_can_be_chosen_first():
    seen = []
    found = compare_risks(None, *DATA, progress=lambda row: seen.append(row.name))
    assert found.chosen is not None
    assert seen[-2:] == ["inconsistency", "direct"]
    assert found.chosen[next(iter(found.chosen)).name].error == pytest.approx(
        found.kept.error
    )


def test_known_projections_are_used_and_judged_by():
    found = compare_risks(RBF, *DATA, projections=DEMOS.projections)
    assert found.policy.n_known_constraints_ == len(DEMOS)
    assert found.measure == "held-out error of what is known"


def test_a_policy_that_cannot_be_fitted_is_told():
    with pytest.raises(uc.errors.PolicyError, match="n_centers"):
        compare_risks(uc.ParametricPolicy(uc.NormalizedRBF(0)), *DATA)
