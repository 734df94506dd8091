"""Single NumPy arrays: either order of axes, batches of episodes, records."""

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.errors import DataError


def test_rows_are_samples_and_columns_are_chosen_by_position(tmp_path):
    table = np.random.default_rng(0).normal(size=(60, 4))
    np.save(tmp_path / "a.npy", table)
    demos = uc.load(tmp_path / "a.npy", state=[0, 1], action=["array[2]", "array[3]"])
    np.testing.assert_array_equal(np.hstack([demos.states, demos.actions]), table)
    assert any("array is read as time x dimensions (60 x 4)" in note for note in demos.notes)


def test_samples_in_columns_are_turned_and_said(tmp_path):
    table = np.random.default_rng(0).normal(size=(4, 60))
    np.save(tmp_path / "a.npy", np.asfortranarray(table, dtype=">f4"))
    demos = uc.load(tmp_path / "a.npy", state=[0, 1], action=[2, 3])
    np.testing.assert_allclose(demos.actions, table[2:].T, rtol=1e-6)
    assert any("dimensions x time (4 x 60)" in note for note in demos.notes)


def test_the_axis_of_time_can_be_given(tmp_path):
    table = np.random.default_rng(0).normal(size=(5, 60))
    np.save(tmp_path / "a.npy", table)
    demos = uc.load(tmp_path / "a.npy", state=range(30), action=range(30, 60), time_axis="first")
    np.testing.assert_array_equal(np.hstack([demos.states, demos.actions]), table)
    assert not any("axis" in note for note in demos.notes)
    (tmp_path / "a.csv").write_text("x,u\n1,2\n3,4\n")
    with pytest.raises(DataError, match="time_axis= is for arrays"):
        uc.load(tmp_path / "a.csv", state=0, action=1, time_axis="first")
    with pytest.raises(DataError, match="time_axis must be one of first, last"):
        uc.load(tmp_path / "a.npy", state=0, action=1, time_axis="second")


@pytest.mark.parametrize("axes", [(0, 1, 2), (0, 2, 1)])
def test_batches_are_episodes(tmp_path, axes):
    table = np.random.default_rng(0).normal(size=(5, 60, 4))
    np.save(tmp_path / "a.npy", table.transpose(axes))
    demos = uc.load(tmp_path / "a.npy", state=[0, 1], action=[2, 3])
    assert demos.n_episodes == 5
    np.testing.assert_array_equal(demos.states, table[..., :2].reshape(-1, 2))
    assert any("5 demonstrations found in the first axis of array" in note for note in demos.notes)


def test_files_of_a_folder_are_episodes(tmp_path):
    for i in (1, 2, 10):
        np.save(tmp_path / f"run{i}.npy", np.random.default_rng(i).normal(size=(20 + i, 4)))
    for given in (str(tmp_path / "*.npy"), tmp_path):
        demos = uc.load(given, state=[0, 1], action=[2, 3])
        assert demos.episode_labels == ("run1", "run2", "run10")
        assert len(demos) == 73


@pytest.mark.parametrize("folders", [(".",), ("demo_1", "demo_2", "demo_10")])
def test_arrays_of_a_folder_are_columns_by_name(tmp_path, folders):
    states, actions = np.random.default_rng(0).normal(size=(2, len(folders), 30, 3))
    for i, folder in enumerate(folders):
        (tmp_path / folder).mkdir(exist_ok=True)
        np.save(tmp_path / folder / "states.npy", states[i])
        np.save(tmp_path / folder / "actions.npy", actions[i].T)
        np.save(tmp_path / folder / "time.npy", np.arange(30) / 10)
    demos = uc.load(tmp_path, state="states", action="actions")
    np.testing.assert_array_equal(demos.states, states.reshape(-1, 3))
    np.testing.assert_array_equal(demos.actions, actions.reshape(-1, 3))
    assert demos.n_episodes == len(folders)
    assert demos.time[29] == pytest.approx(2.9)


def test_records_have_names(tmp_path):
    table = np.zeros(30, [("t", "f8"), ("x", "f4", 3), ("label", "U4")])
    table["t"], table["x"] = np.arange(30) / 10, np.random.default_rng(0).normal(size=(30, 3))
    np.save(tmp_path / "r.npy", table)
    demos = uc.load(tmp_path / "r.npy", state="x", time="t")
    np.testing.assert_allclose(demos.states, table["x"])


def test_pickles_and_damage_are_refused(tmp_path):
    np.save(tmp_path / "p.npy", np.array([{}, 1], object), allow_pickle=True)
    with pytest.raises(DataError, match="pickled"):
        uc.load(tmp_path / "p.npy", state=0, action=1)
    np.save(tmp_path / "d.npy", np.zeros((30, 4)))
    content = (tmp_path / "d.npy").read_bytes()
    for cut in (8, 60, 500):
        (tmp_path / "d.npy").write_bytes(content[:cut])
        with pytest.raises(DataError, match="damaged or not a NumPy array"):
            uc.load(tmp_path / "d.npy", state=0, action=1)
