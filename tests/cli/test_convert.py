"""What is converted is read again as it was."""

import json

import numpy as np
import pyarrow.parquet as pq
import pytest

import unconstrain as uc
from tests.cli.commands import COLUMNS
from unconstrain import limit_cycle as toy
from unconstrain.cli.app import run
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.recordings.lerobot_dataset import write_lerobot


@pytest.mark.parametrize("suffix", [".parquet", ".npz"])
def test_a_file_needs_no_options_any_more(movements, tmp_path, suffix):
    out = tmp_path / f"out{suffix}"
    assert run(["convert", str(movements), *COLUMNS, "--time", "t", "--out", str(out)]) == 0
    demos, again = (
        uc.load(movements, state=["x1", "x2"], action=["u1", "u2"], time="t", episode="episode"),
        uc.load(out),
    )
    np.testing.assert_array_equal(again.states, demos.states)
    np.testing.assert_array_equal(again.actions, demos.actions)
    np.testing.assert_array_equal(again.episodes, demos.episodes)


def test_a_lerobot_dataset_is_read_by_our_reader(movements, tmp_path):
    out = tmp_path / "dataset"
    assert run(["convert", str(movements), *COLUMNS, "--time", "t", "--out", str(out)]) == 0
    demos, again = (
        uc.load(movements, state=["x1", "x2"], action=["u1", "u2"], time="t", episode="episode"),
        uc.load(out),
    )
    np.testing.assert_allclose(again.states, demos.states, rtol=1e-6)
    np.testing.assert_allclose(again.actions, demos.actions, rtol=1e-6)
    np.testing.assert_array_equal(again.episodes, demos.episodes)
    assert again.state_names == ("x1", "x2")
    info = json.loads((out / "meta" / "info.json").read_text())
    assert (info["fps"], info["total_frames"], info["total_episodes"]) == (50, 1600, 40)
    assert info["features"]["action"] == {"dtype": "float32", "shape": [2], "names": ["u1", "u2"]}
    table = pq.read_table(out / info["data_path"].format(chunk_index=0, file_index=0))
    assert set(table.column_names) == set(info["features"])
    assert "--action" not in uc.inspect(out).next


def test_what_lerobot_reads_of_a_dataset_is_there(tmp_path):
    import pandas as pd

    write_lerobot(toy.demonstrate(3, random_state=0), tmp_path / "d")
    tasks = pd.read_parquet(tmp_path / "d" / "meta" / "tasks.parquet")
    assert tasks.iloc[0].name == "recorded movement"
    assert tasks.loc["recorded movement", "task_index"] == 0
    episodes = pd.read_parquet(tmp_path / "d" / "meta" / "episodes" / "chunk-000" / "file-000.parquet")
    assert episodes["length"].sum() == episodes["dataset_to_index"].iloc[-1] == 120
    stats = json.loads((tmp_path / "d" / "meta" / "stats.json").read_text())
    assert len(stats["action"]["mean"]) == 2
    data = pd.read_parquet(tmp_path / "d" / "data" / "chunk-000" / "file-000.parquet")
    np.testing.assert_allclose(data["timestamp"], data["frame_index"] / 50, atol=1e-4)


def test_an_uneven_rate_has_to_be_named(tmp_path):
    t = np.cumsum(np.random.default_rng(0).uniform(0.005, 0.02, 400))
    demos = Demonstrations(
        np.stack([np.sin(t), np.cos(t)], axis=1), np.stack([np.cos(t), -np.sin(t)], axis=1), time=t
    )
    with pytest.raises(DataError, match="give fps="):
        write_lerobot(demos, tmp_path / "d")
    assert not (tmp_path / "d").exists()
    write_lerobot(demos, tmp_path / "d", fps=20)
    again = uc.load(tmp_path / "d")
    np.testing.assert_allclose(again.states[:, 0], np.sin(t[0] + np.arange(len(again)) / 20), atol=1e-3)


def test_nothing_is_overwritten_unasked(movements, tmp_path, capsys):
    for name in ("out.parquet", "folder"):
        out = tmp_path / name
        arguments = ["convert", str(movements), *COLUMNS, "--time", "t", "--out", str(out)]
        assert run(arguments) == 0
        assert run(arguments) == 2
        assert "--overwrite" in capsys.readouterr().err
        assert run([*arguments, "--overwrite"]) == 0
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_a_folder_of_other_things_is_never_replaced(movements, tmp_path, capsys):
    out = tmp_path / "mine"
    out.mkdir()
    (out / "thesis.tex").touch()
    arguments = ["convert", str(movements), *COLUMNS, "--time", "t", "--out", str(out), "--overwrite"]
    assert run(arguments) == 2
    assert "not a LeRobot dataset" in capsys.readouterr().err
    assert run([*arguments[:-2], str(tmp_path), "--overwrite"]) == 2
    assert (out / "thesis.tex").exists()


@pytest.mark.parametrize(
    ("out", "more", "said"),
    [("a.txt", [], "ends in .parquet"), ("a.parquet", ["--fps", "30"], "--fps"), ("none/a", [], "no folder")],
)
def test_mistakes_are_a_sentence(movements, tmp_path, capsys, out, more, said):
    assert run(["convert", str(movements), *COLUMNS, "--out", str(tmp_path / out), *more]) == 2
    assert said in capsys.readouterr().err
