"""Time, actions, angles and rest: nothing is misread in silence, and what is guessed can be overruled."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import unconstrain as uc
from unconstrain.errors import DataError

TIME = np.arange(200) * 0.02
X = np.sin(2 * TIME)


def csv(path, **columns):
    lines = [",".join(columns)]
    for row in zip(*(np.asarray(values).tolist() for values in columns.values()), strict=True):
        lines.append(",".join("" if value != value else str(value) for value in row))
    path.write_text("\n".join(lines) + "\n")
    return path


def parquet(path, **columns):
    pq.write_table(pa.table(columns), path, row_group_size=50)
    return path


def noted(demos, *words):
    """The one note in which all of these words are."""
    found = [note for note in demos.notes if all(word in note for word in words)]
    assert len(found) == 1, demos.notes
    return found[0]


def read(demos):
    return noted(demos, "read: ")


@pytest.mark.parametrize("step", [1 / 2000, 1 / 1000, 0.02, 0.1])
@pytest.mark.parametrize(("unit", "ticks"), [("s", 1), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_the_size_of_an_epoch_decides(tmp_path, step, unit, ticks):
    stamps = 1_700_000_000 * ticks + np.arange(200) * step * ticks
    stamps = stamps if unit == "s" or step * ticks < 1 else stamps.astype(np.int64)
    path = parquet(tmp_path / "a.parquet", x=X, t=stamps)
    demos = uc.load(path, state="x", time="t", window=10 * step)
    assert demos.time[-1] == pytest.approx(199 * step, rel=1e-3)
    assert read(demos).endswith(f"time in {unit}")
    assert all(
        "noise" in note for note in demos.notes[:-1]
    )  # that of stamps rounded to the precision of a float


@pytest.mark.parametrize(
    ("step", "unit"), [(0.02, "s"), (20, "ms"), (100, "ms"), (20_000, "us"), (100_000, "us"), (2e7, "ns")]
)
def test_other_units_are_guessed_by_the_step_and_said(tmp_path, step, unit):
    demos = uc.load(
        parquet(tmp_path / "a.parquet", x=X, t=np.arange(200) * step), state="x", time="t", window=1
    )
    assert read(demos).endswith(f"time in {unit}")
    if unit != "s":
        assert "give time_unit=" in noted(demos, f"in {unit}, by its typical step")


def test_frame_numbers_are_not_seconds_in_silence(tmp_path):
    path = parquet(tmp_path / "a.parquet", x=X, frame=np.arange(200))
    assert "give rate= or time_unit=" in noted(
        uc.load(path, state="x", time="frame", window=5), "goes up by 1"
    )
    demos = uc.load(path, state="x", time="frame", rate=50, window=0.2)
    np.testing.assert_allclose(demos.time, TIME)
    assert demos.notes == ("read: 200 samples, 1 episode, 1 file, 50 Hz, 3.98 s, time in frames",)
    ms = uc.load(path, state="x", time="frame", time_unit="ms", window=0.02)
    assert ms.time[-1] == pytest.approx(0.199)


def test_all_files_of_an_opening_have_one_unit(tmp_path):
    one = parquet(tmp_path / "one.parquet", x=X, t=np.arange(200) * 20)
    two = parquet(tmp_path / "two.parquet", x=X, t=np.arange(200) * 600)
    demos = uc.load([one, two], state="x", time="t", window=2)
    assert demos.time[-1] == pytest.approx(199 * 0.6)
    assert noted(demos, "two.parquet", "taken to be in us").startswith("two.parquet: time is read in ms")


def test_without_a_time_column_a_rate(tmp_path):
    path = csv(tmp_path / "a.csv", x=np.concatenate([X, X]), run=np.repeat([0, 1], 200))
    with pytest.raises(DataError, match="rate="):
        uc.load(path, state="x")
    demos = uc.load(path, state="x", episode="run", rate=50)
    np.testing.assert_allclose(demos.time, np.tile(TIME, 2))
    np.testing.assert_allclose(demos.actions[:, 0], np.tile(2 * np.cos(2 * TIME), 2), atol=0.1)
    assert read(demos) == "read: 400 samples, 2 episodes, 1 file, 50 Hz, 7.96 s, time by row / rate"


def test_what_is_missing_repeated_or_short_is_left_out_and_counted(tmp_path):
    x, t = X.copy(), TIME.copy()
    x[[5, 50]] = np.nan
    t[100] = t[99]
    run = np.where(np.arange(200) < 198, "long", "short")
    path = csv(tmp_path / "a.csv", x=x, t=t, run=run)
    with pytest.raises(DataError, match='drop="missing"'):
        uc.load(path, state="x", time="t", episode="run")
    with pytest.raises(DataError, match='drop="duplicates"'):
        uc.load(path, state="x", time="t", episode="run", drop="missing")
    with pytest.raises(DataError, match='drop="short"'):
        uc.load(path, state="x", time="t", episode="run", drop=["missing", "duplicates"])
    demos = uc.load(path, state="x", time="t", episode="run", drop="missing, duplicates,short")
    assert len(demos) == 200 - 2 - 1 - 2
    assert demos.episode_labels == ("long",)
    assert "left out 2 rows" in noted(demos, "missing")
    assert "left out 1 row " in noted(demos, "stamp")
    assert "1 fragment (2 samples)" in noted(demos, "dropped")
    with pytest.raises(DataError, match="drop takes missing, duplicates, short, pauses"):
        uc.load(path, state="x", time="t", drop="late")


def test_lists_with_holes_are_left_out(tmp_path):
    lists = [[float(x), 1.0] for x in X]
    lists[7], lists[9] = None, [np.nan, 1.0]
    path = parquet(tmp_path / "a.parquet", x=lists, u=X)
    demos = uc.load(path, state="x", action="u", drop="missing")
    assert len(demos) == 198
    np.testing.assert_array_equal(demos.actions[:, 0], np.delete(X, [7, 9]))


def test_commanded_states_are_no_velocities(tmp_path):
    rng = np.random.default_rng(0)
    states = np.column_stack([np.sin(2 * TIME), np.cos(3 * TIME)])
    target = np.roll(states, -1, axis=0) + 0.01 * rng.normal(size=states.shape)
    path = parquet(tmp_path / "a.parquet", x=list(states), u=list(target), t=TIME)
    demos = uc.load(path, state="x", action="u", time="t")
    assert "action_is=" in noted(demos, "commanded states")
    np.testing.assert_allclose(demos.actions, np.gradient(states, TIME, axis=0), atol=0.1)
    assert demos.action_names == ("x[0]_dot", "x[1]_dot")
    as_given = uc.load(path, state="x", action="u", time="t", action_is="velocity")
    np.testing.assert_array_equal(as_given.actions, target)
    assert len(as_given.notes) == 1
    said = uc.load(path, state="x", action="u", time="t", action_is="target")
    np.testing.assert_array_equal(said.actions, demos.actions)
    assert "give time= or rate=" in noted(uc.load(path, state="x", action="u"), "commanded states")


def test_steps_are_divided_by_the_time_that_passes(tmp_path):
    increments = np.append(np.diff(X), 0.0)
    path = parquet(tmp_path / "a.parquet", x=X, u=increments, t=TIME)
    demos = uc.load(path, state="x", action="u", time="t")
    noted(demos, "steps to the next state", "action_is=")
    np.testing.assert_allclose(demos.actions[:, 0], increments / 0.02)
    assert uc.load(path, state="x", action="u", time="t", action_is="velocity").actions[0] == increments[0]


def test_velocities_stay_what_they_are(tmp_path):
    path = parquet(tmp_path / "a.parquet", x=X, u=2 * np.cos(2 * TIME), t=TIME)
    demos = uc.load(path, state="x", action="u", time="t")
    np.testing.assert_array_equal(demos.actions[:, 0], 2 * np.cos(2 * TIME))
    assert len(demos.notes) == 1


def test_bursts_are_said_and_do_no_harm(tmp_path):
    arrival = np.repeat(TIME[::3], 3)[:200] + 2e-5 * (np.arange(200) % 3)
    path = parquet(tmp_path / "a.parquet", x=TIME, t=arrival)
    demos = uc.load(path, state="x", time="t", window=0.4)
    assert "resample=" in noted(demos, "come in bursts")
    assert demos.n_episodes == 1
    np.testing.assert_allclose(demos.actions[5:-5, 0], 1.0, atol=0.2)
    even = uc.load(path, state="x", time="t", resample=50)
    np.testing.assert_allclose(even.actions[5:-5, 0], 1.0, atol=0.05)


def test_resampling_is_linear_and_never_across_gaps(tmp_path):
    t = np.concatenate([TIME, TIME + 10.0])
    path = parquet(tmp_path / "a.parquet", x=2 * t, u=3 * t, t=t)
    demos = uc.load(path, state="x", action="u", time="t", resample=25, action_is="velocity")
    assert demos.n_episodes == 2
    np.testing.assert_allclose(np.diff(demos.time[demos.episodes == 0]), 0.04)
    np.testing.assert_allclose(demos.states[:, 0], 2 * demos.time)
    np.testing.assert_allclose(demos.actions[:, 0], 3 * demos.time)
    assert not np.any((demos.time > TIME[-1]) & (demos.time < 10))
    assert " 25 Hz" in read(demos)


def test_pauses_are_said_and_left_out_on_request(tmp_path):
    still = np.concatenate([X[:100], np.full(100, X[100]), X[100:]])
    path = parquet(tmp_path / "a.parquet", x=still, t=np.arange(300) * 0.02)
    demos = uc.load(path, state="x", time="t")
    assert 'drop="pauses"' in noted(demos, "are at rest", "1 pause of")
    moving = uc.load(path, state="x", time="t", drop="pauses")
    assert 90 <= len(demos) - len(moving) <= 100
    noted(moving, "left out", "pause")


@pytest.mark.parametrize("turn", [2 * np.pi, 360.0])
@pytest.mark.parametrize("low", [0.0, 0.5])
def test_angles_that_wrap_are_recognised(tmp_path, turn, low):
    angle = turn * TIME / 2
    wrapped = (angle + low * turn) % turn - low * turn
    path = parquet(tmp_path / "a.parquet", yaw=wrapped, x=X, t=TIME)
    demos = uc.load(path, state=["x", "yaw"], time="t")
    np.testing.assert_allclose(demos.actions[:, 1], turn / 2, rtol=1e-6)
    assert 'angle="none"' in noted(demos, "yaw wraps")
    as_is = uc.load(path, state=["x", "yaw"], time="t", angle="none")
    assert abs(as_is.actions[:, 1]).max() > turn
    said = uc.load(path, state=["x", "yaw"], time="t", angle="yaw")
    np.testing.assert_array_equal(said.actions, demos.actions)
    with pytest.raises(DataError, match="angle= names states"):
        uc.load(path, state="x", time="t", angle="yaw")


def test_quaternions_keep_their_sign(tmp_path):
    q = np.column_stack([np.cos(TIME / 2), np.sin(TIME / 2), 0 * TIME, 0 * TIME])
    flipped = q * np.where((np.arange(200) // 30) % 2, -1.0, 1.0)[:, None]
    columns = {name: flipped[:, i] for i, name in enumerate(("qw", "qx", "qy", "qz"))}
    path = parquet(tmp_path / "a.parquet", px=X, **columns, t=TIME)
    demos = uc.load(path, state=["px", *columns], time="t")
    np.testing.assert_array_equal(demos.states[:, 1:], q)
    assert abs(demos.actions[:, 1:]).max() < 0.51
    noted(demos, "quaternion qw,qx,qy,qz", "6 times")


def test_numbers_near_zero_beside_a_scalar_part_are_no_quaternion(tmp_path):
    q = np.column_stack([np.cos(TIME / 20), np.sin(TIME / 20), 0 * TIME, 0 * TIME])
    flipped = q * np.where((np.arange(200) // 30) % 2, -1.0, 1.0)[:, None]
    columns = {name: flipped[:, i] for i, name in enumerate(("qw", "qx", "qy", "qz"))}
    path = parquet(tmp_path / "a.parquet", px=1e-2 * X, py=1e-2 * X, pz=0 * X, **columns, t=TIME)
    demos = uc.load(path, state=["px", "py", "pz", *columns], time="t")
    np.testing.assert_array_equal(demos.states[:, 3:], q)
    np.testing.assert_array_equal(demos.states[:, 0], 1e-2 * X)


OPTIONS = [
    {},
    {"drop": "missing,duplicates,short,pauses"},
    {"drop": "missing", "resample": 30.0},
    {"drop": "missing", "min_speed": 0.1},
    {"action": "u", "drop": "missing"},
    {"action": "u", "drop": "missing", "action_is": "increment"},
    {"action": "u", "drop": "missing", "resample": 20.0, "action_is": "velocity"},
    {"action": "u", "drop": "missing,short", "action_is": "target"},
    {"action": "u", "drop": "missing", "time": None, "rate": 50.0, "angle": "yaw"},
]


@pytest.mark.parametrize("options", OPTIONS)
@pytest.mark.parametrize("batch_rows", [1, 70, 1000])
def test_blocks_hold_what_loading_gives(tmp_path, options, batch_rows):
    t, x = np.tile(TIME, 4), np.tile(X, 4)
    yaw = (4 * t + np.pi) % (2 * np.pi) - np.pi
    if options:
        x[::37] = np.nan
    path = parquet(tmp_path / "a.parquet", x=x, yaw=yaw, u=x * 0.1, v=yaw, t=t, run=np.repeat(range(4), 200))
    options = {"time": "t"} | options
    if options.get("action"):
        options["action"] = ["u", "v"]
    recordings = uc.open(path, state=["x", "yaw"], episode="run", **options)
    whole = recordings.load()
    blocks = list(recordings.blocks(batch_rows))
    for name in ("states", "actions", "time"):
        np.testing.assert_array_equal(
            np.concatenate([getattr(b, name) for b in blocks]), getattr(whole, name)
        )
    assert tuple(map(str, recordings.notes)) == whole.notes
    policy = uc.ParametricPolicy(risk="direct", alpha=1.0)
    streamed = uc.fit_stream(policy, recordings, batch_rows=batch_rows)
    loaded = uc.ParametricPolicy(risk="direct", alpha=1.0, space=whole.space).fit(whole.states, whole.actions)
    np.testing.assert_allclose(streamed.predict(whole.states), loaded.predict(whole.states), atol=1e-9)
    read(whole)
    assert any(str(note).startswith(f"read: {len(whole)} samples, 4 episodes") for note in recordings.notes)


def test_an_episode_too_short_once_it_is_resampled_is_named_or_left_out(tmp_path):
    t = np.concatenate([np.arange(300) / 50, np.arange(60) / 50])
    path = tmp_path / "a.parquet"
    run = np.repeat(["long", "short"], [300, 60])
    pq.write_table(pa.table({"t": t, "run": run, "x": np.sin(t)}), path)
    given = {"state": "x", "time": "t", "episode": "run", "resample": 1.0}
    with pytest.raises(
        DataError, match=r"a.parquet: episode 'short' has .* at resample=1 Hz; .* raise resample="
    ):
        uc.load(path, **given)
    demos = uc.load(path, **given, drop="short")
    assert demos.episode_labels == ("long",)
    assert len(demos) == 6
