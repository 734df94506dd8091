"""Folders read at once: what streams read in one pass, as demonstrations in memory."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import unconstrain as uc
from tests import written
from unconstrain.errors import DataError

X, U, EPISODES, TIME = written.movements()
COLUMNS = {"state": ["x0", "x1", "x2"], "action": ["u0", "u1", "u2"], "episode": "episode_index"}
CUTS = (55, 56, 301)


@pytest.mark.parametrize("version", ["v3.0", "v2.1"])
def test_a_lerobot_dataset_needs_no_columns(tmp_path, version):
    names = ["a", "b", "c"]
    written.lerobot(tmp_path / "robot", X, U, EPISODES, TIME, version, names)
    demos = uc.load(tmp_path / "robot")
    np.testing.assert_allclose(demos.states, X, rtol=1e-6)
    np.testing.assert_allclose(demos.actions, U, rtol=1e-6)
    assert demos.state_names == tuple(names)
    assert demos.n_episodes == len(np.unique(EPISODES))
    chosen = uc.load(tmp_path / "robot", state=["c", "observation.state[0]"])
    np.testing.assert_array_equal(chosen.states, demos.states[:, [2, 0]])


def test_the_derivative_of_a_dataset_that_has_actions_too(tmp_path):
    folder = written.lerobot(tmp_path / "robot", X, U, EPISODES, TIME)
    demos = uc.load(folder, action="differentiate")
    assert demos.action_names == tuple(f"{name}_dot" for name in demos.state_names)
    states, stamps = (a.astype(np.float32).astype(float) for a in (X, TIME))  # as the dataset holds them
    np.savez(tmp_path / "one.npz", x=states, t=stamps, e=EPISODES)
    alone = uc.load(tmp_path / "one.npz", state="x", time="t", episode="e")
    np.testing.assert_allclose(demos.actions, alone.actions, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("lists", [False, True])
def test_files_of_a_folder_are_parts_of_one_recording(tmp_path, lists):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, CUTS, lists=lists)
    roles = (
        {"state": "observation.state", "action": "action", "episode": "episode_index"} if lists else COLUMNS
    )
    demos = uc.load(folder, **roles, time="timestamp")
    np.testing.assert_array_equal(demos.states, X)
    assert demos.episode_labels == tuple(str(label) for label in np.unique(EPISODES))
    policy = uc.ParametricPolicy(alpha="cv").fit(demos.states, demos.actions, groups=demos.episodes)
    streamed = uc.fit_stream(uc.ParametricPolicy(alpha="cv"), uc.open(folder, **roles))
    np.testing.assert_allclose(policy.weights_, streamed.weights_, rtol=1e-6)


def test_without_an_episode_column_files_are_episodes(tmp_path):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, CUTS)
    demos = uc.load(folder, state=COLUMNS["state"], action=COLUMNS["action"])
    assert demos.episode_labels == ("part-0", "part-1", "part-2", "part-3")
    np.testing.assert_array_equal(np.bincount(demos.episodes), np.diff([0, *CUTS, len(X)]))


def test_files_of_different_precision_are_read_together(tmp_path):
    folder = tmp_path / "parts"
    folder.mkdir()
    for i, kind in enumerate((np.float32, np.float64, np.int32)):
        columns = {name: pa.array((10 * X[:5, j]).astype(kind)) for j, name in enumerate(("x0", "x1", "x2"))}
        pq.write_table(
            pa.table(columns | {f"u{j}": pa.array(U[:5, j]) for j in range(3)}), folder / f"{i}.parquet"
        )
    demos = uc.load(folder, state=COLUMNS["state"], action=COLUMNS["action"])
    np.testing.assert_array_equal(demos.states[10:], np.trunc(10 * X[:5]))


def test_folders_of_saved_demonstrations_are_read_file_by_file(tmp_path):
    demos = uc.Demonstrations(X, U, EPISODES)
    half = np.median(EPISODES) > EPISODES
    demos.select(half).save(tmp_path / "a.parquet")
    demos.select(~half).save(tmp_path / "b.parquet")
    both = uc.load(tmp_path)
    np.testing.assert_array_equal(both.states, np.concatenate([X[half], X[~half]]))
    assert both.n_episodes == demos.n_episodes


def test_mistakes_are_told_in_one_sentence(tmp_path):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, CUTS)
    with pytest.raises(DataError, match="parts: give state="):
        uc.load(folder)
    with pytest.raises(DataError, match="no column 'y' for state"):
        uc.load(folder, state="y", action="u0")
    bad = X.copy()
    bad[60, 1] = np.nan
    written.write(tmp_path / "parts", bad, U, EPISODES, TIME, CUTS)
    with pytest.raises(DataError, match=r"part-2.parquet: column 'x1' holds nan at row 4 \(counted from 0\)"):
        uc.load(folder, **COLUMNS)
    lists = written.write(tmp_path / "lists", X, U, EPISODES, TIME, CUTS, lists=True)
    pq.write_table(
        pa.table(
            {
                "observation.state": [[1.0, 2.0, 3.0], [1.0]],
                "action": [[1.0, 2.0, 3.0]] * 2,
                "episode_index": [1, 1],
            }
        ),
        lists / "part-9.parquet",
    )
    roles = {"state": "observation.state", "action": "action", "episode": "episode_index"}
    with pytest.raises(
        DataError, match=r"part-9.parquet: 'observation.state' holds lists that .* differ in length"
    ):
        uc.load(lists, **roles)
    (tmp_path / "empty").mkdir()
    with pytest.raises(DataError, match="is a folder without Parquet files"):
        uc.load(tmp_path / "empty", state="x0")


def test_a_zarr_store_is_named(tmp_path):
    (tmp_path / "replay.zarr" / "data").mkdir(parents=True)
    (tmp_path / "replay.zarr" / ".zgroup").write_text("{}")
    with pytest.raises(DataError, match="is a Zarr store"):
        uc.load(tmp_path / "replay.zarr", state="data/state")
