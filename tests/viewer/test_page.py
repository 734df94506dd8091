"""The page without a browser: its life, what follows a drag, and what is said in one sentence."""

import socket
import sys
import threading
import time

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.errors import DataError, PolicyError, UnconstrainError
from unconstrain.limit_cycle import demonstrate
from unconstrain.viewer import exporting
from unconstrain.viewer.following import choose_steps
from unconstrain.viewer.newest import Newest
from unconstrain.viewer.obstacles import BOTH, BOX, PLANE


def test_the_newest_is_worked_on_and_what_waits_longer_is_dropped():
    begun, go_on, done, failed = threading.Event(), threading.Event(), [], []

    def work(item):
        begun.set()
        go_on.wait(5)
        done.append(item)
        if item == 4:
            raise ValueError("four")

    newest = Newest(work, failed.append)
    newest.give(0)
    assert begun.wait(5)
    for item in (1, 2, 3, 4):
        newest.give(item)
    go_on.set()
    assert newest.settle()
    newest.close()
    assert done == [0, 4]
    assert str(failed[0]) == "four"


def test_a_rollout_follows_what_is_dragged_free_or_not(page, policy):
    stage = page.stage
    point = np.array([0.3, -0.2, 0.0])
    page.start.drag_to(point)
    assert page.settle()
    np.testing.assert_allclose(stage.places(stage.start[None])[0], point, atol=1e-9)
    np.testing.assert_array_equal(stage.movement.states[0], stage.start)
    free = stage.movement.states[-1].copy()
    page.put_in_the_way(BOTH)
    page.obstacles.place(PLANE, point - [0.0, 0.01, 0.0], np.array([1.0, 0.0, 0.0, 1.0]) / np.sqrt(2.0))
    assert page.settle()
    barred = stage.places(stage.movement.states)
    assert np.linalg.norm(stage.movement.states[-1] - free) > 0.01
    assert barred[:, 1].min() >= point[1] - 0.01 - 1e-9
    page.put_in_the_way("nothing")
    page.show_policy("ordinary regression")
    assert page.settle()
    steps, dt = choose_steps(stage.seconds, stage.interval)
    assert dt == pytest.approx(0.02)
    expected = policy.ordinary_regression().rollout(stage.start, steps, dt, beyond=np.inf)
    np.testing.assert_allclose(stage.movement.states, expected.states[: len(stage.movement)], atol=1e-9)
    assert page.notes == []


def test_a_rollout_stops_where_nothing_was_recorded_unless_it_may_go_on(page):
    above = np.array([0.0, 1.6 * page.stage.frame.extent, 0.0])
    page.start.drag_to(page.stage.frame.middle + above)
    assert page.settle()
    assert len(page.stage.movement) == 1
    assert '"May leave what was recorded" lets it go on.' in page.controls.ending.content
    page.controls.anywhere.value = True
    until = time.monotonic() + 10
    while len(page.stage.movement) == 1:
        assert time.monotonic() < until
        time.sleep(0.02)


def test_a_time_line_plays_and_tells_where_the_rollout_is(page):
    seen = []
    page.on_state(seen.append)
    page.timeline.speed = 4.0
    page.control_time("play")
    time.sleep(0.4)
    page.control_time("pause")
    at = page.timeline.time
    assert 0 < at <= page.timeline.duration
    assert len(seen) > 2
    movement = page.stage.movement
    np.testing.assert_array_equal(seen[-1], movement.states[np.searchsorted(movement.time, at - 1e-9)])
    page.control_time("to start")
    np.testing.assert_array_equal(seen[-1], movement.states[0])


def test_what_is_not_determined_is_computed_when_it_is_asked_for(page):
    assert page.diagnosis.words == ""
    page.show_diagnosis(True)
    assert page.settle()
    assert "Determined:" in page.diagnosis.words
    assert page.diagnosis.words.count("no. ") == 3


def test_files_hold_what_is_seen(page, tmp_path):
    path = tmp_path / "rollout.csv"
    path.write_bytes(exporting.csv(page.stage.movement))
    read = uc.load(path, state=["x1", "x2"], action=["x1_velocity", "x2_velocity"], time="t")
    np.testing.assert_allclose(read.states, page.stage.movement.states)
    drawn = page.draw_svg()
    assert drawn.startswith(b"<?xml")
    assert b"</svg>" in drawn
    from matplotlib.image import imread

    half = np.zeros((2, 3, 4), dtype=np.uint8)
    half[..., 3] = 128
    (tmp_path / "a.png").write_bytes(exporting.png(half))
    np.testing.assert_allclose(imread(tmp_path / "a.png")[..., :3], 127 / 255, atol=0.01)


