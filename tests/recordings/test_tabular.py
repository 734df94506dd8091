"""JSON Lines, Excel workbooks, and data frames."""

import datetime
import json
import sys

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

import unconstrain as uc
from unconstrain.errors import DataError

TIME = np.arange(20) / 10
FRAME = pd.DataFrame({"t": TIME, "x": 1 + 2 * TIME, "y": 5 - TIME})
X = FRAME[["x", "y"]].to_numpy()
TXY = {"state": ["x", "y"], "time": "t"}


def polars(frame):
    return pytest.importorskip("polars").from_pandas(frame)


@pytest.mark.parametrize(
    "convert", [lambda frame: frame, polars, pa.Table.from_pandas, lambda frame: frame.set_index("t")]
)
def test_frames(convert):
    demos = uc.load(convert(FRAME), **TXY)
    np.testing.assert_array_equal(demos.states, X)
    np.testing.assert_array_equal(demos.time, TIME)
    blocks = list(uc.open(convert(FRAME), **TXY).blocks(7))
    np.testing.assert_array_equal(np.concatenate([block.states for block in blocks]), X)


def test_text_in_frames_tells_episodes_apart():
    frame = FRAME.assign(run=["a"] * 10 + ["b"] * 10)
    for each in (frame, polars(frame)):
        assert uc.load(each, **TXY, episode="run").episode_labels == ("a", "b")


def test_several_frames_are_an_episode_each():
    demos = uc.load([FRAME, FRAME + 1], **TXY)
    assert demos.episode_labels == ("frame 0", "frame 1")
    assert len(demos) == 40


def test_frames_that_are_alike_are_the_same_recording():
    one, two, other = (uc.open(frame, **TXY).identity() for frame in (FRAME, FRAME.copy(), FRAME + 1))
    assert one == two != other


def test_frames_of_something_else_are_told():
    for frame, options, sentence in [
        (FRAME, {"state": "q", "time": "t"}, "this frame has no column 'q'"),
        (pd.DataFrame({"a": [1, "x", {}]}), {"state": "a"}, "this frame cannot be read as a table"),
        (FRAME.x, {"state": "x"}, "this frame cannot be read as a table"),
        (FRAME.assign(x=np.nan), TXY, r"column 'x' is empty at row 0"),
    ]:
        with pytest.raises(DataError, match=sentence) as caught:
            uc.load(frame, **options)
        assert "\n" not in str(caught.value)


def test_json_lines(tmp_path):
    path = tmp_path / "a.jsonl"
    rows = [{"t": t, "pose": {"x": x, "y": y}, "both": [x, y]} for t, (x, y) in zip(TIME, X, strict=True)]
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    for state in (["pose.x", "pose.y"], "pose", "both"):
        np.testing.assert_array_equal(uc.load(path, state=state, time="t").states, X)
    (tmp_path / "a.txt").write_text(json.dumps(rows))
    np.testing.assert_array_equal(uc.load(tmp_path / "a.txt", state="both", time="t").states, X)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ('{"t": 1, "x": 2}\n{"t": oops\n', "a.jsonl cannot be read as JSON Lines"),
        ('{"t": 1, "x": 2}\n{"t": 2, "x": "a"}\n', "from number to string in row 1"),
        ("[1, 2]\n", "a.jsonl cannot be read as JSON Lines"),
        ('{"a":' * 5000, "a.jsonl"),
    ],
)
def test_json_lines_that_are_damaged(tmp_path, content, sentence):
    (tmp_path / "a.jsonl").write_text(content)
    with pytest.raises(DataError, match=sentence):
        uc.load(tmp_path / "a.jsonl", state="x", time="t")


