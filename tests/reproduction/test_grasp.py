"""Grasping: small data sets already reach the published figures; pictures, and the loop of the page."""

import importlib.metadata
import json
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from threadpoolctl import threadpool_limits

import unconstrain as uc
from reproduction import published
from reproduction.grasp import experiment, figures, trial, video
from reproduction.grasp.interaction import FORESEEN_RATE, MIDDLE, NOTHING, Interaction
from reproduction.plants.barrier import CLEARANCE
from reproduction.plants.grasping import Attractor, Demonstrator, constrain
from reproduction.plants.posture import demonstrate
from reproduction.plants.rendering import NoOpenGL
from reproduction.plants.robot_choice import OUR_OWN, RobotChoice

pytest.importorskip("mujoco")
pytest.importorskip("mink")


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    with threadpool_limits(1):  # as in every process of an experiment
        yield


@pytest.fixture(scope="module")
def demonstrator():
    return trial.make_demonstrator(OUR_OWN)


@pytest.fixture(scope="module")
def recorded(demonstrator):
    return trial.record_training(demonstrator, 0, n=50, duration=1.0)


@pytest.fixture(scope="module")
def policies(demonstrator, recorded):
    learnt = {kind: trial.learn(recorded[0].demonstrations, kind)[0] for kind in ("inconsistency", "direct")}
    return {"expert": demonstrator.policy, **learnt}


def test_the_policy_is_the_paper_s_gradient(demonstrator):
    policy, rng = demonstrator.policy, np.random.default_rng(0)
    X = policy.target + 0.3 * rng.standard_normal((5, 6))

    def potential(x):
        return 0.25 * (1 - np.exp(-np.sum((x - policy.target) ** 2, axis=-1) / (2 * 2.0)))

    h = 1e-6 * np.eye(6)
    gradient = (potential(X[:, None] + h) - potential(X[:, None] - h)) / 2e-6
    np.testing.assert_allclose(policy(X), -16.0 * gradient, atol=1e-8)
    np.testing.assert_allclose(Attractor(policy.target)(policy.target[None]), 0.0)


def test_what_is_recorded_is_the_policy_behind_the_barrier(demonstrator, recorded):
    recording, obstacle = recorded
    D = recording.demonstrations
    expected = np.einsum("nij,nj->ni", D.projections, D.policy)
    assert np.linalg.norm(D.actions - expected) < 2e-3 * np.linalg.norm(expected)
    assert recording.tracking < 2e-3
    assert recording.movements_blocked >= 0.5
    assert uc.metrics.inconsistency(D.actions, D.policy) < 1e-5 * uc.metrics.inconsistency(
        D.actions, 0 * D.policy
    )
    # No hand gets nearer to its barrier than half the clearance.
    X = D.states.reshape(D.n_episodes, -1, 2, 3)
    for k in range(X.shape[1]):
        for hand in range(2):
            assert obstacle.nearest(X[:, k, hand])[0].min() > 0.5 * CLEARANCE


def test_fifty_short_movements_reach_table_two(demonstrator, recorded, policies):
    test = trial.record_training(demonstrator, 1, n=8)[0].demonstrations
    ours = trial.measure_columns(demonstrator, test, policies["inconsistency"].predict(test.states))
    direct = trial.measure_columns(demonstrator, test, policies["direct"].predict(test.states))
    assert list(ours) == list(published.GRASP)
    assert ours["training constraints (nCPE)"] <= ours["unconstrained (nUPE)"]
    for column in ours:
        assert direct[column] > 10 * ours[column]


def test_potential_features_go_far_below(demonstrator, recorded):
    policy, name = trial.learn(recorded[0].demonstrations, "inconsistency", "potential")
    test = trial.record_training(demonstrator, 1, n=4)[0].demonstrations
    assert name == "potential"
    assert max(trial.measure_columns(demonstrator, test, policy.predict(test.states)).values()) < 1e-3
    with pytest.raises(uc.errors.UnconstrainError, match="choose local, potential or auto"):
        trial.make_model("inconsistency", "deep")


def test_the_unseen_barrier_is_in_the_middle(demonstrator):
    scene = demonstrator.scene
    before = scene.origin + np.array([scene.barrier_x - scene.thickness / 2 - 0.01, 0, 0])
    X = np.concatenate([before, before + np.array([0, 0.3, 0])])[None]
    N, blocked = constrain(scene.central(1), X, np.ones((1, 6)))
    assert blocked.tolist() == [[True, False]]
    np.testing.assert_allclose(np.diag(N[0]), [0, 1, 1, 1, 1, 1], atol=1e-12)


def test_grasp_reproduces_and_goes_on_from_kept_trials(tmp_path, monkeypatch, demonstrator, recorded):
    quiet = Console(quiet=True)
    small = {
        "inconsistency": dict.fromkeys(published.GRASP, 0.001),
        "direct": dict.fromkeys(published.GRASP, 0.4),
    }
    facts = (
        "movements that meet the barrier",
        "samples the barrier blocks",
        "movements that meet the unseen barrier",
    )
    small |= {"inconsistency model": "local", "direct model": "local", "tracking error": 1e-4}
    small |= dict.fromkeys(facts, 0.9)
    inferred = {"adaptive": dict.fromkeys(published.GRASP, 0.0005)}
    monkeypatch.setattr(experiment, "run_trials", lambda *_, **__: [small])
    monkeypatch.setattr(experiment, "run_adaptive", lambda *_, **__: [inferred])
    monkeypatch.setattr(trial, "record_training", lambda *_: recorded)
    outcome = experiment.reproduce(tmp_path, trials=1, console=quiet)
    assert "0.0056 ± 0.0022 | 0.0010 ± 0.0000 | 400 | 0.0005 ± 0.0000 |" in outcome.table
    assert "over 1 data set, of adaptive over the first 1 data set." in outcome.table
    assert any("by adaptive and in brackets by inconsistency" in finding for finding in outcome.findings)
    for path in (*outcome.figures, *outcome.files):
        assert path.stat().st_size > 0
    assert json.loads((tmp_path / "trials.json").read_text())["trials"] == [small]


