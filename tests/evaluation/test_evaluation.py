"""What an evaluation says: of the policy, of what it is held against, and in its verdict."""

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.evaluation.alternatives import choose_missing, try_alternatives
from unconstrain.evaluation.fixed import find_fixed
from unconstrain.evaluation.jumps import find_jumps
from unconstrain.evaluation.turns import find_turn
from unconstrain.limit_cycle import demonstrate

RBF = uc.ParametricPolicy(uc.NormalizedRBF())


def strip(demos):
    """Return what a recording holds, without what only simulation knows."""
    return uc.Demonstrations(demos.states, demos.actions, demos.episodes, demos.time)


def move(paths, dt=0.02, noise=0.0):
    """Make demonstrations of paths, each (T, n)."""
    rng = np.random.default_rng(0)
    X = np.concatenate(paths)
    U = np.concatenate([np.gradient(path, dt, axis=0) for path in paths])
    time = np.concatenate([dt * np.arange(len(path)) for path in paths])
    episodes = np.repeat(np.arange(len(paths)), [len(path) for path in paths])
    return uc.Demonstrations(X, U + noise * rng.normal(size=U.shape), episodes, time)


@pytest.fixture(scope="module")
def bent():
    policy = RBF.__sklearn_clone__().fit(strip(demonstrate(20, random_state=0)))
    return policy, strip(demonstrate(5, random_state=1))


def test_a_policy_stands_beside_ordinary_regression_and_standing_still(bent):
    policy, others = bent
    found = uc.evaluate(policy, others)
    assert [each.name for each in found.scores] == ["policy", "ordinary regression", "standing still"]
    assert found.policy.shown > 0.9 > 0.8 > found.regression.shown
    assert found.policy.log_likelihood > found.regression.log_likelihood > found.scores[2].log_likelihood
    assert found.scores[2].whole == found.scores[2].shown == 0.0
    assert found.policy.rmse == pytest.approx(
        uc.metrics.root_mean_square(others.actions, policy.predict(others.states))
    )
    direct = RBF.__sklearn_clone__().set_params(risk="direct").fit(strip(demonstrate(20, random_state=0)))
    assert found.regression.rmse == pytest.approx(
        uc.metrics.root_mean_square(others.actions, direct.predict(others.states)), rel=1e-6
    )
    assert "a varying constraint seems to have bent" in found.verdict.sentence
    assert "ordinary regression explains" in found.verdict.sentence
    assert str(found).endswith(f"verdict: {found.verdict}")
    assert found.to_pandas().loc["policy", "rmse"] == found.policy.rmse
    assert "<td>standing still</td>" in found._repr_html_()


def test_what_the_policy_knows_of_regression_is_saved_and_lost_when_it_learns_on(bent, tmp_path):
    policy, others = bent
    policy.save(tmp_path / "p.skops", resumable=True)
    loaded = uc.load_policy(tmp_path / "p.skops")
    assert uc.evaluate(loaded, others).regression == uc.evaluate(policy, others).regression
    loaded.partial_fit(others)
    assert loaded.ordinary_regression() is None
    assert "learnt from these recordings alone" in str(uc.evaluate(loaded, others))


def test_regression_of_what_known_constraints_let_through_is_not_ordinary():
    demos = demonstrate(6, random_state=0)
    told, direct = (uc.ParametricPolicy(risk=risk).fit(demos) for risk in ("adaptive", "direct"))
    assert told.n_known_constraints_ == len(demos)
    known = told.ordinary_regression()
    assert np.allclose(known.predict(demos.states), direct.predict(demos.states))
    assert known.distance(demos.states[:1])[0] == 0.0


def test_arrays_will_do_and_nonsense_is_refused(bent):
    policy, others = bent
    assert uc.evaluate(policy, others.states, others.actions, groups=others.episodes).policy.rmse > 0
    with pytest.raises(uc.errors.DataError, match="give the actions beside the states"):
        uc.evaluate(policy, others.states)
    with pytest.raises(uc.errors.DataError, match="choose the columns"):
        uc.evaluate(policy, others.states[:, :1], others.actions)
    with pytest.raises(uc.errors.PolicyError, match="got LimitCycle"):
        uc.evaluate(uc.limit_cycle.LimitCycle(), others)