def test_workbooks(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    FRAME.to_excel(tmp_path / "a.xlsx")
    demos = uc.load(tmp_path / "a.xlsx", **TXY, window=0.2)
    np.testing.assert_array_equal(demos.states, X)
    assert ["counts the rows" in note for note in demos.notes[:-1]] == [True]
    book = openpyxl.Workbook()
    sheet = book.active
    for row in (["Recorded by me"], [], ["t", "x", "y", "when"], ["s", "m", "m", None]):
        sheet.append(row)
    for t, (x, y) in zip(TIME.tolist(), X.tolist(), strict=True):
        sheet.append([t, x, y, datetime.datetime(2024, 1, 1) + datetime.timedelta(seconds=t)])
    book.create_sheet("other")
    book.save(tmp_path / "b.xlsx")
    for time in ("t", "when"):
        demos = uc.load(tmp_path / "b.xlsx", state=["x", "y"], time=time)
        np.testing.assert_array_equal(demos.states, X)
        np.testing.assert_allclose(demos.time, TIME, atol=1e-6)
    assert "of its parts 'Sheet' is read; part= names another one, of 'other'" in demos.notes[0]
    sheet["B10"] = "oops"
    book.save(tmp_path / "c.xlsx")
    with pytest.raises(DataError, match="column 'x' holds 'oops' at row 10"):
        uc.load(tmp_path / "c.xlsx", **TXY)
    (tmp_path / "d.xlsx").write_bytes((tmp_path / "b.xlsx").read_bytes()[:-100])
    with pytest.raises(DataError, match=r"d.xlsx is damaged or not an Excel workbook"):
        uc.load(tmp_path / "d.xlsx", **TXY)


@pytest.mark.parametrize(
    ("package", "name", "content", "extra"),
    [("openpyxl", "a.xlsx", b"PK\x03\x04", "xlsx"), ("ezc3d", "a.c3d", b"\x02\x50" + bytes(600), "c3d")],
)
def test_an_extra_that_is_missing_is_named(tmp_path, monkeypatch, package, name, content, extra):
    monkeypatch.setitem(sys.modules, package, None)
    (tmp_path / name).write_bytes(content)
    with pytest.raises(
        DataError, match=rf"{name} needs the package {package}.*pip install 'unconstrain\[{extra}\]'"
    ):
        uc.load(tmp_path / name, **TXY)


def test_what_actions_are_is_found_in_frames_too():
    t = np.arange(200) / 50
    x = np.sin(t)
    frame = pd.DataFrame({"t": t, "x": x, "u": np.append(x[2:], x[-2:])})
    demos = uc.load(frame, state="x", action="u", time="t")
    assert "nearly commanded states" in demos.notes[0]
    np.testing.assert_allclose(demos.actions[:, 0], np.cos(t), atol=0.05)
    recordings = uc.open(frame, state="x", action="u", time="t")
    assert recordings.preparation.action_is == "target"  # so that other frames are read alike
    as_given = uc.load(frame, state="x", action="u", time="t", action_is="velocity")
    np.testing.assert_array_equal(as_given.actions[:, 0], frame.u)


def test_what_actions_are_is_not_asked_of_demonstrations():
    demos = uc.load(FRAME, **TXY)
    with pytest.raises(DataError, match="action_is=target is about recorded actions"):
        uc.open(demos, action_is="target")


def test_records_in_parquet_and_feather(tmp_path):
    import pyarrow.feather
    import pyarrow.parquet as pq

    rows = [{"position": {"x": x, "y": y}, "both": [x, y]} for x, y in X]
    table = pa.table({"t": TIME, "pose": pa.array(rows)})
    pq.write_table(table, tmp_path / "a.parquet", row_group_size=7)
    pyarrow.feather.write_feather(table, tmp_path / "a.feather")
    for name in ("a.parquet", "a.feather"):
        for state in ("pose.position", ["pose.position.x", "pose.position.y"], "pose.both"):
            np.testing.assert_array_equal(uc.load(tmp_path / name, state=state, time="t").states, X)
        blocks = uc.open(tmp_path / name, state="pose.position", time="t").blocks(5)
        np.testing.assert_array_equal(np.concatenate([block.states for block in blocks]), X)
    whole = (tmp_path / "a.feather").read_bytes()
    (tmp_path / "a.feather").write_bytes(whole[:200])
    with pytest.raises(DataError, match=r"a.feather is damaged or not a Feather"):
        uc.load(tmp_path / "a.feather", state="pose.position", time="t")
