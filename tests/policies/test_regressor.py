import numpy as np
import pytest
from hypothesis import given, settings
from sklearn.base import clone
from sklearn.cluster import KMeans
from sklearn.compose import TransformedTargetRegressor
from sklearn.ensemble import ExtraTreesRegressor, HistGradientBoostingRegressor
from sklearn.linear_model import Ridge
from sklearn.neighbors import KNeighborsRegressor, RadiusNeighborsRegressor
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer, StandardScaler
from sklearn.svm import SVR
from sklearn.utils.estimator_checks import parametrize_with_checks

import unconstrain as uc
from reproduction.adaptive.ways import add_noise
from reproduction.scores import nupe
from tests.problems import problems
from unconstrain.fitting.completion import ByRisk
from unconstrain.fitting.foreign import find_weight_option, goes_on
from unconstrain.fitting.observation import observe
from unconstrain.fitting.outliers import find_heavy_tailed
from unconstrain.limit_cycle import demonstrate

TREES = ExtraTreesRegressor(30, min_samples_leaf=3, random_state=0)
NEIGHBOURS = KNeighborsRegressor(5)


def split(**options):
    train, test = (demonstrate(**options, random_state=np.random.default_rng([200, i])) for i in (0, 1))
    noisy, _ = add_noise(train, 0.03, np.random.default_rng([200, 2]))
    return noisy, test


def learn(policy, demos, known=None):
    return policy.fit(demos.states, demos.actions, groups=demos.episodes, projections=known)


@parametrize_with_checks(
    [uc.RegressorPolicy(Ridge(), max_fits=20), uc.RegressorPolicy(NEIGHBOURS, risk="direct", prior="zero")],
    expected_failed_checks=lambda estimator: (
        {}
        if estimator.risk == "adaptive"
        else {
            f"check_sample_{name}": "neighbours take no weights, and that is said"
            for name in (
                "weights_pandas_series",
                "weights_not_an_array",
                "weights_list",
                "weights_shape",
                "weights_not_overwritten",
                "weight_equivalence_on_dense_data",
            )
        }
    ),
    xfail_strict=True,
)
def test_scikit_learn_estimator_checks(estimator, check):
    check(estimator)


@settings(deadline=None, max_examples=40)
@given(problems(min_samples=3))
def test_completed_actions_agree_with_the_samples_and_elsewhere_with_the_predictions(problem):
    _, Pi, N, U, rng = problem
    P, known = Pi + rng.normal(size=Pi.shape), np.where(rng.random(len(N)) < 0.5, 1.0, np.nan)
    observation = observe("inconsistency", U, N * known[:, None, None])
    Y = ByRisk(observation).complete(P)
    behind = np.einsum("nkd,nd->nk", observation.rows, Y)
    scale = np.abs(U).max() + np.abs(P).max()
    np.testing.assert_allclose(behind, observation.targets, atol=1e-9 * scale)
    # What a sample does not show stays, so the step is no longer than the distance to any consistent action.
    assert np.all(np.linalg.norm(Y - P, axis=1) <= np.linalg.norm(Pi - P, axis=1) + 1e-9 * scale)


@pytest.mark.parametrize("regressor", [TREES, NEIGHBOURS], ids=["trees", "neighbours"])
def test_contact_is_inferred_nearly_within_twice_of_being_told(regressor):
    demos, test = split(n_episodes=40, free=0.4)
    told = learn(uc.RegressorPolicy(regressor, risk="inconsistency"), demos, demos.projections)
    direct = learn(uc.RegressorPolicy(regressor, risk="direct"), demos)
    policy = learn(uc.RegressorPolicy(regressor), demos)
    errors = [nupe(test, each.predict(test.states)) for each in (told, policy, direct)]
    assert errors[1] < 2.2 * errors[0]
    assert errors[1] < 0.4 * errors[2]
    assert policy.n_fits_ <= 50
    assert next(iter(policy.log_likelihoods_)) != "all free"
    np.testing.assert_array_equal(
        policy.ordinary_regression().predict(test.states), direct.predict(test.states)
    )


def test_where_nothing_is_in_the_way_it_is_ordinary_regression():
    demos, test = split(n_episodes=40, free=1.0)
    policy = learn(uc.RegressorPolicy(TREES), demos)
    assert next(iter(policy.log_likelihoods_)) == "all free"
    assert policy.free_share_ == pytest.approx(1.0, abs=1e-3)
    direct = learn(uc.RegressorPolicy(TREES, risk="direct"), demos)
    np.testing.assert_allclose(policy.predict(test.states), direct.predict(test.states), rtol=1e-9)


