"""`load` on good recordings: formats, columns, episodes, time, splitting; and `save`."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, UnconstrainError
from unconstrain.recordings import load
from unconstrain.recordings import open as open_recordings

RECORDED = Path(__file__).resolve().parents[2] / ".." / "shared" / "data"
recorded = pytest.mark.skipif(not RECORDED.is_dir(), reason="the recorded data are not beside the project")

TIME = np.arange(60) * 0.02
LINE = np.column_stack([TIME, 1 - 2 * TIME])  # moves at (1, -2) per second


def written(path, text):
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def rows(header, *columns, delimiter=","):
    lines = [header] if header else []
    lines += [delimiter.join(map(str, row)) for row in zip(*columns, strict=True)]
    return "\n".join(lines) + "\n"


def line_csv(path, header="t,x,y", delimiter=",", time=TIME):
    return written(path, rows(header, time.tolist(), *LINE.T.tolist(), delimiter=delimiter))


def same(one: Demonstrations, two: Demonstrations):
    for name in ("states", "actions", "episodes", "time", "policy", "projections"):
        a, b = getattr(one, name), getattr(two, name)
        assert (a is None) == (b is None), name
        if a is not None:
            np.testing.assert_array_equal(a, b, err_msg=name)
    for name in ("state_names", "action_names", "episode_labels", "notes"):
        assert getattr(one, name) == getattr(two, name)
    return True


def test_actions_are_differentiated_where_none_are_given(tmp_path):
    demos = load(line_csv(tmp_path / "line.csv"), state=["x", "y"], time="t")
    np.testing.assert_array_equal(demos.states, LINE)
    np.testing.assert_allclose(demos.actions, np.tile([1.0, -2.0], (60, 1)), atol=1e-9)
    np.testing.assert_array_equal(demos.time, TIME)
    assert demos.state_names == ("x", "y")
    assert demos.action_names == ("x_dot", "y_dot")
    assert demos.episode_labels == ("line",)
    assert demos.notes == (
        "the states show no noise, so velocities are those of the fewest samples; window= smooths states over as many "
        "seconds",
        "read: 60 samples, 1 episode, 1 file, 50 Hz, 1.18 s, time in s",
    )
    assert load(tmp_path / "line.csv", state=["x", "y"], time="t", window=0.2).notes == demos.notes[1:]


def test_action_columns_need_no_time(tmp_path):
    demos = load(written(tmp_path / "a.csv", "x,u,v\n1,2,3\n4,5,6\n"), state="x", action=["u", "v"])
    assert demos.states.tolist() == [[1.0], [4.0]]
    assert demos.actions.tolist() == [[2.0, 3.0], [5.0, 6.0]]
    assert demos.action_names == ("u", "v")
    assert demos.time is None


@pytest.mark.parametrize("delimiter", [",", ";", "\t", " ", "   "])
@pytest.mark.parametrize("header", [True, False])
def test_delimiter_and_header_are_found(tmp_path, delimiter, header):
    names = delimiter.join("txy") if header else ""
    demos = load(line_csv(tmp_path / "a.txt", names, delimiter), state=[1, 2], time=0)
    np.testing.assert_array_equal(demos.states, LINE)
    assert demos.state_names == (("x", "y") if header else ("x1", "x2"))


@pytest.mark.parametrize(
    "text",
    [
        "\ufeffx,u\r\n1.5,2\r\n2.5,3\r\n",
        "x,u\r1.5,2\r2.5,3\r",
        "# made by hand\n\nx,u\n1.5,2\n# a remark\n\n2.5,3",
        "# made by hand\n# x,u\n1.5,2\n2.5,3\n",
        '"x","u"\n"1.5","2"\n 2.5, 3\n',
        "x;u\n1,5;2\n2,5;3\n",
        "x\tu\n1,5\t2\n2,5\t3\n",
        "x u\n1.5  2\n  2.5 3\n",
        "x,u,who\n1.5,2,me\n2.5,3,you\n",
    ],
)
def test_text_as_it_comes(tmp_path, text):
    demos = load(written(tmp_path / "a.csv", text), state="x", action="u")
    assert demos.states.tolist() == [[1.5], [2.5]]
    assert demos.actions.tolist() == [[2.0], [3.0]]


@pytest.mark.parametrize("mark", [";", "\t"])
def test_a_decimal_comma_is_told(tmp_path, mark):
    # It may have been meant to set off thousands.
    path = written(tmp_path / "a.csv", f"x{mark}u\n1,500{mark}2\n2,250{mark}3\n")
    demos = load(path, state="x", action="u")
    assert demos.states.tolist() == [[1.5], [2.25]]
    assert demos.notes == (
        "a.csv: commas in numbers are read as decimal marks",
        "read: 2 samples, 1 episode, 1 file, without time",
    )
    recordings = open_recordings(path, state="x", action="u")
    assert sum(len(block) for block in recordings.blocks(1)) == 2
    assert tuple(map(str, recordings.notes)) == demos.notes


def test_the_header_of_unnamed_pandas_columns(tmp_path):
    demos = load(written(tmp_path / "a.csv", ",0,1\n0,5,6\n1,7,8\n"), state="0", action="1")
    assert demos.states.tolist() == [[5.0], [7.0]]


def test_text_beside_numbers_is_no_header(tmp_path):
    path = written(tmp_path / "a.csv", "run1,0.5,1\nrun1,0.25,2\nrun2,3,4\n")
    demos = load(path, state=1, action=2, episode=0)
    assert demos.episode_labels == ("run1", "run2")
    assert len(demos) == 3


def test_repeated_names_are_chosen_by_position(tmp_path):
    path = written(tmp_path / "a.csv", "t,x,x\n0,1,2\n1,3,5\n")
    assert load(path, state=[1], action=[2]).states.tolist() == [[1.0], [3.0]]
    with pytest.raises(DataError, match=r"2 columns called 'x', at positions 1, 2 .* by position instead"):
        load(path, state="x", action="t")


def test_npz_arrays_are_columns(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(
        path, position=LINE.astype(">f8"), u=LINE[:, :1], run=np.repeat(["a", "b"], 30), other=np.ones(())
    )
    demos = load(path, state="position", action="u", episode="run")
    np.testing.assert_array_equal(demos.states, LINE)
    assert demos.state_names == ("position[0]", "position[1]")
    assert demos.episode_labels == ("a", "b")
    np.testing.assert_array_equal(load(path, state="position[1]", action="u").states, LINE[:, 1:])


@pytest.mark.parametrize("fixed", [True, False])
def test_parquet_lists_stand_for_their_columns(tmp_path, fixed):
    kind = pa.list_(pa.float32(), 2) if fixed else pa.list_(pa.float32())
    table = pa.table(
        {
            "observation.state": pa.array(LINE.tolist(), kind),
            "timestamp": pa.array(TIME, pa.float32()),
            "episode_index": pa.array([7] * 60),
            "task": pa.array(["wipe"] * 60).dictionary_encode(),
        }
    )
    pq.write_table(table, tmp_path / "a.parquet", row_group_size=25)
    demos = load(tmp_path / "a.parquet", state="observation.state", time="timestamp", episode="episode_index")
    np.testing.assert_array_equal(demos.states, LINE.astype(np.float32))
    np.testing.assert_allclose(demos.actions, np.tile([1.0, -2.0], (60, 1)), atol=1e-4)
    assert demos.episode_labels == ("7",)
    assert load(
        tmp_path / "a.parquet", state="observation.state", time="timestamp", episode="task"
    ).episode_labels == ("wipe",)


def test_interleaved_episodes_are_differentiated_apart_and_keep_their_order(tmp_path):
    x = np.empty(120)
    x[0::2], x[1::2] = TIME, 5 - 3 * TIME
    path = written(tmp_path / "a.csv", rows("t,x,run", np.repeat(TIME, 2), x, ["b", "a"] * 60))
    demos = load(path, state="x", time="t", episode="run")
    np.testing.assert_array_equal(demos.states[:, 0], x)
    assert demos.episode_labels == ("b", "a")
    np.testing.assert_allclose(demos.actions[:, 0], np.tile([1.0, -3.0], 60), atol=1e-9)


def test_every_file_is_an_episode_and_with_a_column_every_value_in_it(tmp_path):
    (tmp_path / "sub").mkdir()
    text = "x,u,run\n1,2,1\n3,4,2\n"
    one, two = written(tmp_path / "one.csv", text), written(tmp_path / "two.csv", text)
    assert load([one, two], state="x", action="u").episode_labels == ("one", "two")
    assert load(str(tmp_path / "*.csv"), state="x", action="u").episode_labels == ("one", "two")
    demos = load([one, two], state="x", action="u", episode="run")
    assert demos.episode_labels == ("one:1", "one:2", "two:1", "two:2")
    assert demos.episodes.tolist() == [0, 1, 2, 3]
    other = written(tmp_path / "sub" / "one.csv", text)
    assert load([one, other], state="x", action="u").episode_labels == (str(one), str(other))


def test_positions_that_mean_other_columns_elsewhere_are_told(tmp_path):
    one = written(tmp_path / "one.csv", "x,y,u\n1,2,3\n4,5,6\n")
    two = written(tmp_path / "two.csv", "y,x,u\n1,2,3\n4,5,6\n")
    with pytest.raises(DataError, match=r"are x, y in .*one.csv but y, x in .*two.csv"):
        load([one, two], state=[0, 1], action=2)
    assert len(load([one, two], state=["x", "y"], action="u")) == 4


@pytest.mark.parametrize(
    ("stamps", "unit"),
    [
        (1498555031.0 + TIME, None),
        ((TIME * 1e9).astype(int) + 1498555031990452357, None),
        ((TIME * 1e9).astype(int).astype(float), None),
        ((TIME * 1e3).astype(int), "ms"),
        ((TIME * 1e6).astype(int), "us"),
        ((TIME * 1e9).astype(int), "ns"),
        (np.datetime64("2024-02-29T23:59:59.5", "ns") + (TIME * 1e9).astype("m8[ns]"), None),
        ([f"{t}Z" for t in np.datetime64("2024-02-29", "ns") + (TIME * 1e9).astype("m8[ns]")], None),
    ],
)
def test_units_of_time(tmp_path, stamps, unit):
    path = written(tmp_path / "a.csv", rows("t,x", stamps, TIME))
    demos = load(path, state="x", time="t", time_unit=unit, window=0.2)
    np.testing.assert_allclose(demos.time, TIME, atol=1e-6)
    guess = "a.csv: time is taken to be in ns, by its typical step of 2e+07"
    assert [note.split(";")[0] for note in demos.notes[:-1] if "noise" not in note] == (
        [guess] if stamps[0] == 0.0 and not unit else []
    )
    assert demos.notes[-1].startswith("read: 60 samples, 1 episode, 1 file, 50 Hz, 1.18 s, time in ")


def test_nanoseconds_lose_nothing(tmp_path):
    ticks = 1498555031990452357 + np.cumsum(np.random.default_rng(0).integers(15_000_000, 25_000_000, 60))
    np.savez(tmp_path / "a.npz", t=ticks.astype(np.uint64), x=TIME)
    expected = (ticks - ticks[0]) / 1e9
    np.testing.assert_array_equal(load(tmp_path / "a.npz", state="x", time="t").time, expected)
    written(tmp_path / "a.csv", rows("t,x", ticks, TIME))
    np.testing.assert_array_equal(load(tmp_path / "a.csv", state="x", time="t").time, expected)
    pq.write_table(pa.table({"t": pa.array(ticks, pa.timestamp("ns")), "x": TIME}), tmp_path / "a.parquet")
    np.testing.assert_array_equal(load(tmp_path / "a.parquet", state="x", time="t").time, expected)


def test_a_doubtful_unit_is_noted(tmp_path):
    path = written(tmp_path / "a.csv", rows("t,x", (TIME * 1e3).astype(int), TIME))
    note, _ = load(path, state="x", time="t", window=0.2).notes
    assert note == (
        "a.csv: time is taken to be in ms, by its typical step of 20; if that is wrong, give time_unit=, or rate= for "
        "the numbers of frames"
    )


def test_a_gap_splits_and_short_fragments_go(tmp_path):
    time = np.concatenate([TIME, TIME[:3] + 5, TIME + 10])
    path = written(tmp_path / "a.csv", rows("t,x", time, time))
    demos = load(path, state="x", time="t", window=0.2)
    assert demos.episode_labels == ("a/1", "a/2")
    assert demos.episodes.tolist() == [0] * 60 + [1] * 60
    assert demos.time[60] == pytest.approx(10)  # a fragment keeps its place in the recording
    assert demos.notes == (
        "a.csv: split at 2 gaps longer than 5 typical steps",
        "a.csv: dropped 1 fragment (3 samples) shorter than 0.2 s",
        "read: 120 samples, 2 episodes, 1 file, 50 Hz, 2.36 s, time in s",
    )
    assert load(path, state="x", time="t", gap=20).n_episodes == 1
    assert load(path, state="x", action="x", time="t").n_episodes == 1
    assert load(path, state="x", action="x", time="t", gap=1).n_episodes == 3


def test_a_jump_splits_only_where_max_speed_is_given(tmp_path):
    x = TIME.copy()
    x[30] += 5.0
    path = written(tmp_path / "a.csv", rows("t,x", TIME, x))
    noted = load(path, state="x", time="t")
    assert noted.n_episodes == 1
    assert "2 steps more than 30 times faster than 95 %" in noted.notes[0]
    clean = load(path, state="x", time="t", max_speed=2)
    assert len(clean) == 59
    assert clean.episode_labels == ("a/1", "a/2")
    np.testing.assert_allclose(clean.actions, 1.0, atol=1e-9)
    long = load(path, state="x", time="t", max_speed=2, min_duration=0.57)
    assert long.episode_labels == ("a",)
    np.testing.assert_array_equal(long.states, TIME[:30, None])
    with pytest.raises(DataError, match="no fragment lasts 1 s"):
        load(path, state="x", time="t", max_speed=2, min_duration=1)


def test_slow_samples_are_left_out(tmp_path):
    path = written(tmp_path / "a.csv", "x,u\n1,2\n3,0\n4,5\n")
    demos = load(path, state="x", action="u", min_speed=1)
    assert demos.states[:, 0].tolist() == [1.0, 4.0]
    assert demos.notes == (
        "left out 1 of 3 samples slower than 1",
        "read: 2 samples, 1 episode, 1 file, without time",
    )


@recorded
def test_the_recorded_circles():
    files = [RECORDED / "planer_circle.csv", RECORDED / "curve_circle.csv"]
    demos = load(files, state=[1, 2, 3], time="rosbagTimestamp")
    assert len(demos) == 3060 + 3012
    assert demos.episode_labels == ("planer_circle", "curve_circle")
    assert demos.state_names == ("x", "y", "z")
    assert len(demos.notes) == 3
    assert demos.notes[0].startswith("planer_circle.csv: 6 steps more than 30 times faster")

    clean = load(files, state=[1, 2, 3], time="rosbagTimestamp", max_speed=1, min_duration=1)
    assert clean.notes[:-2] == (
        "planer_circle.csv: split at 6 steps faster than 1 per second",
        "planer_circle.csv: dropped 3 fragments (51 samples) shorter than 1 s",
    )
    assert clean.n_episodes == 5
    assert np.linalg.norm(clean.actions, axis=1).max() < 1.0


names = st.text(min_size=1, max_size=5)


@settings(deadline=None, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data(), st.sampled_from([".npz", ".parquet"]))
def test_what_is_saved_comes_back_exactly(tmp_path, data, suffix):
    N, n, d = (data.draw(st.integers(1, top)) for top in (9, 3, 3))
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    used, codes = np.unique(rng.integers(0, 4, N), return_inverse=True)
    maybe = st.booleans()
    projections = np.where(rng.random((N, 1, 1)) < 0.3, np.nan, rng.normal(size=(N, d, d)))  # NaN: not known
    demos = Demonstrations(
        states=rng.normal(size=(N, n)),
        actions=rng.normal(size=(N, d)) * 1e-300,
        episodes=codes,
        time=rng.normal(size=N) if data.draw(maybe) else None,
        policy=rng.normal(size=(N, d)) if data.draw(maybe) else None,
        projections=projections if data.draw(maybe) else None,
        state_names=data.draw(st.lists(names, min_size=n, max_size=n)),
        action_names=data.draw(st.lists(names, min_size=d, max_size=d)),
        episode_labels=data.draw(st.lists(names, min_size=len(used), max_size=len(used))),
        notes=data.draw(st.lists(names, max_size=2, unique=True)),
    )
    path = tmp_path / f"saved{suffix}"
    demos.save(path)
    assert same(load(path), demos)


def test_saved_parquet_is_plain_to_others_and_may_be_filtered(tmp_path):
    demos = Demonstrations(
        LINE, LINE, np.repeat([0, 1, 2], 20), TIME, state_names=["x", "y"], action_names=["x", "w"]
    )
    demos.save(tmp_path / "a.parquet")
    table = pq.read_table(tmp_path / "a.parquet")
    assert table.column_names == ["episode", "time", "x", "y", "x_2", "w"]
    pq.write_table(table.slice(20), tmp_path / "b.parquet")
    assert load(tmp_path / "b.parquet").episode_labels == ("1", "2")
    both = load([tmp_path / "a.parquet", tmp_path / "b.parquet"])
    assert both.episode_labels == ("0", "1", "2", "1 (2)", "2 (2)")


def test_save_leaves_nothing_where_it_fails(tmp_path):
    demos = Demonstrations(LINE, LINE)
    with pytest.raises(DataError, match=r"ends in .npz or .parquet"):
        demos.save(tmp_path / "a.csv")
    with pytest.raises(UnconstrainError, match="there is no folder"):
        demos.save(tmp_path / "none" / "a.npz")
    assert list(tmp_path.iterdir()) == []