def test_where_nothing_is_in_the_way_the_verdict_says_so():
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, size=(400, 2))
    demos = uc.Demonstrations(X, 1 - 2 * X + 0.1 * rng.normal(size=(400, 2)), np.repeat(range(8), 50))
    policy = uc.ParametricPolicy().fit(demos.select(demos.episodes < 4))
    found = uc.evaluate(policy, demos.select(demos.episodes >= 4))
    assert found.policy.free == pytest.approx(1.0, abs=0.02)
    assert "no varying constraint was found" in found.verdict.sentence
    assert "it was not followed, as the recordings have no time" in found.verdict.sentence
    assert not found.verdict.is_safe
    timed = uc.Demonstrations(demos.states, demos.actions, demos.episodes, np.tile(0.02 * np.arange(50), 8))
    assert uc.evaluate(policy, timed).verdict.is_safe
    assert "6 samples are too few" in uc.evaluate(policy, timed.select(slice(6))).verdict.sentence


def test_motion_that_never_leaves_a_plane_says_nothing_of_the_policy_across_it():
    flat = demonstrate(12, constrained=False, random_state=0)
    pad = np.column_stack
    demos = uc.Demonstrations(
        pad([flat.states, np.ones(len(flat))]), pad([flat.actions, np.zeros(len(flat))]), flat.episodes
    )
    found = uc.evaluate(uc.ParametricPolicy(risk="direct").fit(demos), demos)
    assert "1.000 u3 ≈ 0, so nothing is known of the policy across that" in found.verdict.sentence


def test_metres_beside_degrees_are_not_taken_for_motion_that_never_is():
    rng = np.random.default_rng(0)
    x, scale = rng.normal(size=300), np.array([60.0, 0.2, 0.2])
    demos = uc.Demonstrations(np.zeros((300, 3)), np.column_stack([rng.normal(size=300), x, 2 * x]) * scale)
    assert len(find_fixed(demos)) == 2
    assert find_fixed(demos, scale) == ("0.894 u2 - 0.447 u3 ≈ 0",)


def test_of_many_equations_the_verdict_says_how_many():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(200, 12)) @ rng.normal(size=(12, 12))
    U = -X @ np.linalg.svd(rng.normal(size=(12, 6)), full_matrices=False)[0] @ rng.normal(size=(6, 12))
    demos = uc.Demonstrations(X, U, np.arange(200) // 20, np.arange(200) * 0.01)
    said = str(uc.evaluate(uc.ParametricPolicy().fit(demos), demos).verdict)
    assert "nothing moves along 6 of 12 directions" in said
    assert "≈" not in said


def reaches(rng):
    """Ways that slow down, each to a goal of its own."""
    share = 1 - np.exp(-np.linspace(0, 5, 60))[:, None]
    return [a + share * (b - a) for a, b in rng.normal(size=(8, 2, 2))]


def eights(rng):
    """Figures of eight, which cross themselves."""
    t = np.linspace(0, 2 * np.pi, 200)
    return [np.column_stack([np.sin(t), np.sin(2 * t)]) + 0.02 * rng.normal(size=2) for _ in range(6)]


def circles(rng):
    """Circles about a centre that wanders."""
    t = np.linspace(0, 60, 3000)
    drift = 5 * np.column_stack([np.sin(0.1 * t), np.cos(0.07 * t)])
    return [drift + np.column_stack([np.cos(5 * t), np.sin(5 * t)])]


@pytest.mark.parametrize(
    ("draw", "options"),
    [
        (reaches, {"--relative-to goal", "--relative-to goal --model linear"}),
        (eights, {"--order 2", "--phase"}),
        (circles, {"--moving-centre 0.5 --model linear", "--moving-centre 0.5"}),
    ],
)
def test_what_is_missing_is_named_with_its_option(draw, options):
    demos = move(draw(np.random.default_rng(0)))
    policy = uc.ParametricPolicy(uc.NormalizedRBF(16), risk="direct", alpha=1e-3).fit(demos)
    explained = policy.score(demos.states, demos.actions)
    missing = choose_missing(explained, try_alternatives(policy, demos))
    assert missing is not None
    assert missing.option in options
    assert missing.explained > 0.9
    assert not any(
        missing.option.startswith(each.option)
        for each in try_alternatives(
            policy, demos, without=("relative_to", "moving_centre", "order", "phase")
        )
    )


def test_jumps_of_a_tracker_are_told_from_motion():
    demos = move(circles(np.random.default_rng(0)))
    assert find_jumps(demos.actions) is None
    assert find_turn(demos) == pytest.approx(2 * np.pi / 5, rel=0.05)
    U = demos.actions.copy()
    U[::150] *= 40
    found = find_jumps(U)
    assert found is not None
    assert np.array_equal(np.flatnonzero(found.are), np.arange(0, 3000, 150))
