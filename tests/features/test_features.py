import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.base import clone
from sklearn.preprocessing import PolynomialFeatures, SplineTransformer
from sklearn.utils.estimator_checks import (
    check_estimator_cloneable,
    check_estimator_repr,
    check_get_params_invariance,
    check_no_attributes_set_in_init,
    check_parameters_default_constructible,
    check_set_params,
)

import unconstrain as uc
from unconstrain.fitting.kernels import parametric, reference
from unconstrain.fitting.observation import observe

SQUARE = [
    uc.DecoupledFeatures(),
    uc.DecoupledFeatures(4, degree=1, extrapolation="constant"),
    uc.DecoupledFeatures(2, degree=1),
    uc.PotentialFeatures(uc.NormalizedRBF(12)),
    uc.PotentialFeatures(SplineTransformer(extrapolation="linear")),
    uc.PotentialFeatures(SplineTransformer(extrapolation="continue", include_bias=False)),
    uc.PotentialFeatures(PolynomialFeatures(3)),
    uc.PotentialFeatures(PolynomialFeatures(3, interaction_only=True, include_bias=False)),
]
seeds = st.integers(0, 2**32 - 1)


def joints(p=1.5, n_episodes=60, length=30, n=7, rows=3, random_state=0):
    """Like the arm: each joint goes to its middle, `pi = -0.05 ∇ Σ|x|^p`, behind random constraints."""
    rng = np.random.default_rng(random_state)

    def policy(x):
        return -0.05 * p * np.sign(x) * np.abs(x) ** (p - 1)

    x = rng.uniform(-1.5, 1.5, size=(n_episodes, n))
    N = uc.constraints.projection(rng.normal(size=(n_episodes, rows, n)))
    X, U = [], []
    for _ in range(length):
        X.append(x)
        U.append(np.einsum("eij,ej->ei", N, policy(x)))
        x = x + U[-1]
    X, U = (np.stack(A, axis=1).reshape(-1, n) for A in (X, U))
    return X, U, policy(X), np.repeat(np.arange(n_episodes), length)


@settings(deadline=None, max_examples=20)
@given(st.sampled_from(SQUARE), seeds, st.integers(1, 4))
def test_what_is_seen_along_a_direction_is_that_part_of_the_policy(features, seed, n):
    rng = np.random.default_rng(seed)
    X, Q = rng.normal(size=(2, 30, n))
    fitted = clone(features).fit(X[:20], n)
    w = rng.normal(size=fitted.along(X[:1], Q[:1]).shape[1])
    far = np.vstack([X, 3 * X[:5]])
    Q = np.vstack([Q, Q[:5]])
    seen, whole = fitted.along(far, Q) @ w, fitted.evaluate(far, w)
    np.testing.assert_allclose(seen, np.sum(Q * whole, axis=1), atol=1e-9 * (1 + np.abs(whole).max()))


@settings(deadline=None, max_examples=20)
@given(st.sampled_from([f for f in SQUARE if isinstance(f, uc.PotentialFeatures)]), seeds, st.integers(1, 4))
def test_the_policy_is_the_downhill_gradient_of_the_potential(features, seed, n):
    rng = np.random.default_rng(seed)
    X, h = rng.normal(size=(30, n)), 1e-6
    fitted = clone(features).fit(X[:20], n)
    w = rng.normal(size=fitted.along(X[:1], X[:1]).shape[1])
    steps = h * np.eye(n)[:, None]
    differences = np.stack([fitted.potential(X - e, w) - fitted.potential(X + e, w) for e in steps], axis=1)
    actions = fitted.evaluate(X, w)
    # The outermost states lie on a border, where the second derivative may jump: an error of the order of h there.
    np.testing.assert_allclose(differences / (2 * h), actions, atol=1e-5 * (1 + np.abs(actions).max()))