def test_a_trial_of_the_grasp_in_small(demonstrator):
    result = trial.run_trial(0, n_episodes=10, duration=0.4)
    assert set(published.GRASP) < set(result["direct"])
    again = trial.run_trial(0, n_episodes=10, duration=0.4, risks=("inconsistency",))
    assert again["inconsistency"] == result["inconsistency"], "the data set is the same whatever the risks"
    assert "direct" not in again
    json.dumps(result)


def test_a_real_robot_by_path_learns_one_short_data_set():
    files = importlib.metadata.files("example-robot-data") or []
    found = [file for file in files if file.name == "g1_29dof_rev_1_0.urdf"]
    if not found:
        pytest.skip("example-robot-data has no G1")
    choice = RobotChoice.parse(
        Path(str(found[0].locate())),
        "waist_roll_joint,waist_pitch_joint",
        "left_rubber_hand,right_rubber_hand",
        "left_ankle_roll_link,right_ankle_roll_link",
    )
    D, _ = demonstrate(choice.load(), 2, 5, random_state=0)
    assert D.states.shape == (10, 27)
    recording, _ = trial.record_training(Demonstrator(choice.load()), 0, n=2, duration=0.2)
    assert recording.tracking < 0.01
    assert recording.demonstrations.actions.any(axis=1).all()


def test_pictures_of_the_robot(tmp_path, demonstrator, policies):
    try:
        frame = next(video.render_frames(demonstrator, {"expert": policies["expert"]}))
    except NoOpenGL:
        pytest.skip("no OpenGL")
    assert frame.shape == (576, 480, 3)
    # The ball is orange, and in the picture.
    red, green, blue = frame.reshape(-1, 3).astype(int).T
    assert np.count_nonzero((red > 150) & (green < 130) & (blue < 60)) > 200
    with pytest.raises(uc.errors.UnconstrainError, match=r"end the name in \.mp4"):
        video.write_video(tmp_path / "grasp.gif", demonstrator, policies)
    assert not list(tmp_path.iterdir())


def test_without_opengl_a_sentence_and_the_other_figures(
    tmp_path, monkeypatch, demonstrator, recorded, policies
):
    def missing(*_, **__):
        raise NoOpenGL("there is no OpenGL to draw with here")

    monkeypatch.setattr(figures, "Camera", missing)
    pictures = figures.write_pictures(tmp_path, demonstrator, *recorded, policies)
    assert [path.name for path in pictures.shown] == ["fig6.png"]
    assert "no OpenGL" in pictures.left_out[0]


def test_what_is_in_the_way_is_changed_while_the_robot_moves(demonstrator):
    robot = Interaction(demonstrator, {"expert": demonstrator.policy, "still": lambda X: 0 * X})
    before = robot.body.hands
    robot.change(width=0.27, aside=0.02)
    low, high = robot.obstacle.low[0], robot.obstacle.high[0]
    np.testing.assert_allclose([high[1, 1], low[0, 1]], [0.02 - 0.135, 0.02 + 0.135])
    assert robot.step() > 0.05
    assert np.linalg.norm(robot.body.hands - before) > 1e-3
    robot.change(kind=MIDDLE, width=0.3, aside=0.1)
    np.testing.assert_allclose([robot.obstacle.low[0, 0, 1], robot.obstacle.high[0, 0, 1]], [-0.05, 0.25])
    assert robot.change(kind=NOTHING, width=9.0).width == demonstrator.scene.span
    assert robot.obstacle is None
    robot.policy = "still"
    assert robot.step() < 1e-3
    robot.restart()
    assert robot.seconds == 0.0
    assert demonstrator.scene.admits(robot.body.hands)
    with pytest.raises(uc.errors.UnconstrainError, match="'a moat' cannot be in the way"):
        robot.change(kind="a moat")


def test_the_way_foreseen_is_the_policy_s_behind_the_barrier(demonstrator, policies):
    robot = Interaction(demonstrator, {"learnt": policies["inconsistency"]})
    robot.change(width=0.1)
    ways, held = robot.foresee()
    np.testing.assert_allclose(ways[0], robot.body.hands)
    steps = np.diff(ways, axis=0) * FORESEEN_RATE
    wanted = policies["inconsistency"].predict(ways[:-1].reshape(-1, 6)).reshape(-1, 2, 3)
    np.testing.assert_allclose(steps[~held[:-1]], wanted[~held[:-1]], atol=1e-9)
    assert held.any(axis=0).all(), "the gap is too narrow for both hands"
    assert (robot.obstacle.nearest(ways[:, 0])[0] > 0.5 * CLEARANCE).all()
    with pytest.raises(uc.errors.PolicyError, match="mine was learnt over 2 states"):
        Interaction(demonstrator, {"mine": uc.ParametricPolicy().fit(np.eye(2), np.eye(2))})
