"""What is known of constraints goes in: projections from measurements, and the risk that uses those it has."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.base import clone

import unconstrain as uc
from reproduction.plants import arm
from tests.problems import problems
from unconstrain import constraints
from unconstrain import metrics as risk


def hidden(N, share, rng):
    return np.where(rng.random((len(N), 1, 1)) < share, np.nan, N)


@given(problems(), st.floats(-3, 3), st.floats(0, 1))
def test_knowing_projections_judges_more_of_a_policy_but_never_more_than_cpe(problem, exponent, share):
    _, Pi, N, U, rng = problem
    P = Pi + rng.normal(size=Pi.shape) * 10.0**exponent
    slack = 1e-12 * (np.mean(Pi**2) + np.mean(P**2))
    laws = [
        risk.inconsistency(U, P),
        risk.inconsistency(U, P, hidden(N, share, rng)),
        risk.constrained_policy_error(Pi, P, N),
        risk.unconstrained_policy_error(Pi, P),
    ]
    assert all(a <= b + slack for a, b in pairwise(laws))


@settings(deadline=None, max_examples=30)
@given(problems(min_samples=8))
def test_projections_that_are_not_known_change_nothing(problem):
    X, _, N, U, _ = problem
    if not np.any(U):
        return
    centers, width = X[:3].copy(), 2.0 * float(np.std(X)) + 1e-3
    for policy in (
        uc.ParametricPolicy(uc.NormalizedRBF(centers=centers, width=width), alpha=1e-3),
        uc.LocallyLinearPolicy(centers=centers, width=width, alpha=1e-3),
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
    policy = uc.ParametricPolicy(alpha=1e-3).fit(X, U, projections=N)
    V = np.einsum("nij,nk->nijk", N, np.column_stack([X, np.ones(len(X))])).reshape(U.size, -1)
    expected = np.linalg.solve(V.T @ V + 1e-3 * np.eye(V.shape[1]), V.T @ U.reshape(-1))
    B = np.column_stack([X, np.ones(len(X))])
    P = B @ expected.reshape(U.shape[1], -1).T
    np.testing.assert_allclose(policy.predict(X), P, rtol=1e-5, atol=1e-6 * np.abs(P).max())


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
    policy = uc.ParametricPolicy(alpha=1e-2)
    whole = clone(policy).fit(X, U, projections=N)
    pieces = clone(policy).partial_fit(X[:60], U[:60], projections=N[:60]).partial_fit(X[60:], U[60:])
    np.testing.assert_allclose(pieces.predict(X), whole.predict(X), atol=1e-9)
    assert pieces.n_known_constraints_ == whole.n_known_constraints_ == 60
    assert clone(policy).fit(X, U).n_known_constraints_ == 0


# Measurements


def test_normals_alone_and_through_a_jacobian():
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(5, 3))
    normals[1], normals[2] = 0.0, np.nan
    N = constraints.from_normals(normals)
    np.testing.assert_allclose(N[0] @ normals[0], 0.0, atol=1e-12)
    np.testing.assert_array_equal(N[1], np.eye(3))
    assert np.isnan(N[2]).all()
    J = rng.normal(size=(5, 3, 7))
    through = constraints.from_normals(normals, J)
    np.testing.assert_allclose(normals[0] @ J[0] @ through[0], 0.0, atol=1e-12)
    assert np.trace(through[3]) == pytest.approx(6)
    two = constraints.from_normals(rng.normal(size=(5, 2, 3)))
    np.testing.assert_allclose(np.trace(two, axis1=1, axis2=2), 1.0)


def test_jacobian_rows_flags_and_the_first_known():
    Q = arm.draw_starts(6, random_state=0)
    J = arm.jacobian(Q)
    expected = arm.demonstrate("1-3-5", n_episodes=6, length=1, random_state=0).projections
    np.testing.assert_allclose(constraints.from_jacobian(J, [0, 2, 4]), expected, atol=1e-12)
    flags = constraints.from_flags([1, 0, True], 2)
    np.testing.assert_array_equal(flags[[0, 2]], [np.eye(2)] * 2)
    assert np.isnan(flags[1]).all()
    filled = constraints.first_known(flags, np.full((3, 2, 2), np.nan), np.zeros((3, 2, 2)))
    np.testing.assert_array_equal(filled, [np.eye(2), np.zeros((2, 2)), np.eye(2)])


def slide(noise=0.0, friction=0.0, seed=0, samples=400):
    """A fingertip that lands on a tilted plane, slides in it, and leaves: actions, forces, normal, contact."""
    rng = np.random.default_rng(seed)
    normal = np.array([0.2, -0.3, 0.9])
    normal /= np.linalg.norm(normal)
    on = (np.arange(samples) % 100 > 20) & (np.arange(samples) % 100 < 80)
    U = rng.normal(size=(samples, 3))
    U[on] -= (U[on] @ normal)[:, None] * normal
    unit = U / np.linalg.norm(U, axis=1, keepdims=True)
    forces = np.where(on[:, None], 5.0 * normal - 5.0 * friction * unit, 0.0) + noise * rng.normal(
        size=(samples, 3)
    )
    return U, forces, normal, on


def test_forces_tell_contact_through_noise_spikes_and_friction():
    U, forces, normal, on = slide(noise=0.3, friction=0.4)
    forces[10] = 40.0  # a spike in free motion
    touching, _ = constraints.contact(forces, 2.0)
    np.testing.assert_array_equal(touching == 1, on)
    N = constraints.from_forces(forces, 2.0, actions=U)
    np.testing.assert_array_equal(N[~on], np.broadcast_to(np.eye(3), N[~on].shape))
    rows = np.linalg.svd(np.eye(3) - N[on])[2][:, 0]
    assert np.degrees(np.median(np.arccos(np.abs(rows @ normal)))) < 5
    # With friction taken out, what moved was free to move: no sample contradicts its own projection.
    moved = on & (np.linalg.norm(U, axis=1) > 0.5)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", N[moved], U[moved]), U[moved], atol=1e-9)


def test_forces_without_noise_are_exact_and_filtering_never_crosses_an_edge():
    _, forces, normal, on = slide()
    N = constraints.from_forces(forces, 2.0)
    expected = constraints.projection(np.where(on[:, None], normal, 0.0)[:, None])
    np.testing.assert_allclose(N, expected, atol=1e-12)


def test_what_is_said_of_an_episode_does_not_depend_on_the_others():
    """Or a stream, which sees a few at a time, could not say the same."""
    slides = [slide(noise=0.3, friction=0.4, seed=seed, samples=130 + 20 * seed) for seed in range(3)]
    U = np.concatenate([10.0**seed * each[0] for seed, each in enumerate(slides)])
    forces = np.concatenate([each[1] for each in slides])
    episodes = np.repeat([2, 0, 1], [len(each[0]) for each in slides])
    together = constraints.from_forces(forces, 2.0, actions=U, episodes=episodes, margin=2)
    for label in range(3):
        own = episodes == label
        alone = constraints.from_forces(forces[own], 2.0, actions=U[own], margin=2)
        np.testing.assert_array_equal(together[own], alone)


def test_what_could_be_contact_or_not_is_unknown():
    size = np.array([0, 0, 1.5, 1.5, 0, 0, 1.5, 3, 3, 1.5, 0, 0], dtype=float)
    touching, _ = constraints.contact(size[:, None] * [[0.0, 1.0]], 2.0, window=1)
    np.testing.assert_array_equal(touching, [0, 0, np.nan, np.nan, 0, 0, 1, 1, 1, 1, 0, 0])
    pushed_along = np.tile([[5.0, 0.1]], (12, 1))
    assert np.isnan(constraints.from_forces(pushed_along, 2.0, actions=np.tile([[1.0, 0.0]], (12, 1)))).all()
    near = constraints.from_forces(size[:, None] * [[0.0, 1.0]], 2.0, window=1, margin=1)
    assert np.isnan(near[[5, 6, 9, 10]]).all()
    assert not np.isnan(near[[0, 7, 8, 11]]).any()
    # Two episodes are not filtered into each other.
    touching, _ = constraints.contact([[0.0, 5.0]] * 3 + [[0.0, 0.0]] * 3, 2.0, episodes=[0, 0, 0, 1, 1, 1])
    np.testing.assert_array_equal(touching, [1, 1, 1, 0, 0, 0])


def test_forces_and_flags_are_loaded_saved_and_used(tmp_path):
    U, forces, _, on = slide(noise=0.2)
    X = np.cumsum(U, axis=0)
    free = (~on).astype(float)
    path = tmp_path / "slide.csv"
    names = ["x", "y", "z", "u", "v", "w", "fx", "fy", "fz", "free"]
    np.savetxt(
        path, np.column_stack([X, U, forces, free]), delimiter=",", header=",".join(names), comments=""
    )
    demos = uc.load(
        path, state=["x", "y", "z"], action=["u", "v", "w"], force=["fx", "fy", "fz"], free="free"
    )
    np.testing.assert_allclose(demos.forces, forces)
    for suffix in (".npz", ".parquet"):
        uc.save(demos, tmp_path / f"saved{suffix}")
        back = uc.load(tmp_path / f"saved{suffix}")
        np.testing.assert_array_equal(back.forces, demos.forces)
        np.testing.assert_array_equal(back.free, demos.free)
    both = uc.Demonstrations.concatenate([demos, demos.select(slice(100))])
    assert len(both.forces) == len(both.free) == 500
    assert "forces, free" in repr(both)

    N = constraints.from_recording(demos, force_threshold=2.0)
    np.testing.assert_array_equal(N[~on], np.broadcast_to(np.eye(3), N[~on].shape))
    np.testing.assert_allclose(np.trace(N[on], axis1=1, axis2=2), 2.0)
    flagged = uc.Demonstrations(X, U, free=free)
    assert np.isnan(constraints.from_recording(flagged)[on]).all()


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: constraints.from_normals(np.ones(3)), "normals must be"),
        (lambda: constraints.from_normals(np.ones((3, 2)), np.ones((3, 3, 7))), r"must be \(3, 2, actions\)"),
        (lambda: constraints.from_jacobian(np.ones((3, 6, 7)), [6]), "there is no row 6"),
        (lambda: constraints.from_flags([0, np.nan], 2), "row 1 is NaN"),
        (lambda: constraints.first_known(), "no projections to choose from"),
        (lambda: constraints.from_forces(np.ones((3, 2)), 0), "threshold must be a number above zero"),
        (
            lambda: constraints.from_forces(np.ones((3, 2)), 1, release=2),
            "release must be above zero and at most",
        ),
        (lambda: constraints.from_forces(np.ones((3, 2)), 1, window=4), "odd number of samples"),
        (lambda: constraints.from_forces([[np.nan, 1.0]], 1), "NaN or infinity in row 0"),
        (
            lambda: constraints.from_forces(np.ones((3, 2)), 1, actions=np.ones((4, 2))),
            "3 forces and 4 actions",
        ),
        (
            lambda: constraints.from_forces(np.ones((3, 6)), 1, actions=np.ones((3, 2))),
            "6 components and actions",
        ),
        (
            lambda: constraints.from_recording(uc.Demonstrations(np.ones((3, 2)), np.ones((3, 2)))),
            "neither forces nor flags",
        ),
        (
            lambda: constraints.from_recording(
                uc.Demonstrations(np.ones((3, 2)), np.ones((3, 2)), forces=np.ones((3, 3))), force_threshold=1
            ),
            "forces have 3 components and actions 2 dimensions",
        ),
        (
            lambda: uc.Demonstrations(np.ones((3, 2)), np.ones((3, 2)), forces=np.ones((2, 3))),
            "2 forces and 3 states",
        ),
        (lambda: uc.Demonstrations(np.ones((2, 1)), np.ones((2, 1)), free=[0, 2]), "free must be 1"),
        (
            lambda: uc.ParametricPolicy().fit(np.eye(3), np.eye(3), projections=np.full((3, 2, 2), np.nan)),
            "projections must have shape",
        ),
        (
            lambda: uc.ParametricPolicy().fit(
                np.eye(3), np.eye(3), projections=np.where(np.eye(3, dtype=bool), np.nan, np.ones((3, 3, 3)))
            ),
            "projections contains NaN in row 0",
        ),
    ],
)
def test_mistakes_are_told_in_one_sentence(call, sentence):
    with pytest.raises(uc.errors.DataError, match=sentence) as caught:
        call()
    assert "\n" not in str(caught.value)