def test_potentials_stay_finite_and_flat_far_away():
    X = np.random.default_rng(0).normal(size=(50, 2))
    fitted = uc.PotentialFeatures(uc.NormalizedRBF(9)).fit(X, 2)
    assert np.isfinite(fitted.evaluate(1e6 * X, np.ones(9))).all()


@pytest.mark.parametrize("features", SQUARE)
@pytest.mark.parametrize("case", ["inconsistency", "direct", "known"])
def test_moments_are_those_of_the_rows(features, case):
    rng = np.random.default_rng(0)
    X, U = rng.normal(size=(2, 50, 3))
    N = uc.constraints.projection(rng.normal(size=(50, 1, 3))) if case == "known" else None
    observation = observe("direct" if case == "direct" else "inconsistency", U, N)
    fitted, weights = clone(features).fit(X, 3), rng.random(50)
    moments, expected = (way.moments(fitted, X, observation, weights) for way in (parametric, reference))
    np.testing.assert_allclose(moments.H, expected.H, atol=1e-11 * np.abs(expected.H).max())
    np.testing.assert_allclose(moments.g, expected.g, atol=1e-11 * np.abs(expected.H).max())


@pytest.mark.parametrize(("p", "reach"), [(1.5, 0.02), (1.8, 0.002)])
def test_decoupled_features_learn_a_decoupled_policy_where_local_models_cannot(p, reach):
    X, U, Pi, episodes = joints(p)
    # So few data suffice for fewer knots than the default; with those, single samples at the ends choose λ.
    policy = uc.ParametricPolicy(uc.DecoupledFeatures(15), alpha="cv").fit(X, U, groups=episodes)
    unseen, _, Pi, _ = joints(p, random_state=1)
    error = uc.metrics.normalized(uc.metrics.unconstrained_policy_error(Pi, policy.predict(unseen)), Pi)
    local = uc.LocallyLinearPolicy(width=3**0.5, alpha="cv").fit(X, U, groups=episodes).predict(unseen)
    assert error < reach
    assert error < 0.1 * uc.metrics.normalized(uc.metrics.unconstrained_policy_error(Pi, local), Pi)


def test_potential_features_need_fewer_data_than_full_ones():
    centre = np.array([0.3, -0.2, 0.1])

    def policy(X):
        away = X - centre
        return -away * np.exp(-np.sum(away**2, axis=1, keepdims=True))

    def error(features, seed):
        rng = np.random.default_rng(seed)
        X, unseen = rng.uniform(-1, 1, size=(60, 3)), rng.uniform(-0.9, 0.9, size=(500, 3))
        U = np.einsum("nij,nj->ni", uc.constraints.projection(rng.normal(size=(60, 2, 3))), policy(X))
        learnt = uc.ParametricPolicy(features, risk="inconsistency", alpha="cv").fit(X, U).predict(unseen)
        return uc.metrics.normalized(
            uc.metrics.unconstrained_policy_error(policy(unseen), learnt), policy(unseen)
        )

    basis = uc.NormalizedRBF(60, width=0.8)
    down = np.mean([error(uc.PotentialFeatures(basis), seed) for seed in range(4)])
    full = np.mean([error(basis, seed) for seed in range(4)])
    assert down < 0.1
    assert down < 0.5 * full


def test_a_joint_that_never_moves_is_learnt_as_a_constant():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(200, 2))
    X[:, 1] = 1e3
    policy = uc.ParametricPolicy(uc.DecoupledFeatures(), alpha="cv").fit(
        X, np.column_stack([X[:, 0], np.ones(200)])
    )
    np.testing.assert_allclose(policy.predict(X)[:, 1], 1.0, atol=1e-2)
    assert np.isfinite(policy.predict([[0.0, 0.0]])).all()


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_beyond_the_data_a_decoupled_policy_goes_on_straight(degree):
    X = np.random.default_rng(0).uniform(-1, 1, size=(300, 3))
    policy = uc.ParametricPolicy(uc.DecoupledFeatures(degree=degree), alpha=1e-9).fit(X, -2 * X)
    far = np.array([[-5.0, 5.0, 0.0], [5.0, -0.5, -5.0]])
    np.testing.assert_allclose(policy.predict(far), -2 * far, atol=1e-4)


