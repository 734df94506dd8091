"""Learnt constraints: exact where the model holds the truth, and honest where there is none to be found."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.base import clone
from sklearn.exceptions import NotFittedError

import unconstrain as uc
from reproduction.plants import arm


def constrained(A, Pi):
    N = uc.constraints.projection(A)
    return N, np.einsum("nij,nj->ni", N, Pi)


def nppe(Pi, N, learnt):
    return uc.metrics.normalized(uc.metrics.projected_policy_error(Pi, N, learnt), Pi)


@settings(deadline=None, max_examples=50)
@given(st.integers(0, 2**32 - 1), st.integers(2, 7), st.data())
def test_any_constant_constraint_is_found_exactly_with_its_number_of_rows(seed, d, data):
    k = data.draw(st.integers(1, d - 1))
    rng = np.random.default_rng(seed)
    X, Pi = rng.normal(size=(200, 2)), rng.normal(size=(200, d))
    N, U = constrained(np.broadcast_to(rng.normal(size=(k, d)), (200, k, d)), Pi)
    found = uc.ConstantConstraint().fit(X, U)
    assert found.n_constraints_ == k
    np.testing.assert_allclose(found.predict(X), N, atol=1e-10)
    np.testing.assert_allclose(found.rows_ @ found.rows_.T, np.eye(k), atol=1e-12)
    assert found.uncertainty_ < 1e-6
    assert found.score(X, U) == pytest.approx(1.0, abs=1e-12)


def test_noise_tilts_a_constant_constraint_no_further_than_it_says():
    rng = np.random.default_rng(0)
    off = []
    for _ in range(30):
        normal = rng.normal(size=3)
        _, U = constrained(np.broadcast_to(normal, (300, 1, 3)), rng.normal(size=(300, 3)))
        found = uc.ConstantConstraint().fit(U, U + 0.2 * rng.normal(size=U.shape))
        assert found.n_constraints_ == 1
        sine = np.linalg.norm(np.cross(found.rows_[0], normal / np.linalg.norm(normal)))
        off.append(np.arcsin(min(sine, 1.0)) / found.uncertainty_)
    assert 0.5 < np.sqrt(np.mean(np.square(off))) < 1.5  # the angle in standard errors


@pytest.mark.parametrize("a", [0.1, 0.5, 2.0])
def test_parabolic_constraints_are_found_exactly(a):
    rng = np.random.default_rng(1)
    X = rng.uniform(-1, 1, (300, 2))
    Pi = -X @ [[1.0, 0.3], [-0.4, 1.0]] + [0.5, -0.3]
    N, U = constrained(np.stack([-2 * a * X[:, 0], np.ones(300)], axis=1)[:, None], Pi)
    assert nppe(Pi, N, uc.FeatureConstraint().fit(X, U).predict(X)) < 1e-24
    # Many lengths of the row fit alike with RBFs; the one chosen has a direction everywhere.
    assert nppe(Pi, N, uc.FeatureConstraint(uc.NormalizedRBF(9)).fit(X, U).predict(X)) < 1e-4


@pytest.mark.parametrize(("kind", "held"), [("1-2-3", [0, 1, 2]), ("2-4-6", [1, 3, 5])])
def test_the_arms_fixed_task_rows_are_named(kind, held):
    demos = arm.demonstrate(kind, n_episodes=10, length=30, random_state=0)
    found = uc.FeatureConstraint(arm.jacobian, n_constraints=None)
    found.fit(demos.states, demos.actions, groups=demos.episodes)
    assert found.n_constraints_ == 3
    np.testing.assert_allclose(found.constrained_features_, np.isin(np.arange(6), held), atol=1e-9)
    unseen = arm.demonstrate(kind, n_episodes=5, length=10, random_state=1)
    assert nppe(unseen.policy, unseen.projections, found.predict(unseen.states)) < 1e-24
    rows = found.rows(unseen.states)
    np.testing.assert_allclose(rows @ rows.swapaxes(1, 2), np.broadcast_to(np.eye(3), (50, 3, 3)), atol=1e-12)


def test_two_state_dependent_rows_by_deflation_through_noise():
    rng = np.random.default_rng(2)
    X = rng.uniform(-1, 1, (800, 2))
    A = np.zeros((800, 2, 4))
    A[:, 0] = np.column_stack([np.ones(800), X[:, 0], np.zeros((800, 2))])
    A[:, 1] = np.column_stack([np.zeros((800, 2)), X[:, 1], np.ones(800)])
    Pi = rng.normal(size=(800, 4))
    N, U = constrained(A, Pi)
    for noise, limit in ((0.0, 1e-20), (0.05, 1e-3)):
        found = uc.FeatureConstraint(n_constraints=None).fit(X, U + noise * rng.normal(size=U.shape))
        assert found.n_constraints_ == 2
        assert nppe(Pi, N, found.predict(X)) < limit


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 2**32 - 1))
def test_the_component_that_stays_is_separated_from_a_task_that_varies(seed):
    rng = np.random.default_rng(seed)
    X = rng.uniform(-1, 1, (300, 2))
    A = rng.normal(size=(1, 2))
    _, component = constrained(np.broadcast_to(A, (300, 1, 2)), X @ [[-1.0, -0.5], [0.4, -1.0]] + [0.3, -0.2])
    U = component + rng.normal(size=300)[:, None] * np.linalg.pinv(A)[:, 0]
    found = uc.NullspaceComponent(alpha=0).fit(X, U)
    np.testing.assert_allclose(found.predict(X), component, atol=1e-6)
    assert found.score(X, U) > 1 - 1e-9


def test_the_chain_learns_the_policy_that_inconsistency_alone_cannot():
    rng = np.random.default_rng(3)
    X = rng.uniform(-1, 1, (400, 2))
    Pi = X @ [[-1.0, -0.5], [0.4, -1.0]] + [0.3, -0.2]
    conditions = np.arange(400) % 4
    A = rng.normal(size=(4, 1, 2))[conditions]
    _, U = constrained(A, Pi)
    U += rng.normal(size=(400, 1)) * np.linalg.pinv(A)[:, :, 0]
    chain = uc.ConstraintChain(uc.ConstantConstraint(), uc.ParametricPolicy(), uc.NullspaceComponent(alpha=0))
    clone(chain)
    chain.fit(X, U, conditions=conditions)
    assert uc.metrics.unconstrained_policy_error(Pi, chain.predict(X)) < 1e-10
    assert uc.metrics.unconstrained_policy_error(Pi, uc.ParametricPolicy().fit(X, U).predict(X)) > 1e-2
    assert sorted(chain.constraints_) == [0, 1, 2, 3]


def test_errors_of_learnt_constraints_are_those_of_their_definitions():
    rng = np.random.default_rng(4)
    Pi = rng.normal(size=(50, 3))
    N, U = constrained(rng.normal(size=(50, 1, 3)), Pi)
    other, _ = constrained(rng.normal(size=(50, 1, 3)), Pi)
    assert uc.metrics.projected_policy_error(Pi, N, N) == 0.0
    assert uc.metrics.projected_observation_error(U, N) == pytest.approx(0.0, abs=1e-28)
    each = [np.sum((n @ p - o @ p) ** 2) for n, o, p in zip(N, other, Pi, strict=True)]
    assert uc.metrics.projected_policy_error(Pi, N, other) == pytest.approx(np.mean(each))


X, SPANNING = np.zeros((60, 2)), np.random.default_rng(0).normal(size=(60, 3))

FLAT = uc.ConstantConstraint(1).fit(X, SPANNING[:, :2])
COMPONENT = uc.NullspaceComponent().fit(X, SPANNING[:, :2])


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: uc.ConstantConstraint().fit(X, SPANNING), "the actions span all 3 directions"),
        (
            lambda: uc.FeatureConstraint(n_constraints=None).fit(X, SPANNING),
            "the actions span all 3 directions",
        ),
        (lambda: uc.ConstantConstraint().fit(X[:2], SPANNING[:2]), "2 samples are fewer than the 3 actions"),
        (lambda: uc.ConstantConstraint().fit(X, SPANNING[:, :1]), "needs two or more actions"),
        (lambda: uc.ConstantConstraint().fit(X, 0 * SPANNING), "all actions are zero"),
        (lambda: uc.ConstantConstraint(3).fit(X, SPANNING), "whole number from 1 to 2"),
        (lambda: uc.FeatureConstraint(alpha=0).fit(X, SPANNING), "alpha must be a finite number above zero"),
        (lambda: uc.FeatureConstraint(lambda X: X).fit(X, SPANNING), "the Jacobian must be"),
        (lambda: uc.FeatureConstraint(3).fit(X, SPANNING), "features must be"),
        (lambda: uc.NullspaceComponent().fit(X, SPANNING[:, :1]), "need two or more actions"),
        (lambda: uc.NullspaceComponent().fit(X, 0 * SPANNING), "nothing to separate"),
        (
            lambda: uc.ConstraintChain(uc.ConstantConstraint(1), uc.ParametricPolicy()).fit(
                X, SPANNING, conditions=[0]
            ),
            "one label a sample, 60 in all",
        ),
        (
            lambda: uc.ConstraintChain(uc.ConstantConstraint(1), 1.5).fit(X, SPANNING),
            r"policy must be an estimator, got 1\.5",
        ),
        (lambda: uc.ConstantConstraint(np.eye(2)).fit(X, SPANNING), "whole number from 1 to 2"),
        (lambda: FLAT.describe(X, "xy"), "action_names must be 2 names"),
        (lambda: FLAT.describe(X, ["x", 1]), "action_names must be 2 names"),
        (lambda: COMPONENT.score(X, SPANNING[:, :2] * 1e-200), "so much larger than the actions"),
        (
            lambda: COMPONENT.score(X, SPANNING),
            r"\(60, 3\) and predictions \(60, 2\) must have the same shape",
        ),
    ],
)
def test_mistakes_are_told_in_one_sentence(call, sentence):
    with pytest.raises(uc.errors.UnconstrainError, match=sentence) as caught:
        call()
    assert "\n" not in str(caught.value)


def test_a_weight_on_even_length_may_be_of_any_size():
    rows = uc.FeatureConstraint(alpha=1e308).fit(X + np.arange(60)[:, None], SPANNING * [1, 1, 0]).rows(X)
    np.testing.assert_allclose(np.abs(rows[:, 0]), np.tile([0.0, 0.0, 1.0], (60, 1)), atol=1e-6)


def test_a_constraint_that_was_not_fitted_says_so():
    for estimator in (uc.ConstantConstraint(), uc.FeatureConstraint()):
        with pytest.raises(NotFittedError):
            estimator.describe(X, ["x", "y"])


def test_constraints_are_saved_and_loaded(tmp_path):
    rng = np.random.default_rng(5)
    X, U = constrained_plane(rng)
    for estimator in (uc.ConstantConstraint(), uc.FeatureConstraint(uc.NormalizedRBF(5))):
        estimator.fit(X, U).save(tmp_path / "c.skops")
        np.testing.assert_array_equal(
            uc.load_constraint(tmp_path / "c.skops").predict(X), estimator.predict(X)
        )
    uc.ParametricPolicy().fit(X, U).save(tmp_path / "p.skops")
    with pytest.raises(
        uc.errors.ArchiveError, match="holds a policy, not a constraint: load it with load_policy"
    ):
        uc.load_constraint(tmp_path / "p.skops")


def constrained_plane(rng):
    X = rng.uniform(-1, 1, (200, 3))
    _, U = constrained(
        np.broadcast_to([[0.0, 0.6, 0.8]], (200, 1, 3)), np.cos(3 * X) + rng.normal(size=X.shape)
    )
    return X, U