def test_the_regressor_alone_says_nothing_beyond_its_own_values():
    demos, _ = split(n_episodes=8)
    far = np.full((1, 2), 50.0)
    alone, beside = (
        learn(uc.RegressorPolicy(NEIGHBOURS, prior=prior, max_fits=20), demos) for prior in ("zero", "linear")
    )
    assert np.linalg.norm(alone.predict(far)) < 5 < np.linalg.norm(beside.predict(far))
    np.testing.assert_array_equal(alone.regressor_.predict(far), alone.predict(far))


def test_scaled_actions_give_the_scaled_policy_and_fits_are_limited_and_repeat_themselves():
    demos, _ = split(n_episodes=8)
    policy = uc.RegressorPolicy(NEIGHBOURS, max_fits=20)
    P = learn(clone(policy), demos).predict(demos.states)
    again = clone(policy).fit(demos.states, 1e3 * demos.actions, groups=demos.episodes)
    np.testing.assert_allclose(again.predict(demos.states), 1e3 * P, rtol=1e-6, atol=1e-6)
    assert again.n_fits_ <= 20
    assert not hasattr(NEIGHBOURS, "n_features_in_")


def test_angles_that_wrap_are_one_place():
    angle = np.random.default_rng(0).uniform(-np.pi, np.pi, size=(200, 1))
    policy = uc.RegressorPolicy(NEIGHBOURS, space=uc.spaces.Angle(), max_fits=20).fit(angle, np.sin(angle))
    np.testing.assert_allclose(policy.predict(angle + 2 * np.pi), policy.predict(angle), atol=1e-9)


def test_a_regressor_that_works_in_place_changes_nothing_of_ours():
    demos, _ = split(n_episodes=6)
    X = demos.states + 3.0
    given, kept = X.copy(), X.copy()
    spoils = make_pipeline(StandardScaler(copy=False), NEIGHBOURS)
    spares = make_pipeline(StandardScaler(), NEIGHBOURS)
    P, Q = (
        uc.RegressorPolicy(each, max_fits=20).fit(given, demos.actions, groups=demos.episodes).predict(given)
        for each in (spoils, spares)
    )
    np.testing.assert_array_equal(given, kept)
    np.testing.assert_array_equal(P, Q)


def test_episodes_whose_rows_come_back_are_put_together():
    demos, _ = split(n_episodes=6)
    order = np.argsort(np.arange(len(demos.states)) % 40, kind="stable")
    X, U, G = demos.states, demos.actions, demos.episodes
    policy = uc.RegressorPolicy(NEIGHBOURS, max_fits=20)
    one = clone(policy).fit(X, U, groups=G)
    other = clone(policy).fit(X[order], U[order], groups=G[order])
    np.testing.assert_array_equal(other.predict(X), one.predict(X))
    free = other.free_probability(X[order], U[order], groups=G[order])
    np.testing.assert_array_equal(free, one.free_probability(X, U, groups=G)[order])


def test_what_goes_on_and_what_takes_weights():
    network = MLPRegressor()
    assert goes_on(network)
    assert goes_on(make_pipeline(StandardScaler(), network))
    for grows in (TREES, HistGradientBoostingRegressor(), NEIGHBOURS, SVR()):
        assert not goes_on(grows)
    assert find_weight_option(TREES) == "sample_weight"
    assert find_weight_option(make_pipeline(StandardScaler(), SVR())) == "svr__sample_weight"
    assert find_weight_option(NEIGHBOURS) is None


def test_a_network_goes_on_from_round_to_round():
    demos, _ = split(n_episodes=4)
    network = MLPRegressor(max_iter=5, random_state=0)
    policy = learn(uc.RegressorPolicy(network, max_fits=20), demos)
    assert not policy.regressor_.warm_start  # the one that is kept was fitted by itself
    assert not network.warm_start


def test_heavy_tails_are_gaussian_ones_where_residuals_are():
    rng = np.random.default_rng(0)
    E = 0.3 * rng.normal(size=(4000, 2))
    found = find_heavy_tailed(np.sum(E**2, axis=1), np.full(4000, 2.0), np.ones(4000), 0.0)
    assert found == pytest.approx(-np.log(2 * np.pi * 0.09) - 1, abs=0.03)


