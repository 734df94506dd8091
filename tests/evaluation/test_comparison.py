import numpy as np
import pytest

import unconstrain as uc
from unconstrain.demo import draw_recordings, make_policy
from unconstrain.evaluation import Comparison, compare_risks, evaluate_held_out
from unconstrain.judging import Judge
from unconstrain.limit_cycle import demonstrate
from unconstrain.selection import Row

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


def compared(**shares):
    """A comparison of an adaptive policy and ordinary regression that explain these shares of each of three folds."""
    rows = {
        risk: Row(
            risk,
            error=1 - np.mean(each),
            explained=float(np.mean(each)),
            by_fold=tuple(1 - np.array(each)),
            explained_by_fold=each,
        )
        for risk, each in shares.items()
    }
    judge = Judge("", np.ones(1))
    return Comparison(RBF, rows, "", policies={}, predictions={}, judge=judge)


def test_ordinary_regression_only_has_to_explain_more_in_all_and_in_the_middle_fold():
    assert compared(adaptive=(0.7, 0.8, 0.7), direct=(0.8, 0.7, 0.9)).better == "direct"
    assert compared(adaptive=(0.7, 0.8, 0.7), inconsistency=(0.8, 0.7, 0.9)).better is None
    one_fold_goes_where_no_other_went = compared(adaptive=(0.99, 0.98, -200.0), direct=(0.3, 0.4, 0.3))
    assert one_fold_goes_where_no_other_went.better is None
    nothing_but_rounding = compared(adaptive=(1 - 1e-9,) * 3, direct=(1.0,) * 3)
    assert nothing_but_rounding.better is None


def test_what_is_evaluated_is_the_policy_that_is_kept_and_its_movements_if_it_is_stable_are_followed():
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, size=(200, 2))
    time = np.tile(0.02 * np.arange(25), 8)
    demos = uc.Demonstrations(X, 3 * X + 0.1 * rng.normal(size=X.shape), np.repeat(range(8), 25), time)
    found = compare_risks(uc.ParametricPolicy(), demos, groups=demos.folds())
    plain = evaluate_held_out(found, demos, label="saved")
    assert plain.scores[0].name == "adaptive (saved)"
    assert "recorded starts it leaves what was recorded" in plain.verdict.sentence
    stable = evaluate_held_out(found, demos, stable=found.policy.stabilized([0.0, 0.0], demos))
    assert "leaves what was recorded" not in stable.verdict.sentence
    away = evaluate_held_out(found, demos, stable=found.policy.stabilized([30.0, 0.0], demos))
    assert "its goal lies outside of what was recorded" in away.verdict.sentence
    direct = evaluate_held_out(found.taking("direct"), demos)
    assert direct.policy.name == "ordinary regression (taken)"
    assert direct.policy.rmse == direct.regression.rmse
