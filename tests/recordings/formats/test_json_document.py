"""JSON documents in the arrangements that programs write."""

import json

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.errors import DataError

N = 30
T = (np.arange(N) / 50).tolist()
X = np.column_stack([np.sin(T), np.cos(T)]).tolist()
TABLE = [[t, *x] for t, x in zip(T, X, strict=True)]
BY_COLUMN = {name: {str(i): row[j] for i, row in enumerate(TABLE)} for j, name in enumerate(("t", "x", "y"))}
RECORDS = [
    {"t": t, "pose": {"x": x, "y": y}, "both": [x, y], "who": "me"} for t, (x, y) in zip(T, X, strict=True)
]


@pytest.mark.parametrize(
    ("held", "state", "time"),
    [
        (RECORDS, "pose", "t"),
        (RECORDS, "both", "t"),
        ({"meta": {"robot": "ur5"}, "frames": RECORDS}, "frames.both", "frames.t"),
        ({"t": T, "pos": X, "rate": 50}, "pos", "t"),
        ({"data": {"pos": X}, "rate": 50}, "data.pos", "time"),
        (TABLE, ["array[1]", "array[2]"], "array[0]"),
        (BY_COLUMN, ["x", "y"], "t"),
        ({"columns": ["t", "x", "y"], "index": list(range(N)), "data": TABLE}, ["x", "y"], "t"),
    ],
)
@pytest.mark.parametrize("indent", [None, 1])
@pytest.mark.parametrize("name", ["a.json", "a"])
def test_arrangements(tmp_path, held, state, time, indent, name):
    path = tmp_path / name
    path.write_text(json.dumps(held, indent=indent))
    demos = uc.load(path, state=state, time=time)
    np.testing.assert_allclose(demos.states, X)
    np.testing.assert_allclose(demos.time, T)
    assert uc.inspect(path).next


def test_a_list_of_demonstrations(tmp_path):
    demos = [{"name": f"d{i}", "t": T[: N - i], "pos": X[: N - i]} for i in range(3)]
    (tmp_path / "a.json").write_text(json.dumps(demos))
    loaded = uc.load(tmp_path / "a.json", state="pos")
    assert loaded.n_episodes == 3
    assert len(loaded) == 3 * N - 3


def test_what_some_records_lack_is_missing(tmp_path):
    records = [dict(record) for record in RECORDS]
    del records[4]["both"]
    records[5]["pose"] = None
    (tmp_path / "a.json").write_text(json.dumps(records))
    for state in ("both", "pose"):
        with pytest.raises(DataError, match="holds nan"):
            uc.load(tmp_path / "a.json", state=state, time="t")
        assert len(uc.load(tmp_path / "a.json", state=state, time="t", drop="missing")) == N - 1


@pytest.mark.parametrize("content", ['{"a": [1, 2', "[" * 5000, '{"a": {}}', "[]", '{"a": [1, "b", {}]}'])
def test_damage_is_one_sentence(tmp_path, content):
    (tmp_path / "a.json").write_text(content)
    with pytest.raises(DataError, match=r"a.json") as caught:
        uc.load(tmp_path / "a.json", state="a", time="t")
    assert "\n" not in str(caught.value)


def test_json_lines_that_were_cut(tmp_path):
    lines = "".join(json.dumps(record) + "\n" for record in RECORDS)
    (tmp_path / "a.jsonl").write_text(lines + '{"t": 4.0, "po')
    demos = uc.load(tmp_path / "a.jsonl", state="pose", time="t")
    assert len(demos) == N
    assert "the last line is cut off" in demos.notes[0]


def test_stamps_of_ros_in_json_lines(tmp_path):
    stamps = [{"sec": 100 + int(t), "nanosec": round(t % 1 * 1e9)} for t in T]
    lines = [json.dumps({"stamp": stamp, "x": x, "y": y}) for stamp, (x, y) in zip(stamps, X, strict=True)]
    (tmp_path / "a.jsonl").write_text("\n".join(lines) + "\n")
    demos = uc.load(tmp_path / "a.jsonl", state=["x", "y"], time="time")
    np.testing.assert_allclose(demos.time, T, atol=1e-9)
    assert "time is made of stamp.sec and stamp.nanosec" in demos.notes[0]
