"""How far a movement has come: states with a phase, in memory, from files, and in streams."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import unconstrain as uc
from unconstrain.cli.app import run
from unconstrain.errors import DataError
from unconstrain.recordings.phase import add_phase, phase_of
from unconstrain.spaces import Numbers, SecondOrder

COLUMNS = {"state": ["x", "y"], "time": "t", "episode": "run"}


@pytest.fixture(scope="module")
def presses():
    """Movements to a button, where they dwell, and back the same way; they take between 1.6 and 2.4 s."""
    rng = np.random.default_rng(0)
    parts = []
    for episode, duration in enumerate([1.6, 2.0, 2.4, 2.0, 1.8, 2.2]):
        t = np.arange(0, duration + 1e-9, 0.02)
        gone = np.interp(t / duration, [0, 0.35, 0.6, 1], [0, 1, 1, 0])
        gone = (gone**2 * (3 - 2 * gone))[:, None]
        start = 0.05 * rng.normal(size=2)
        x = start + gone * ([1.0, 0.5] - start) + 0.001 * rng.normal(size=(len(t), 2))
        parts.append(pd.DataFrame({"run": episode, "t": t + 7 * episode, "x": x[:, 0], "y": x[:, 1]}))
    return pd.concat(parts, ignore_index=True)


@given(
    steps=st.lists(st.floats(1e-3, 1.0), min_size=1, max_size=20),
    start=st.floats(-1e3, 1e3),
    unit=st.floats(1e-2, 1e2),
    seed=st.integers(0, 2**32 - 1),
)
@settings(max_examples=30, deadline=None)
def test_a_phase_rises_from_0_to_1_whatever_the_clock(steps, start, unit, seed):
    time = np.cumsum([0.0, *steps])
    phase = phase_of(time, np.zeros(len(time), np.int64))
    assert (phase[0], phase[-1]) == (0.0, 1.0)
    assert np.all(np.diff(phase) > 0)
    # Two episodes that are interleaved do not know of each other.
    both, codes = np.append(time, start + unit * time), np.repeat([0, 1], len(time))
    order = np.random.default_rng(seed).permutation(len(both))
    assert np.allclose(phase_of(both[order], codes[order]), np.append(phase, phase)[order], atol=1e-6)


@pytest.mark.parametrize("options", [{}, {"relative_to": "goal"}, {"moving_centre": 0.5}, {"order": 2}])
def test_a_file_a_stream_and_memory_agree(presses, options, tmp_path):
    path = tmp_path / "presses.parquet"
    presses.to_parquet(path, row_group_size=150)
    opened = uc.open(path, phase=True, **COLUMNS, **options)
    demos = opened.load()
    added = add_phase(uc.load(presses, **COLUMNS, **options))
    assert np.array_equal(demos.states, added.states)
    assert (
        demos.space.of == added.space.of == (SecondOrder(Numbers(2)) if options.get("order") else Numbers(2))
    )
    assert [demos.space.duration, added.space.duration] == pytest.approx([2.0, 2.0])
    assert demos.state_names == added.state_names
    assert demos.state_names[-1] == "phase"
    (said,) = [note for note in demos.notes if "phase" in note]
    assert said in added.notes
    assert "2 s, between 1.6 and 2.4 s" in said
    streamed = uc.fit_stream(uc.ParametricPolicy(risk="direct", alpha=1e-3), opened, batch_rows=100)
    loaded = uc.ParametricPolicy(risk="direct", alpha=1e-3).fit(demos)
    assert streamed.space_ == demos.space
    assert np.allclose(streamed.predict(demos.states), loaded.predict(demos.states), atol=1e-9)
    demos.save(tmp_path / "saved.npz")
    again = uc.load(tmp_path / "saved.npz")
    assert again.space == demos.space
    assert np.array_equal(again.states, demos.states)


def test_fragments_go_on_counting_in_their_episode(presses):
    since = presses.t - 7 * presses.run
    broken = presses[(presses.run != 3) | (since < 0.1) | ((since > 0.5) & (since < 1.0)) | (since > 1.5)]
    demos = uc.load(broken, phase=True, **COLUMNS)
    assert demos.episode_labels[3:6] == ("3/1", "3/2", "3/3")
    assert demos.episode("3/2").states[0, -1] == pytest.approx(0.52 / 2.0)
    assert demos.space.duration == pytest.approx(2.0)
    added = add_phase(uc.load(broken, **COLUMNS))
    assert np.allclose(added.states, demos.states)
    assert added.space.duration == pytest.approx(2.0)
    # The first fragment is left out, and its time counts all the same.
    left = uc.load(broken, phase=True, min_duration=0.3, resample=25.0, **COLUMNS)
    assert left.episode("3/1").states[0, -1] == pytest.approx(0.52 / 2.0)


def test_time_may_be_counted_by_rows(presses):
    plain = {"state": ["x", "y"], "episode": "run"}
    counted = uc.load(presses, rate=50.0, phase=True, **plain)
    stamped = uc.load(presses, phase=True, **COLUMNS)
    assert np.allclose(counted.states, stamped.states)
    assert counted.space.duration == pytest.approx(2.0)
    alone = uc.load(presses[presses.run == 2], state=["x", "y"], time="t", phase=True)
    assert alone.space.duration == pytest.approx(2.4)
    assert alone.states[[0, -1], -1].tolist() == [0.0, 1.0]
    kept = uc.load(presses, phase=True, drop="short", min_duration=1.9, **COLUMNS)
    assert kept.space.duration == pytest.approx(np.mean([2.0, 2.4, 2.0, 2.2]))


def test_a_movement_that_dwells_is_explained_by_its_phase(presses, tmp_path, capsys):
    presses.to_csv(tmp_path / "presses.csv", index=False)
    policy, out = tmp_path / "policy.skops", tmp_path / "movement.csv"
    demos = uc.load(presses, **COLUMNS)
    explained = [
        uc.LocallyLinearPolicy(risk="direct").fit(each).score(each.states, each.actions)
        for each in (demos, add_phase(demos))
    ]
    assert explained[0] < 0.2
    assert explained[1] > 0.95
    command = [
        "fit",
        tmp_path / "presses.csv",
        "--state",
        "x,y",
        "--time",
        "t",
        "--episode",
        "run",
        "--phase",
    ]
    assert run([*map(str, command), "--risk", "direct", "--out", str(policy)]) == 0
    assert "--phase" not in capsys.readouterr().out  # it is no guess
    assert run(["rollout", str(policy), "--start", "0,0", "--steps", "110", "--out", str(out),
                "--figure", str(tmp_path / "movement.png")]) == 0  # fmt: skip
    assert "phase 1, here after 2 s" in capsys.readouterr().out
    movement = pd.read_csv(out)
    assert np.allclose(movement.phase, np.minimum(movement.t / 2.0, 1.0))
    assert np.hypot(movement.x - 1.0, movement.y - 0.5).min() < 0.05
    assert np.hypot(movement.x, movement.y).iloc[100] < 0.25


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"time": None, "action": ["x", "y"]},
            "phase needs to know the time of each sample; give time= or rate=",
        ),
        ({"phase": 1}, "phase must be True or False, got 1"),
    ],
)
def test_mistakes_are_one_sentence(presses, options, message):
    with pytest.raises(DataError, match=message):
        uc.load(presses, **{**COLUMNS, "phase": True, **options})


def test_states_that_have_a_phase_or_no_time_get_none(presses):
    demos = uc.load(presses, phase=True, **COLUMNS)
    with pytest.raises(DataError, match="have a phase already"):
        add_phase(demos)
    for options in ({"phase": True}, {"order": 2}, {"moving_centre": 0.5}):
        with pytest.raises(DataError, match="have a phase already"):
            uc.open(demos, **options)
    with pytest.raises(DataError, match="needs to know the time"):
        add_phase(uc.Demonstrations([[0.0], [1.0]], [[1.0], [1.0]]))
    with pytest.raises(DataError, match="lasts any time"):
        add_phase(uc.Demonstrations([[0.0]], [[1.0]], time=[3.0]))


def test_joined_demonstrations_keep_what_their_states_are(presses):
    plain = uc.load(presses, **COLUMNS)
    demos = add_phase(plain)
    one, others = (add_phase(plain.select(chosen)) for chosen in (plain.episodes == 0, plain.episodes > 0))
    joined = uc.Demonstrations.concatenate([one, others])
    assert joined.space.of == demos.space.of
    assert joined.space.duration == pytest.approx(demos.space.duration)
    with pytest.raises(DataError, match="of demonstrations 0 and 1"):
        uc.Demonstrations.concatenate([one, uc.Demonstrations(one.states, one.actions)])
