"""States relative to a start, a goal, columns, or a centre that moves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import unconstrain as uc
from unconstrain.errors import DataError
from unconstrain.recordings.relative import moving_centre


@pytest.fixture
def reaches(tmp_path):
    """Write five reaches to goals of their own, which drift."""
    rng = np.random.default_rng(0)
    rows = []
    for episode in range(5):
        goal, at = rng.uniform(-5, 5, 2), rng.uniform(-5, 5, 2)
        drift = rng.uniform(-0.3, 0.3, 2)
        for k in range(80):
            rows.append((episode, 0.02 * k, *at, *goal))
            at = at + 0.02 * (2.0 * (goal - at) + drift)
            goal = goal + 0.02 * drift
    path = tmp_path / "reaches.csv"
    np.savetxt(path, rows, delimiter=",", header="run,t,x,y,gx,gy", comments="")
    return path


def read(path, **options):
    return uc.open(path, state=["x", "y"], time="t", episode="run", **options)


def test_relative_to_columns_that_move_a_reach_is_one_policy(reaches):
    demos = read(reaches, relative_to=["gx", "gy"]).load()
    # Smoothing over 0.2 s blunts steep starts.
    np.testing.assert_allclose(demos.actions, -2.0 * demos.states, rtol=0.05, atol=0.05)
    plain = read(reaches).load()
    np.testing.assert_allclose(
        demos.states, plain.states - np.loadtxt(reaches, delimiter=",", skiprows=1)[:, 4:]
    )
    assert "relative to the columns gx, gy" in " ".join(demos.notes)


@pytest.mark.parametrize(("which", "row"), [("start", 0), ("goal", -1)])
def test_relative_to_where_an_episode_starts_or_ends(reaches, which, row):
    plain, demos = read(reaches).load(), read(reaches, relative_to=which).load()
    for k in range(5):
        own = demos.episodes == k
        np.testing.assert_allclose(demos.states[own], plain.states[own] - plain.states[own][row])
    np.testing.assert_allclose(demos.actions, plain.actions)
    again = uc.open(plain, relative_to=which).load()
    np.testing.assert_allclose(again.states, demos.states)


@pytest.mark.parametrize(
    "options", [{"relative_to": "goal"}, {"moving_centre": 0.2}, {"relative_to": ["gx", "gy"]}]
)
def test_a_stream_reads_the_same(reaches, options):
    whole = read(reaches, **options).load()
    blocks = list(read(reaches, **options).blocks(100))
    np.testing.assert_allclose(np.concatenate([b.states for b in blocks]), whole.states)
    np.testing.assert_allclose(np.concatenate([b.actions for b in blocks]), whole.actions)


@given(
    st.floats(0.05, 2.0),
    st.lists(st.floats(-5, 5), min_size=2, max_size=2),
    st.integers(2, 200),
    st.integers(0, 99),
)
def test_a_moving_centre_of_what_rests_is_there_and_moves_along(seconds, place, n, seed):
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.005, 0.02, n))
    rests = np.tile(place, (n, 1))
    np.testing.assert_allclose(moving_centre(rests, time, seconds), rests, atol=1e-9)
    values = rng.standard_normal((n, 2))
    moved = moving_centre(values + place, time, seconds) - moving_centre(values, time, seconds)
    np.testing.assert_allclose(moved, rests, atol=1e-9)


def test_a_circle_about_a_centre_that_wanders_becomes_one_about_the_origin(tmp_path):
    t = np.arange(0, 30, 0.02)
    centre = np.stack([0.2 * t, np.sin(0.1 * t)], axis=1)
    x = centre + np.stack([np.cos(6 * t), np.sin(6 * t)], axis=1)
    path = tmp_path / "circles.csv"
    np.savetxt(path, np.column_stack([t, x]), delimiter=",", header="t,x,y", comments="")
    demos = uc.load(path, state=["x", "y"], time="t", moving_centre=0.5)
    inside = slice(100, -100)
    np.testing.assert_allclose(np.linalg.norm(demos.states[inside], axis=1), 1.0, atol=0.05)
    turned = 6 * np.stack([-demos.states[:, 1], demos.states[:, 0]], axis=1)
    np.testing.assert_allclose(demos.actions[inside], turned[inside], atol=0.5)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"relative_to": ["gx"]}, "one column for each of the 2 states"),
        ({"relative_to": ["gx", "gz"]}, "gz"),
        (
            {"relative_to": ["gx", "gy"], "time": None, "action": ["x", "y"]},
            "relative_to needs to know the time",
        ),
        ({"moving_centre": 0.5, "time": None, "action": ["x", "y"]}, "moving_centre"),
        ({"moving_centre": -1.0}, "moving_centre must be a positive number"),
    ],
)
def test_mistakes(reaches, options, sentence):
    with pytest.raises(DataError, match=sentence):
        uc.load(reaches, **({"state": ["x", "y"], "time": "t", "episode": "run"} | options))


def test_a_stream_places_its_model_among_relative_states(reaches):
    recordings = read(reaches, relative_to=["gx", "gy"])
    prepared = {tuple(state) for state in recordings.load().states}
    states, actions = recordings.source.sample(50, 0)
    assert states.shape == actions.shape == (50, 2)
    assert {tuple(state) for state in states} <= prepared


def test_an_episode_too_short_for_columns_that_move_is_named(tmp_path):
    t = np.arange(100) / 50
    run = np.repeat([0, 1], [98, 2])
    path = tmp_path / "a.csv"
    rows = np.column_stack([run, t, np.sin(t), np.cos(t), np.cos(2 * t)])
    np.savetxt(path, rows, delimiter=",", header="run,t,x,u,g", comments="")
    given = {"state": "x", "action": "u", "time": "t", "episode": "run", "relative_to": "g"}
    with pytest.raises(DataError, match=r"a.csv: episode '1.*' has 2 samples .* drop="):
        uc.load(path, **given)
    demos = uc.load(path, **given, drop="short")
    assert len(demos) == 98
    assert "dropped 1 fragment" in " ".join(demos.notes)


def test_columns_that_move_are_not_differentiated_across_a_gap(tmp_path):
    t = np.arange(100) / 50 + 3.0 * (np.arange(100) >= 50)
    path = tmp_path / "a.csv"
    rows = np.column_stack([t, np.sin(t), np.cos(t), 2.0 * t + 30.0 * (t > 3)])
    np.savetxt(path, rows, delimiter=",", header="t,x,u,g", comments="")
    demos = uc.load(path, state="x", action="u", time="t", relative_to="g")
    np.testing.assert_allclose(demos.actions[:, 0], np.cos(t) - 2.0, atol=1e-9)
    assert demos.n_episodes == 2


def test_rows_without_what_states_are_relative_to_can_be_left_out(reaches):
    lines = reaches.read_text().splitlines()
    lines[3] = lines[3].rsplit(",", 1)[0] + ","
    reaches.write_text("\n".join(lines) + "\n")
    given = {"relative_to": ["gx", "gy"]}
    with pytest.raises(DataError, match=r"column 'gy' is empty at line 4; .* drop=\"missing\""):
        read(reaches, **given).load()
    demos = read(reaches, **given, drop="missing").load()
    assert len(demos) == 399
