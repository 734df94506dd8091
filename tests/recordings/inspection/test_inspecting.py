"""What is found in a recording, and that the command that is proposed runs as it stands."""

import contextlib
import io
import json
import shlex
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import unconstrain as uc
from unconstrain.cli.app import run
from unconstrain.errors import DataError
from unconstrain.recordings.formats.text import Text

DATA = Path(__file__).parents[4] / "shared" / "data"


def write(path, **columns):
    """A CSV file; names with __ repeat what is before it."""
    names = [name.partition("__")[0] for name in columns]
    rows = zip(*(np.asarray(values).tolist() for values in columns.values()), strict=True)
    lines = [",".join(names), *(",".join("" if v != v else str(v) for v in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def circles(n=300, hz=50.0, turns=3.0):
    t = np.arange(n) / hz
    phase = 2 * np.pi * turns * t / t[-1]
    return t, phase


def say(*arguments):
    """Run the program, and return its exit code and what it prints."""
    said = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    with contextlib.redirect_stdout(said):
        code = run([str(each) for each in arguments])
    said.flush()
    return code, said.buffer.getvalue().decode()


def run_next(found, folder, *more):
    program, *arguments = (*shlex.split(found.next), *more)
    assert program == "unconstrain"
    with contextlib.chdir(folder):
        return say(*arguments)


def kinds(found):
    return [column.kind for column in found.columns]


def test_positions_are_differentiated_and_the_command_runs(tmp_path):
    t, phase = circles()
    path = write(tmp_path / "my wipe's.csv", t=t, x=np.cos(phase), y=np.sin(phase), z=0 * t)
    found = uc.inspect(path)
    assert kinds(found) == ["time", "position", "position", "constant"]
    assert found.rate_hz == pytest.approx(50)
    assert found.duration_s == pytest.approx(299 / 50)
    assert (found.rows, found.episodes) == (300, 1)
    assert "--state x,y --time t" in found.next
    code, said = run_next(found, tmp_path)
    assert code == 0
    assert "300 samples" in said


@pytest.mark.parametrize("factor", [1.0, 0.01])
def test_velocities_are_taken_only_if_they_are_the_derivative(tmp_path, factor):
    t, phase = circles()
    rate = 2 * np.pi * 3 / t[-1] * factor
    path = write(
        tmp_path / "a.csv",
        t=t,
        x=np.cos(phase),
        y=np.sin(phase),
        vx=-rate * np.sin(phase),
        vy=rate * np.cos(phase),
    )
    found = uc.inspect(path)
    assert ("--action vx,vy" in found.next) == (factor == 1.0)
    assert run_next(found, tmp_path)[0] == 0


def test_without_time_velocities_that_agree_are_enough(tmp_path):
    _, phase = circles()
    path = write(tmp_path / "a.csv", x1=np.cos(phase), x2=np.sin(phase), u1=-np.sin(phase), u2=np.cos(phase))
    found = uc.inspect(path)
    assert found.rate_hz is None
    assert "--action u1,u2" in found.next
    assert run_next(found, tmp_path)[0] == 0


@pytest.mark.parametrize("counted", [False, True])
def test_without_any_time_samples_are_counted_and_that_is_said(tmp_path, counted):
    _, phase = circles()
    frames = {"frame": np.arange(len(phase))} if counted else {}
    path = write(tmp_path / "circle.csv", **frames, x=np.cos(phase), y=np.sin(phase))
    found = uc.inspect(path)
    assert "--state x,y --rate 1.0" in found.next
    assert any("no column tells the time" in note and "--rate overrules" in note for note in found.notes)
    code, said = run_next(found, tmp_path, "--model", "linear")
    assert code == 0
    assert "time by row / rate" in said


def test_episodes_come_from_their_column(tmp_path):
    t, phase = circles(100)
    t, phase, run_ = np.tile(t, 4), np.tile(phase, 4), np.repeat(np.arange(4), 100)
    found = uc.inspect(write(tmp_path / "a.csv", run=run_, t=t, x=np.cos(phase), y=np.sin(phase)))
    assert found.episodes == 4
    assert kinds(found)[0] == "episode"
    assert "--episode run" in found.next
    assert run_next(found, tmp_path)[0] == 0


def test_a_column_that_changes_where_time_starts_anew_tells_episodes_apart(tmp_path):
    t, phase = circles(100)
    t, phase, which = np.tile(t, 3), np.tile(phase, 3), np.repeat([7, 3, 5], 100)
    found = uc.inspect(write(tmp_path / "a.csv", object=which, t=t, x=np.cos(phase), y=np.sin(phase)))
    assert "--episode object" in found.next
    assert any("time starts anew" in note for note in found.notes)


@pytest.mark.parametrize(
    ("unit", "ticks", "epoch"), [("ms", 1e3, 1.7e12), ("us", 1e6, 1.7e15), ("ns", 1e9, 1.7e18)]
)
def test_the_size_of_an_epoch_tells_the_unit(tmp_path, unit, ticks, epoch):
    t, phase = circles(hz=5)
    stamps = [int(epoch) + round(value * ticks) for value in t]
    found = uc.inspect(write(tmp_path / "a.csv", stamp=stamps, x=np.cos(phase), y=np.sin(phase)))
    assert found.columns[0].unit == unit
    assert found.rate_hz == pytest.approx(5, rel=1e-3)
    assert f"--time-unit {unit}" in found.next


def test_episodes_may_be_called_by_text(tmp_path):
    t, phase = circles(100)
    t, phase, names = np.tile(t, 3), np.tile(phase, 3), np.repeat(["demo_0", "demo_1", "demo_2"], 100)
    found = uc.inspect(write(tmp_path / "a.csv", demo=names, t=t, x=np.cos(phase), y=np.sin(phase)))
    assert found.episodes == 3
    assert found.columns[0].kind == "episode"
    assert "--episode demo" in found.next
    assert run_next(found, tmp_path)[0] == 0


def test_a_state_with_a_missing_value_is_kept_or_it_is_said_what_is_left_out(tmp_path):
    t, phase = circles()
    x = np.cos(phase)
    x[40] = np.nan
    found = uc.inspect(write(tmp_path / "a.csv", t=t, x=x, y=np.sin(phase)))
    assert "1 missing value, in x" in found.notes
    assert (
        "--state x,y" in found.next or "x: left out of the state; --state overrules the choice" in found.notes
    )
    assert run_next(found, tmp_path)[0] == 0


def test_oddities_are_noted(tmp_path):
    t, phase = circles()
    t = t.copy()
    t[100:] += 2.0
    quaternion = np.stack([0 * phase, 0 * phase, np.sin(phase / 2), np.cos(phase / 2)])
    quaternion[:, 150:] *= -1
    yaw = np.degrees((phase + np.pi) % (2 * np.pi) - np.pi)
    q = dict(zip(("qx", "qy", "qz", "qw"), quaternion, strict=True))
    temperature = np.where(np.arange(300) % 50 == 0, np.nan, 20.5)
    path = write(
        tmp_path / "a.csv",
        t=t,
        x=np.cos(phase),
        y=np.sin(phase),
        heading=yaw,
        **q,
        temp=temperature,
        fixed=t * 0 + 4,
    )
    found = uc.inspect(path)
    notes = " ".join(found.notes)
    assert kinds(found)[3:8] == ["angle", *["quaternion"] * 4]
    assert found.columns[3].unit == "deg"
    assert "1 gap" in notes
    assert "changes its sign 1 time" in notes
    assert "wraps by 360 3 times" in notes or "wraps by 360 2 times" in notes
    assert "6 missing values" in notes
    assert "fixed" in notes
    assert "--state x,y " in found.next
    assert run_next(found, tmp_path)[0] == 0


def test_a_table_without_movement_says_so_and_is_no_mistake(tmp_path):
    rng = np.random.default_rng(0)
    path = write(tmp_path / "people.csv", age=rng.integers(20, 60, 50), name=["Ann", "Bob"] * 25)
    code, said = say("inspect", path, "--json")
    found = json.loads(said)
    assert code == 0
    assert found["next"] is None
    assert any("no " in note for note in found["notes"])
    assert set(found) == {"rows", "episodes", "rate_hz", "duration_s", "columns", "notes", "next"}
    assert found["columns"][1] == {"name": "name", "kind": "text", "unit": None}


def test_several_files_are_episodes(tmp_path):
    t, phase = circles()
    paths = [write(tmp_path / f"{i}.csv", t=t, x=np.cos(phase + i), y=np.sin(phase)) for i in range(3)]
    found = uc.inspect(paths)
    assert (found.rows, found.episodes) == (900, 3)
    assert run_next(found, tmp_path)[0] == 0


def test_a_parquet_file_of_lists_and_saved_demonstrations(tmp_path):
    t, phase = circles()
    state = pa.array(np.stack([np.cos(phase), np.sin(phase)], axis=1).tolist())
    path = tmp_path / "lists.parquet"
    pq.write_table(pa.table({"timestamp": t, "observation.state": state}), path)
    found = uc.inspect(path)
    assert "--state observation.state --time timestamp" in found.next
    assert kinds(found)[1:] == ["position", "position"]
    saved = tmp_path / "saved.npz"
    uc.load(path, state="observation.state", time="timestamp").save(saved)
    found = uc.inspect(saved)
    assert found.next == f"unconstrain fit {saved} --out saved.skops"
    assert run_next(found, tmp_path)[0] == 0


def test_mistakes_are_a_sentence_and_code_2(tmp_path, capsys):
    empty = tmp_path / "empty.csv"
    empty.touch()
    damaged = tmp_path / "damaged.parquet"
    damaged.write_bytes(b"PAR1" + bytes(100))
    for path in (tmp_path / "none.csv", empty, damaged):
        assert run(["inspect", str(path)]) == 2
        assert path.name in capsys.readouterr().err


def test_keys_lists_the_columns_alone(tmp_path):
    t, phase = circles(30)
    path = write(tmp_path / "a.csv", t=t, x=phase)
    assert say("inspect", path, "--keys") == (0, "t\nx\n")


def test_an_output_that_exists_is_not_named(tmp_path):
    t, phase = circles()
    write(tmp_path / "a.csv", t=t, x=np.cos(phase), y=np.sin(phase))
    (tmp_path / "a.skops").touch()
    with contextlib.chdir(tmp_path):
        assert uc.inspect("a.csv").next.endswith("--out a-2.skops")


class Topical(Text):
    """A file that holds several tables, as a bag does."""

    def topics(self):
        return [("/status", "std_msgs/msg/String", 3), ("/odom", "nav_msgs/msg/Odometry", 300)]

    def for_topics(self, names):
        if names == ("/status",):
            raise DataError("text only")
        return Text(self.file)


def test_the_tables_of_a_file_are_listed_and_looked_into(tmp_path, monkeypatch):
    t, phase = circles()
    path = write(tmp_path / "a.csv", t=t, x=np.cos(phase), y=np.sin(phase))
    monkeypatch.setattr("unconstrain.recordings.recognizing.recognize", Topical)
    found = uc.inspect(path)
    assert found.notes[0] == (
        "the topics that may hold a movement are /odom (nav_msgs/msg/Odometry, 300 messages), "
        "/status (std_msgs/msg/String, 3 messages); --topic chooses others"
    )
    assert kinds(found) == ["time", "position", "position"]
    assert say("inspect", path, "--keys")[1].splitlines()[0] == "/odom (nav_msgs/msg/Odometry, 300 messages)"


REAL = (
    []
    if not DATA.is_dir()
    else sorted(
        path
        for path in DATA.rglob("*")
        # The files of the data set are read as one below.
        if path.is_file() and path.suffix not in (".md", ".json", ".jsonl") and "lerobot" not in path.parts
    )
)


@pytest.mark.skipif(not REAL, reason="the recordings are not part of the project")
@pytest.mark.parametrize("path", [DATA / "lerobot", *REAL], ids=lambda path: path.name)
def test_real_recordings_that_can_be_read_can_be_learnt_from(path, tmp_path):
    try:
        found = uc.inspect(path)
    except DataError as error:
        pytest.skip(f"not read yet: {error}")
    if path.name == "vicon_markers.csv" and found.next is None:
        pytest.skip("its header block is not understood yet")
    assert found.next is not None, found.notes
    code, said = run_next(found, tmp_path, "--model", "linear", "--risk", "direct")
    assert code == 0, said
    assert json.loads(say("inspect", path, "--json")[1])["rows"] == found.rows


def test_the_demos_own_recordings(tmp_path):
    with contextlib.chdir(tmp_path):
        assert say("demo")[0] == 0
        for name in ("movements.csv", "others.csv"):
            found = uc.inspect(f"unconstrain-demo/{name}")
            assert "--state x1,x2 --action u1,u2" in found.next
            assert "--episode episode" in found.next
            assert run_next(found, tmp_path)[0] == 0


ODD = [0.0, -0.0, 1.0, 1e308, -1e308, 1e-320, np.nan, np.inf, 1.7e18, 360.0]


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.sampled_from(["t", "x", "y", "qx", "run", "frame", "u1", "vx", "", "a\x1b", "yaw"]),
        min_size=1,
        max_size=6,
    ),
    st.integers(1, 12),
    st.integers(0, 10**6),
)
def test_whatever_numbers_are_in_a_table_there_is_an_answer_or_a_sentence(tmp_path, names, n, seed):
    rng = np.random.default_rng(seed)
    rows = [",".join(str(v) for v in rng.choice(ODD, len(names))) for _ in range(n)]
    path = tmp_path / "odd.csv"
    path.write_text("\n".join([",".join(names), *rows]) + "\n")
    code, said = say("inspect", path, "--json")
    assert code in (0, 2)
    assert code == 2 or set(json.loads(said)) >= {"rows", "next"}


def test_stamps_that_are_too_coarse_are_counted(tmp_path):
    t, phase = circles()
    path = write(tmp_path / "a.csv", time=np.floor(t), x=np.cos(phase), y=np.sin(phase))
    found = uc.inspect(path)
    assert "--rate 50" in found.next
    assert "--time" not in found.next
    assert found.rate_hz == 50
    assert any("one stamp for many samples in a row" in note and "--rate" in note for note in found.notes)


def test_the_error_of_a_position_is_no_position_though_in_metres(tmp_path):
    t, phase = circles()
    path = tmp_path / "a.csv"
    rows = zip(t, np.cos(phase), np.abs(np.sin(phase)), strict=True)
    path.write_text("t,px,Mean Marker Error\ns,m,m\n" + "".join(f"{a},{b},{c}\n" for a, b, c in rows))
    found = uc.inspect(path)
    assert [(column.kind, column.unit) for column in found.columns[1:]] == [
        ("position", "m"),
        ("number", "m"),
    ]
    assert "--state px " in found.next
