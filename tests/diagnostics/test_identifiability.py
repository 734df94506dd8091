"""What recordings determine: 0 <= H <= G, the bounds, directions never seen, advice, and what it says."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.preprocessing import SplineTransformer

import unconstrain as uc
from reproduction.plants import arm
from tests.problems import problems
from unconstrain import limit_cycle as toy
from unconstrain.diagnostics.identify import check_recordings
from unconstrain.diagnostics.information import Information
from unconstrain.diagnostics.spectrum import compute_directions
from unconstrain.motion import moving
from unconstrain.policies.unsure import Unsure


def policies(X):
    centers, width = X[:3].copy(), 2.0 * float(np.std(X)) + 1e-3
    return [
        uc.ParametricPolicy(risk="inconsistency", alpha=1e-6),
        uc.ParametricPolicy(uc.NormalizedRBF(centers=centers, width=width), risk="inconsistency", alpha=1e-6),
        uc.ParametricPolicy(SplineTransformer(4), risk="inconsistency", alpha=1e-6),
        uc.LocallyLinearPolicy(centers=centers, width=width, risk="inconsistency", alpha=1e-6),
        uc.ParametricPolicy(uc.DecoupledFeatures(4), risk="inconsistency", alpha=1e-6),
    ]


def fitted(X, U, sample_weight=None):
    for policy in policies(X):
        try:
            yield policy.fit(X, U, sample_weight=sample_weight)
        except ValueError:  # decoupled features where states and actions do not pair up, splines of one state
            continue


@settings(deadline=None, max_examples=15)
@given(problems(min_samples=6))
def test_what_was_seen_is_at_most_everything(problem):
    X, _, N, U, _ = problem
    if not np.any(U):
        return
    for policy in fitted(X, U):
        for projections in (None, N):
            samples, _ = check_recordings(policy, X, U, projections=projections)
            information = Information.from_samples(policy, samples)
            for H, G in zip(information.observed, information.whole, strict=True):
                G = np.kron(np.eye(information.copies), G)
                scale = np.linalg.eigvalsh(G)[-1]
                assert np.linalg.eigvalsh(G - H)[0] >= -1e-9 * scale
                assert np.linalg.eigvalsh(H)[0] >= -1e-9 * scale
            for one, H in zip(compute_directions(information), information.observed, strict=True):
                # ε / RELATIVE_CUTOFF is what rounding may do to a share.
                np.testing.assert_allclose(one.vectors.T @ H @ one.vectors, np.diag(one.shares), atol=1e-3)


@settings(deadline=None, max_examples=15)
@given(problems(min_samples=6), st.booleans())
def test_moments_alone_tell_the_same(problem, weighted):
    X, _, _, U, rng = problem
    if not np.any(U):
        return
    weights = rng.random(len(X)) + 0.1 if weighted else None
    for policy in fitted(X, U, weights):
        if isinstance(policy, uc.ParametricPolicy) and isinstance(policy.features, uc.DecoupledFeatures):
            continue
        given_data = uc.identifiability(policy, X, U, sample_weight=weights)
        by_moments = uc.identifiability(policy)
        np.testing.assert_allclose(by_moments.spectrum, given_data.spectrum, atol=1e-3)


def test_projections_show_more_and_their_moments_ask_for_the_recordings():
    demos = toy.demonstrate(3, random_state=0)
    N = uc.constraints.unconstrained(2, len(demos.states))
    policy = uc.ParametricPolicy(risk="inconsistency", alpha=1e-6).fit(
        demos.states, demos.policy, projections=N
    )
    report = uc.identifiability(policy, demos.states, demos.policy, projections=N)
    np.testing.assert_allclose(report.spectrum, 1.0)
    with pytest.raises(uc.errors.PolicyError, match="give the recordings"):
        uc.identifiability(policy)


def test_demonstrations_bring_their_actions_episodes_and_projections():
    demos = toy.demonstrate(3, random_state=0)
    known = uc.constraints.unconstrained(2, len(demos.states))
    demos = replace(demos, projections=known, episode_labels=("a", "b", "c"))
    policy = uc.ParametricPolicy(risk="inconsistency", alpha=1e-6).fit(demos)
    report = uc.identifiability(policy, demos)
    arrays = uc.identifiability(policy, demos.states, demos.actions, projections=known)
    np.testing.assert_array_equal(report.spectrum, arrays.spectrum)
    assert {one.episode for one in report.contributions()} == {"a", "b", "c"}
    with pytest.raises(uc.errors.DataError, match="bring their own actions"):
        uc.identifiability(policy, demos, demos.actions)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.floats(1e-3, 10.0))
def test_bounds_hold_for_policies_in_the_span(seed, d, off):
    """UPE <= E_i / λ_min, the same in determined directions, and along each, for any parameters whatever."""
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(40, 2))
    W = rng.normal(size=(2, d))
    Pi = X @ W
    N = uc.constraints.projection(rng.normal(size=(40, d, d)) * (rng.random((40, d, 1)) < 0.5))
    U = np.einsum("nij,nj->ni", N, Pi)
    if not np.any(U):
        return
    for policy in (
        uc.ParametricPolicy(risk="inconsistency", alpha=1e-6),
        uc.ParametricPolicy(SplineTransformer(3, degree=1), risk="inconsistency", alpha=1e-6),
        uc.LocallyLinearPolicy(n_centers=3, risk="inconsistency", alpha=1e-6),
    ):
        policy.fit(X, U)
        w = policy.solution_.w
        policy.solution_ = replace(policy.solution_, w=w + off * rng.normal(size=w.shape))
        report = uc.identifiability(policy, X, U)
        counted = moving(U)
        error = uc.metrics.unconstrained_policy_error(Pi[counted], policy.predict(X)[counted])
        assert error <= report.bound * (1 + 1e-6) + 1e-12
    policy = uc.ParametricPolicy(risk="inconsistency", alpha=1e-6).fit(X, U)
    w = policy.solution_.w
    policy.solution_ = replace(policy.solution_, w=w + off * rng.normal(size=w.shape))
    report = uc.identifiability(policy, X, U)
    (one,) = compute_directions(report.information)
    standard = policy.features_.scaling_
    true = np.hstack([W.T * standard.spread, W.T @ standard.mean[:, None]]).ravel()
    (G,) = report.information.whole
    parts = one.vectors.T @ np.kron(np.eye(d), G) @ (policy.weights_ - true)
    weight = float(report.information.moments.weight)
    assert np.all(parts**2 / weight <= report.bound_of_directions[0] * (1 + 1e-6) + 1e-9 * off**2)
    determined = one.shares >= report.threshold
    assert np.sum(parts[determined] ** 2) / weight <= report.bound_determined * (1 + 1e-6) + 1e-12


def test_directions_never_seen_are_found_in_any_frame():
    rng = np.random.default_rng(0)
    R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    X = rng.normal(size=(300, 3))
    U = (rng.normal(size=(300, 3)) * [1.0, 0.5, 0.0]) @ R.T
    report = uc.identifiability(uc.ParametricPolicy(risk="inconsistency", alpha=1e-6).fit(X, U), X, U)
    assert report.determined_share == pytest.approx(2 / 3)
    found = report.unseen_directions(X[:20])
    np.testing.assert_allclose(np.abs(found.directions[:, 0] @ R[:, 2]), 1.0, atol=1e-9)
    np.testing.assert_allclose(found.shares[:, 0], 0.0, atol=1e-9)
    np.testing.assert_allclose(found.shares.sum(axis=1), 1.0)
    advised = report.next_recordings(1)[0]
    assert abs(advised.direction @ R[:, 2]) > 0.999


def test_the_determined_share_orders_the_arms_constraints():
    """METHOD 4.2: 1.00, 0.99, 0.96, 0.93 in a prototype, without ground truth."""
    shares = []
    for rows in ("2-4-6", "1-3-5", "4-5-6", "1-2-3"):
        demos = arm.demonstrate(rows, arm.PowerPolicy(1.8), 40, 50, random_state=0)
        policy = uc.LocallyLinearPolicy(width=3**0.5, risk="inconsistency").fit(demos.states, demos.actions)
        shares.append(uc.identifiability(policy).determined_share)
    assert shares[0] > 0.99
    assert shares == sorted(shares, reverse=True)
    assert shares[-1] < 0.97


@pytest.mark.parametrize("criterion", ["A", "D"])
def test_advice_lowers_the_expected_error_as_it_says(criterion):
    demos = toy.demonstrate(4, random_state=0)
    for policy in (
        uc.ParametricPolicy(uc.NormalizedRBF(centers="grid", width=0.7), risk="inconsistency", alpha=1e-6),
        uc.LocallyLinearPolicy(risk="inconsistency", alpha=1e-6),
    ):
        policy.fit(demos.states, demos.actions)
        report = uc.identifiability(policy, demos.states, demos.actions, groups=demos.episodes)
        planner = report.planner()
        left = [planner.expected_error()]
        for one in report.next_recordings(4, criterion=criterion):
            planner.record(one.state[None], one.direction[None])
            left.append(planner.expected_error())
            # Without noise points that tell nearly the same are told apart by rounding.
            assert one.gain == pytest.approx(1 - left[-1] / left[-2], abs=1e-4)
            assert left[-1] <= left[-2] * (1 + 1e-9)


def test_gains_are_what_a_recording_takes_away():
    demos = toy.demonstrate(4, noise=0.1, random_state=0)
    policy = uc.ParametricPolicy(risk="inconsistency", alpha=1e-6).fit(demos.states, demos.actions)
    report = uc.identifiability(policy, demos.states, demos.actions)
    X, q = demos.states[:5], np.tile([[0.6, 0.8]], (5, 1))
    gains = report.gains(X, q)
    for i in range(5):
        planner = report.planner()
        before = planner.expected_error()
        planner.record(X[i : i + 1], q[i : i + 1])
        assert gains[i] == pytest.approx((before - planner.expected_error()) / len(planner.X), rel=1e-6)


def test_a_recording_is_foreseen_as_the_policy_leads_along_its_direction():
    demos = toy.demonstrate(20, free=0.5, random_state=0)
    policy = uc.ParametricPolicy(risk="direct").fit(demos)
    planner = uc.identifiability(policy, demos).planner()
    assert planner.foresight.step == pytest.approx(1 / 50)
    start, q = np.array([[0.5, 0.2]]), np.array([[0.6, 0.8]])
    foreseen = planner.foresight.follow(start, q, 40)
    followed = policy.rollout(start[0], steps=39, dt=1 / 50, constraint=[[0.8, -0.6]])
    np.testing.assert_allclose(foreseen.states[0], followed.states[::5], atol=1e-12)
    still = uc.identifiability(policy, demos.states[::-1], demos.actions).planner()
    assert still.foresight.follow(start, q, 40).states.shape == (1, 1, 2)


def test_the_best_recording_is_advised_and_copies_of_what_there_is_come_last():
    demos = toy.demonstrate(6, random_state=0)
    features = uc.NormalizedRBF(centers="grid", width=0.7)
    policy = uc.ParametricPolicy(features, risk="inconsistency").fit(demos)
    report = uc.identifiability(policy, demos)
    X = np.random.default_rng(1).uniform(-1, 1, size=(60, 2))
    first, second = report.next_recordings(2, candidates=X)
    every = report.gains(np.tile(X, (2, 1)), np.repeat(np.eye(2), 60, axis=0), candidates=X)
    assert report.gains(first.state[None], first.direction[None], candidates=X)[0] >= 0.5 * every.max()
    planner = report.planner(X)
    planner.record(first.state[None], first.direction[None])
    again = planner.gains(
        np.stack([first.state, second.state]), np.stack([first.direction, second.direction])
    )
    assert again[0] < 0.1 * again[1]
    starts = demos.states[::40]
    copies = planner.gains(starts, demos.actions[::40] / np.linalg.norm(demos.actions[::40], axis=1)[:, None])
    assert np.median(copies) < 0.1 * again[1]


def test_what_was_taken_for_free_though_nothing_shows_it_is_advised():
    rng = np.random.default_rng(0)
    X = rng.uniform(1.0, 2.0, size=(300, 2))
    U = np.column_stack([-X[:, 0] + 0.05 * rng.normal(size=300), 0.05 * rng.normal(size=300)])
    policy = uc.ParametricPolicy().fit(X, U)
    assert policy.free_share_ > 0.9
    assert abs(uc.identifiability(policy, X, U).next_recordings(1)[0].direction[1]) > 0.5


def test_episodes_hold_all_that_is_determined_and_copies_can_go():
    demos = toy.demonstrate(6, random_state=0)
    X, U = np.vstack([demos.states, demos.states]), np.vstack([demos.actions, demos.actions])
    groups = np.concatenate([demos.episodes, demos.episodes + 6])
    for policy in (
        uc.ParametricPolicy(risk="inconsistency", alpha=1e-6),
        uc.LocallyLinearPolicy(n_centers=4, risk="inconsistency", alpha=1e-6),
    ):
        report = uc.identifiability(policy.fit(X, U), X, U, groups=groups)
        found = report.contributions()
        counted = sum(np.sum(values / (values + report.threshold)) for values in report.spectra)
        assert sum(one.directions for one in found) == pytest.approx(counted, rel=1e-6)
        assert sum(one.droppable for one in found) >= 4


def test_the_report_speaks_in_the_users_words():
    demos = toy.demonstrate(3, random_state=0)
    policy = uc.LocallyLinearPolicy(n_centers=3, risk="inconsistency", alpha=1e-6).fit(
        demos.states, demos.actions
    )
    report = uc.identifiability(policy, demos.states, demos.actions, groups=demos.episodes)
    text = report.describe(["left", "up"], ["v_left", "v_up"])
    for part in (
        "determined:",
        "local models:",
        "error bound:",
        "at left = ",
        "v_up",
        "record next:",
        "episodes",
    ):
        assert part in text
    assert "determined:" in repr(report)
    assert report.determined_shares([0.0, 1.1]).tolist() == [1.0, 0.0]
    assert report.determined_share_of_models.shape == (3,)


def test_diagnose_warns_says_and_stops(run, tmp_path):
    """`fit` warns, `diagnose` says where and what next and draws it, `rollout` ends where nothing is known."""
    demos = toy.demonstrate(4, random_state=0)
    recording, saved = str(tmp_path / "toy.npz"), str(tmp_path / "toy.skops")
    demos.save(recording)
    model = ["--model", "rbf", "--width", "0.3", "--centers", "grid", "--alpha", "1e-6"]
    _, out, _ = run("fit", recording, *model, "--out", saved)
    assert "of the policy is not determined by what it was learnt from (`unconstrain diagnose`" in out
    picture = tmp_path / "known.png"
    code, told, err = run("diagnose", recording, *model, "--figure", picture)
    assert code == 0, err
    assert picture.stat().st_size > 0
    for part in ("determined: ", "least known:", "at x1 = ", "record next:", "  3. Start at "):
        assert part in told
    everywhere = toy.demonstrate(40, random_state=0)
    left = everywhere.select(everywhere.states[:, 0] < 0)
    policy = uc.ParametricPolicy(
        uc.NormalizedRBF(centers="grid", width=0.5), risk="inconsistency", alpha=1e-6
    ).fit(left.states, left.actions)
    policy.save(saved, resumable=True)
    move = ["rollout", saved, "--start=-0.7,0", "--steps", "400"]  # the cycle leads to the right
    paths = ["--out", str(tmp_path / "path.csv"), "--figure", str(tmp_path / "path.png")]
    code, stopped, _ = run(*move, *paths, "--stop-when-unsure", "0.3")
    assert code == 3
    assert ": the policy is known to within ±" in stopped
    assert Unsure(policy, 0.3)(np.array([[-0.7, 0.0], [0.7, 0.0]])).tolist() == [False, True]
    # Where people were a movement may begin, however little is known; elsewhere not.
    code, noted, _ = run(*move, *paths, "--overwrite", "--stop-when-unsure", "1e-9")
    assert code == 3
    assert "note: at the start, as it was recorded, the policy is known to within ±" in noted
    move[2] = "--start=0.7,0"
    code, _, refused = run(*move, *paths, "--overwrite", "--stop-when-unsure", "0.3", "--beyond", "anywhere")
    assert code == 2
    assert "at the start already" in refused


X = np.random.default_rng(0).normal(size=(20, 2))
POLICY = uc.ParametricPolicy(risk="inconsistency", alpha=1e-6).fit(X, X)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: uc.identifiability(3), "about a policy of unconstrain, got int"),
        (lambda: uc.identifiability(POLICY, X), "give states and actions both, or neither"),
        (lambda: uc.identifiability(POLICY, X, X[:, :1]), "the policy has 2 actions"),
        (lambda: uc.identifiability(POLICY, X, 0 * X), "nothing moves in these recordings"),
        (
            lambda: uc.identifiability(POLICY, X, X, threshold=0),
            "threshold must be a finite number above zero",
        ),
        (lambda: uc.identifiability(POLICY).worst_regions(), "the recordings are needed"),
        (lambda: uc.identifiability(POLICY, X, X).contributions(), "needs to know them"),
        (lambda: uc.identifiability(POLICY, X, X).next_recordings(0), "a whole number of at least 1"),
        (
            lambda: uc.identifiability(POLICY, X, X).gains(X, np.eye(2)),
            "20 states, so directions must have shape",
        ),
        (
            lambda: uc.identifiability(POLICY, X, X).next_recordings(1, criterion="E"),
            "criterion must be one of",
        ),
        (
            lambda: uc.identifiability(
                uc.ParametricPolicy(uc.DecoupledFeatures(5), risk="inconsistency", alpha=1e-6).fit(X, X)
            ),
            "do not say what full observation",
        ),
    ],
)
def test_mistakes_are_told_in_one_sentence(call, sentence):
    with pytest.raises(uc.errors.UnconstrainError, match=sentence) as caught:
        call()
    assert "\n" not in str(caught.value)