def test_a_saved_policy_is_the_same_and_its_parts_are_trusted_by_name(tmp_path):
    demos, _ = split(n_episodes=4)
    path, policy = tmp_path / "trees.skops", learn(uc.RegressorPolicy(TREES, max_fits=20), demos)
    policy.save(path)
    with pytest.raises(uc.errors.UntrustedArchiveError, match=r"load_policy\(path, trusted=\[") as caught:
        uc.load_policy(path)
    names = ("sklearn.ensemble._forest.ExtraTreesRegressor", "sklearn.tree._tree.Tree")
    assert caught.value.names == names
    loaded = uc.load_policy(path, trusted=names)
    np.testing.assert_array_equal(loaded.predict(demos.states), policy.predict(demos.states))
    np.testing.assert_array_equal(loaded.free_probability(demos), policy.free_probability(demos))
    own = make_pipeline(FunctionTransformer(lambda Z: Z), Ridge())
    with pytest.raises(uc.errors.UnconstrainError, match="lambda"):
        uc.RegressorPolicy(TransformedTargetRegressor(own), risk="direct").fit(demos).save(path)


@pytest.mark.parametrize(
    ("attempt", "sentence"),
    [
        (lambda D: uc.RegressorPolicy(None).fit(D), "regressor must be an estimator"),
        (lambda D: uc.RegressorPolicy(Ridge).fit(D), "regressor must be an estimator"),
        (lambda D: uc.RegressorPolicy(KMeans()).fit(D), "a KMeans is no regressor"),
        (lambda D: uc.RegressorPolicy(Ridge(), max_fits=19).fit(D), "max_fits"),
        (lambda D: uc.RegressorPolicy(Ridge(), prior="none").fit(D), "prior must be"),
        (lambda D: uc.RegressorPolicy(Ridge(), risk="corrected").fit(D), "risk must be"),
        (lambda D: uc.RegressorPolicy(Ridge(alpha=-1.0)).fit(D), "the Ridge cannot be fitted to .*alpha"),
        (lambda D: uc.RegressorPolicy(Ridge(), random_state=-1).fit(D), "random_state"),
        (
            lambda D: uc.RegressorPolicy(KNeighborsRegressor(100)).fit(D),
            "the KNeighborsRegressor cannot predict 80 samples: Expected n_neighbors",
        ),
        (
            lambda D: uc.RegressorPolicy(RadiusNeighborsRegressor(1e-3)).fit(D),
            "the RadiusNeighborsRegressor predicts NaN or infinity for",
        ),
        (
            lambda D: uc.RegressorPolicy(NEIGHBOURS).fit(D, sample_weight=np.ones(len(D.states))),
            "a KNeighborsRegressor does not take sample weights",
        ),
        (
            lambda D: uc.fit_stream(uc.RegressorPolicy(Ridge()), [D]),
            "a RegressorPolicy needs all samples at once",
        ),
        (lambda D: fitted(D).compile(), "a policy made of a Ridge cannot be compiled"),
        (lambda D: fitted(D).predict(D.states, return_std=True), "does not tell how sure it is"),
        (lambda D: uc.identifiability(fitted(D)), "linear in its parameters, .* got a RegressorPolicy"),
    ],
)
def test_mistakes_are_told_in_one_sentence(attempt, sentence):
    with pytest.raises(uc.errors.PolicyError, match=sentence):
        attempt(demonstrate(4, random_state=0))


def fitted(demos):
    return uc.RegressorPolicy(Ridge(), risk="direct").fit(demos)


def test_kinds_are_compared_on_episodes_that_none_has_seen():
    X = np.random.default_rng(0).uniform(-1, 1, size=(400, 2))
    N = uc.constraints.projection(np.random.default_rng(1).normal(size=(400, 1, 2)))
    U = np.einsum("nij,nj->ni", N, np.sin(6 * X))
    found = uc.select_policy(
        {"linear": uc.ParametricPolicy(), "neighbours": uc.RegressorPolicy(NEIGHBOURS, max_fits=20)}, X, U
    )
    assert found.name == "neighbours"
    assert all(np.isfinite(row.error) and np.isfinite(row.log_likelihood) for row in found.table)
    assert "| neighbours" in str(found.table)
