"""What is known of constraints is learnt from, and what is not known changes nothing."""

import numpy as np
import pytest
from hypothesis import given, settings
from sklearn.base import clone

import unconstrain as uc
from reproduction.plants import arm
from tests.problems import problems
from unconstrain import constraints
from unconstrain import metrics as risk
from unconstrain.fitting.decay import SHARE


def hidden(N, share, rng):
    return np.where(rng.random((len(N), 1, 1)) < share, np.nan, N)


@settings(deadline=None, max_examples=30)
@given(problems(min_samples=8))
def test_projections_that_are_not_known_change_nothing(problem):
    X, _, N, U, _ = problem
    if not np.any(U):
        return
    centers, width = X[:3].copy(), 2.0 * float(np.std(X)) + 1e-3
    for policy in (
        uc.ParametricPolicy(uc.NormalizedRBF(centers=centers, width=width), alpha=1e-3, risk="inconsistency"),
        uc.LocallyLinearPolicy(centers=centers, width=width, alpha=1e-3, risk="inconsistency"),
    ):
        plain = clone(policy).fit(X, U).predict(X)
        unknown = clone(policy).fit(X, U, projections=np.full_like(N, np.nan)).predict(X)
        np.testing.assert_allclose(unknown, plain, rtol=1e-9)


@settings(deadline=None, max_examples=30)
@given(problems(min_samples=8))
def test_known_projections_are_learnt_from_by_the_error_under_them(problem):
    X, _, N, U, _ = problem
    if not np.any(U):
        return
    policy = uc.ParametricPolicy(alpha=1e-3, risk="inconsistency").fit(X, U, projections=N)
    # States count from their mean in units of their spread, both weighted by how much each projection shows.
    shown = np.einsum("nij,nij->n", N, N)
    mean = np.average(X, axis=0, weights=shown)
    spread = np.sqrt(np.average((X - mean) ** 2, axis=0, weights=shown))
    if np.any(spread < 1e-6 * X.std(axis=0)):  # one sample shows anything at all
        return
    B = np.column_stack([(X - mean) / spread, np.ones(len(X))])
    V = np.einsum("nij,nk->nijk", N, B).reshape(U.size, -1)
    H = V.T @ V
    slopes = np.tile(np.arange(B.shape[1]) < X.shape[1], U.shape[1])
    decay = 1e-3 * np.mean(np.diagonal(H)[slopes]) * np.where(slopes, 1.0, SHARE)
    expected = np.linalg.solve(H + np.diag(decay), V.T @ U.reshape(-1))
    P = B @ expected.reshape(U.shape[1], -1).T
    np.testing.assert_allclose(policy.predict(X), P, rtol=1e-5, atol=1e-6 * np.abs(P).max())


@pytest.mark.parametrize("cause", ["I minus it", "row before", "row after", "frame"])
def test_a_projection_that_blocks_its_own_action_is_refused_with_the_likely_cause(cause):
    demos = arm.demonstrate("1-3-5", n_episodes=4, length=30, random_state=0)
    X, U, N = demos.states, demos.actions, demos.projections.copy()
    N[::3] = np.nan
    given = {
        "I minus it": np.eye(U.shape[1]) - N,
        "row before": N,
        "row after": N,
        "frame": N[:, ::-1, ::-1],
    }[cause]
    if cause.startswith("row"):  # directions that change from row to row, as in a wiped bowl
        angle = np.linspace(0, 80, 80)
        U = np.column_stack([np.cos(angle), np.sin(angle)])
        N, X = U[:, :, None] * U[:, None, :], U
        given = np.roll(N, -1 if cause == "row before" else 1, axis=0)
    uc.ParametricPolicy(alpha=1e-3).fit(X, U, projections=N)
    for ask in (
        lambda: uc.ParametricPolicy(alpha=1e-3).fit(X, U, projections=given),
        lambda: uc.select_policy([uc.ParametricPolicy()], X, U, projections=given),
        lambda: uc.identifiability(uc.ParametricPolicy(alpha=1e-3).fit(X, U), X, U, projections=given),
        lambda: uc.fit_stream(uc.ParametricPolicy(alpha=1e-3), [(X, U, np.zeros(len(X)), given)]),
    ):
        with pytest.raises(uc.errors.DataError, match=rf"row \d+ does not let through .*{cause}"):
            ask()


def test_noise_and_the_moment_of_contact_are_not_refused():
    rng = np.random.default_rng(0)
    demos = arm.demonstrate("1-3-5", n_episodes=4, length=30, random_state=0)
    U = demos.actions + 0.2 * np.sqrt(np.mean(demos.actions**2)) * rng.normal(size=demos.actions.shape)
    U[::7] *= 1e-3  # next to rest the action is all noise
    uc.ParametricPolicy(alpha=1e-3).fit(demos.states, U, projections=demos.projections)


def test_a_sample_at_rest_teaches_where_its_constraint_is_known():
    X = np.linspace(-1, 1, 40)[:, None]
    Pi = np.column_stack([np.zeros(40), X[:, 0]])
    N = constraints.projection(np.tile([[0.0, 1.0]], (40, 1, 1)))  # blocks the only motion there is
    U = np.einsum("nij,nj->ni", N, Pi)
    U[0], N[0] = [0.0, 1.0], np.eye(2)
    with_rest = uc.ParametricPolicy(alpha=1e-6).fit(X, U, projections=N)
    assert with_rest.n_zero_actions_ == 39
    assert with_rest.resume().moments().n_samples == 40
    np.testing.assert_allclose(with_rest.predict(X)[:, 0], 0.0, atol=1e-9)


def test_known_projections_determine_more_of_the_policy_in_folds_and_in_selection():
    seen, unseen = (arm.demonstrate("1-3-5", n_episodes=10, length=40, random_state=i) for i in (0, 1))
    half = hidden(seen.projections, 0.5, np.random.default_rng(0))
    error = {}
    for name, N in {"none": None, "half": half, "all": seen.projections}.items():
        policy = uc.ParametricPolicy(alpha="cv")
        policy.fit(seen.states, seen.actions, groups=seen.episodes, projections=N)
        P = policy.predict(unseen.states)
        error[name] = risk.normalized(risk.unconstrained_policy_error(unseen.policy, P), unseen.policy)
    assert error["all"] < 1e-6
    assert error["half"] < 1e-6


def test_partial_fit_may_know_some_batches_and_not_others():
    demos = arm.demonstrate("1-2-3", n_episodes=4, length=30, random_state=2)
    X, U, N = demos.states, demos.actions, demos.projections.copy()
    N[60:] = np.nan
    # λ well above the rounding of H: what is compared is the policy, where the data hardly determine it too.
    policy = uc.ParametricPolicy(alpha=1e-2, risk="inconsistency")
    whole = clone(policy).fit(X, U, projections=N)
    pieces = clone(policy).partial_fit(X[:60], U[:60], projections=N[:60]).partial_fit(X[60:], U[60:])
    np.testing.assert_allclose(pieces.predict(X), whole.predict(X), atol=1e-9)
    assert pieces.n_known_constraints_ == whole.n_known_constraints_ == 60
    assert clone(policy).fit(X, U).n_known_constraints_ == 0