@pytest.mark.parametrize("features", SQUARE)
def test_streams_files_and_clones_treat_them_like_any_other(features, tmp_path):
    X, U, _, episodes = joints(n_episodes=10, length=20, n=2, rows=1)
    policy = uc.ParametricPolicy(features, risk="inconsistency", alpha="cv").fit(X, U, groups=episodes)
    assert set(vars(features)) == set(features.get_params(deep=False))  # what is learnt stays in the policy
    again = clone(policy).partial_fit(X, U, groups=episodes)
    np.testing.assert_allclose(again.predict(X), policy.predict(X), atol=1e-9)
    policy.save(tmp_path / "policy.skops")
    np.testing.assert_array_equal(uc.load_policy(tmp_path / "policy.skops").predict(X), policy.predict(X))
    # In pieces, after a first one that places knots and centres.
    pieces = clone(policy).fit(X, U, groups=episodes)
    more, more_U, _, _ = joints(n_episodes=5, length=20, n=2, rows=1, random_state=1)
    pieces.partial_fit(more[:37], more_U[:37], groups=np.arange(37) // 20 + 100)
    pieces.partial_fit(more[37:], more_U[37:], groups=np.arange(37, 100) // 20 + 100)
    at_once = clone(policy).fit(X, U, groups=episodes)
    at_once.partial_fit(more, more_U, groups=np.arange(100) // 20 + 100)
    assert at_once.alpha_ == pytest.approx(pieces.alpha_)
    np.testing.assert_allclose(at_once.predict(X), pieces.predict(X), rtol=1e-5, atol=1e-7)


# Scikit-learn's other checks fit to 1-D targets or to states and actions of different dimensions, which these
# features refuse; what those check is the policy's own business and is checked with other features.
@pytest.mark.parametrize("features", [*SQUARE, uc.PotentialFeatures()])
def test_scikit_learn_checks_that_do_not_fit(features):
    for estimator in (features, uc.ParametricPolicy(features)):
        name = type(estimator).__name__
        for check in (
            check_estimator_cloneable,
            check_estimator_repr,
            check_get_params_invariance,
            check_no_attributes_set_in_init,
            check_parameters_default_constructible,
            check_set_params,
        ):
            check(name, estimator)


X, U = np.random.default_rng(0).normal(size=(2, 20, 3))


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: uc.ParametricPolicy(uc.DecoupledFeatures()).fit(X, U[:, :2]), "got 3 states and 2 actions"),
        (lambda: uc.ParametricPolicy(uc.PotentialFeatures()).fit(X, U[:, :2]), "got 3 states and 2 actions"),
        (lambda: uc.ParametricPolicy(uc.DecoupledFeatures(1)).fit(X, U), "n_knots must be a whole number"),
        (lambda: uc.ParametricPolicy(uc.DecoupledFeatures(degree=0)).fit(X, U), "degree must be"),
        (
            lambda: uc.ParametricPolicy(uc.DecoupledFeatures(extrapolation="error")).fit(X, U),
            "extrapolation must be",
        ),
        (lambda: uc.ParametricPolicy(uc.PotentialFeatures("rbf")).fit(X, U), "gradient of its basis"),
        (
            lambda: uc.ParametricPolicy(
                uc.PotentialFeatures(SplineTransformer(extrapolation="periodic"))
            ).fit(X, U),
            "gradient of its basis, .*got SplineTransformer",
        ),
        (lambda: uc.ParametricPolicy(uc.DecoupledFeatures).fit(X, U), "features must be"),
    ],
)
def test_mistakes_are_told_in_one_sentence(call, sentence):
    with pytest.raises(uc.errors.UnconstrainError, match=sentence) as caught:
        call()
    assert "\n" not in str(caught.value)