@pytest.mark.parametrize(
    ("error", "sentence", "options"),
    [
        (
            DataError,
            "3 states and 3 actions, and the policy 2 and 2",
            {"demos": uc.Demonstrations(np.eye(3), np.eye(3))},
        ),
        (DataError, "demos= must be Demonstrations", {"demos": np.eye(2)}),
        (DataError, "two or three different ones of x1, x2", {"coordinates": [0, 5]}),
        (DataError, "two or three different ones of x1, x2", {"coordinates": ["x1", "x2"]}),
        (DataError, "rows of 2 numbers", {"constraint": [[1.0, 0.0, 0.0]]}),
        (DataError, "rows of 2 numbers", {"constraint": "plane"}),
        (DataError, "lock= is of a robot: name its file with robot=", {"lock": ["joint"]}),
        (UnconstrainError, "'999.1.1.1' is no address of this computer", {"host": "999.1.1.1"}),
        (PolicyError, "port must be a whole number", {"port": -1}),
        (PolicyError, "a policy of unconstrain, got int", {"policy": 3}),
    ],
)
def test_a_mistake_is_one_sentence(error, sentence, options, policy, demos):
    given = {"policy": policy, "demos": demos, "port": 0} | options
    with pytest.raises(error, match=sentence):
        uc.view(given.pop("policy"), given.pop("demos"), **given)


def test_a_port_that_is_taken_and_a_missing_extra_are_said(policy, demos, monkeypatch):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(
            UnconstrainError, match=f"cannot be served at port {port} .* choose another with port="
        ):
            uc.view(policy, demos, port=port)
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(UnconstrainError, match=r"pip install 'unconstrain\[view\]'"):
        uc.view(policy, demos)


def test_without_recordings_the_places_of_learning_are_shown(policy):
    page = uc.view(policy, port=0)
    try:
        assert page.settle()
        assert "no recordings were given" in page.notes[0]
        assert (policy.distance(page.stage.states) == 0).all()
    finally:
        page.close()


def test_many_samples_are_thinned_and_it_is_said(policy, monkeypatch):
    from unconstrain.viewer import samples

    monkeypatch.setattr(samples, "MOST", 50)
    demos = demonstrate(5, random_state=0)
    shown = samples.choose(policy, demos)
    assert len(shown.demos) <= 50
    assert f"of {len(demos)} samples one in" in shown.notes[0]
    monkeypatch.setattr(samples, "MOST", 100)
    short = demonstrate(50, random_state=0)
    short = short.select(np.flatnonzero(np.arange(len(short)) % 40 < 4))
    shown = samples.choose(policy, short)
    assert "of 50 episodes one in" in shown.notes[0]
    assert shown.joined.mean() > 0.7


def test_other_coordinates_are_shown_in_a_scene_of_their_own():
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, size=(200, 4)) * [1, 10, 100, 1]
    demos = uc.Demonstrations(X, -X, np.arange(200) // 20, state_names=["a", "b", "c", "d"])
    page = uc.view(uc.ParametricPolicy().fit(demos), demos, port=0)
    try:
        page.put_in_the_way(BOTH)
        page.show_coordinates([2, 0])
        assert page.settle()
        assert page.stage.coordinates.names == ("c", "a")
        assert page.stage.frame.is_flat
        assert page.stage.frame.extent == pytest.approx(2.0)
        held = page.stage.start.copy()
        page.start.drag_to(np.array([0.5, 0.0, 0.0]))
        page.move_start(1, 3.0)
        assert page.settle()
        assert page.stage.start[2] == pytest.approx(page.stage.frame.centre[0] + 0.5 / page.stage.frame.scale)
        np.testing.assert_allclose(page.stage.start[[1, 3]], [3.0, held[3]])
        assert page.notes == []
    finally:
        page.close()


def test_a_box_that_was_shown_before_is_forgotten_with_its_coordinates(page):
    for chosen in (BOX, "nothing"):
        page.put_in_the_way(chosen)
    page.show_coordinates([1, 0])
    assert page.settle()
    assert page.notes == []


def test_what_fails_is_said_and_the_time_line_goes_on(page):
    def fail(state):
        raise ValueError("<b>no</b>")

    page.on_state(fail)
    page.timeline.play()
    time.sleep(0.1)
    before = page.timeline.time
    time.sleep(0.1)
    assert page.timeline.time != before
    assert "ValueError: &lt;b&gt;no&lt;/b&gt;" in page.controls.notes.content
    # A number that is typed is sent as it is, also beyond its slider's range.
    for typed, taken in ((-3.0, page.controls.seconds.min), (1e9, page.controls.seconds.max)):
        page.controls.seconds.value = typed
        assert page.stage.seconds == pytest.approx(taken)
    with pytest.raises(PolicyError, match="seconds must be a finite number"):
        page.set_seconds(float("nan"))


def test_names_are_no_html_and_one_sample_is_enough(policy, demos):
    named = uc.Demonstrations(demos.states[:1], demos.actions[:1], state_names=["<b>x</b>", "y"])
    page = uc.view(policy, named, port=0)
    try:
        page.show_diagnosis(True)
        assert page.settle()
        assert "&lt;b&gt;x&lt;/b&gt;" in page.controls.ending.content
        assert page.notes == []
        assert "Determined" in page.diagnosis.words
    finally:
        page.close()


def test_a_rollout_may_last_longer_than_its_slider_reaches_at_first(page):
    longer = 2 * page.controls.seconds.max
    page.set_seconds(longer)
    assert page.controls.seconds.max == page.controls.seconds.value == longer
