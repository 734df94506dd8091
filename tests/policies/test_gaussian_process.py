import numpy as np
import pytest
from sklearn.gaussian_process.kernels import RBF, WhiteKernel
from sklearn.utils.estimator_checks import parametrize_with_checks

import unconstrain as uc
from benchmarks.gaussian_process import make_smooth
from tests.problems import rotation
from unconstrain.demo import FEW, draw_data, measure_errors
from unconstrain.limit_cycle import demonstrate


@parametrize_with_checks(
    [uc.GaussianProcessPolicy(RBF(1.0, "fixed"), risk="inconsistency")],
    # A number that is seen twice says how large the noise is, one of twice the weight does not.
    expected_failed_checks=lambda estimator: {"check_sample_weight_equivalence_on_dense_data": "noise"},
    xfail_strict=True,
)
def test_scikit_learn_estimator_checks(estimator, check):
    check(estimator)


def test_four_movements_are_learnt_where_the_paper_has_0_38():
    errors = []
    for seed in (3000, 3001, 3002):
        training, test = draw_data(seed)
        seen = training.select(training.episodes < FEW)
        policy = uc.GaussianProcessPolicy(make_smooth(2), risk="inconsistency")
        errors.append(
            measure_errors(policy.fit(seen.states, seen.actions, groups=seen.episodes), test)["nUPE"]
        )
    assert np.mean(errors) <= 0.15


@pytest.fixture(scope="module")
def mixed():
    demos = demonstrate(6, noise=0.03, free=0.5, random_state=5)
    return demos, uc.GaussianProcessPolicy(make_smooth(2)).fit(demos)


def test_contact_and_noise_are_found(mixed):
    demos, policy = mixed
    free = np.isclose(np.einsum("nii->n", demos.projections), 2)
    found = policy.free_probability(demos.states, demos.actions, groups=demos.episodes)
    assert np.mean((found > 0.5) == free) > 0.95
    assert next(iter(policy.log_likelihoods_)) != "all free"
    assert policy.noise_ == pytest.approx(0.03 * np.mean(demos.actions.std(axis=0)), rel=0.2)


def test_a_file_predicts_and_tells_how_sure_it_is_where_that_was_kept(mixed, tmp_path):
    demos, policy = mixed
    P, deviation = policy.predict(demos.states, return_std=True)
    policy.save(tmp_path / "all.skops", resumable=True)
    kept = uc.load_policy(tmp_path / "all.skops").predict(demos.states, return_std=True)
    np.testing.assert_array_equal(kept, (P, deviation))
    policy.save(tmp_path / "mean.skops")
    bare = uc.load_policy(tmp_path / "mean.skops")
    np.testing.assert_array_equal(bare.predict(demos.states), P)
    with pytest.raises(uc.errors.PolicyError, match="resumable=True"):
        bare.predict(demos.states, return_cov=True)


def test_the_policy_does_not_depend_on_origin_units_and_axes():
    demos = demonstrate(4, noise=0.05, random_state=7)
    X, U, test = demos.states, demos.actions, demos.states[::9]

    def learn(X, U, test):
        policy = uc.GaussianProcessPolicy(RBF(1.0), risk="inconsistency")
        return np.stack(policy.fit(X, U, groups=demos.episodes).predict(test, return_std=True))

    before, unit = learn(X, U, test), np.array([1e3, 1e-2])
    R = rotation(2, np.random.default_rng(0))
    tolerance = {"rtol": 0, "atol": 1e-3 * np.abs(before[0]).max()}
    np.testing.assert_allclose(learn((X + 8.0) * unit, U, (test + 8.0) * unit), before, **tolerance)
    np.testing.assert_allclose(learn(X, 100 * U, test) / 100, before, **tolerance)
    np.testing.assert_allclose(learn(X, U @ R, test)[0] @ R.T, before[0], **tolerance)


def test_known_projections_are_used():
    demos = demonstrate(4, random_state=9)
    fit = uc.GaussianProcessPolicy(make_smooth(2), risk="inconsistency").fit
    told = fit(demos.states, demos.actions, groups=demos.episodes, projections=demos.projections)
    assert told.n_known_constraints_ == len(demos.states)
    assert told.approximation_.startswith("the posterior is exact")


@pytest.mark.parametrize(
    ("kernel", "sentence"),
    [
        (RBF() + WhiteKernel(), "without its WhiteKernel"),
        ("rbf", "kernel must be"),
        (uc.kernels.CurlFree(), "as many actions as states"),
    ],
)
def test_a_kernel_that_will_not_do_is_refused_in_a_sentence(kernel, sentence):
    X = np.random.default_rng(0).normal(size=(20, 3))
    with pytest.raises(uc.errors.PolicyError, match=sentence):
        uc.GaussianProcessPolicy(kernel).fit(X, X[:, :2])
