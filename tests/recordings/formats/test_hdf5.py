"""HDF5: what robomimic, robosuite and ALOHA write, and any other groups that repeat."""

import json
import pickle
import sys

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.errors import DataError

h5py = pytest.importorskip("h5py")

LENGTHS = {"demo_0": 30, "demo_1": 25, "demo_2": 40, "demo_10": 35}


@pytest.fixture
def robomimic(tmp_path):
    """A file as robomimic writes it, and what is in it."""
    rng = np.random.default_rng(0)
    arrays = {
        name: (rng.normal(size=(n, 3)), rng.normal(size=(n, 7)), rng.normal(size=(n, 4)))
        for name, n in LENGTHS.items()
    }
    path = tmp_path / "low_dim.hdf5"
    with h5py.File(path, "w") as file:
        data = file.create_group("data")
        data.attrs["env_args"] = json.dumps({"env_name": "Lift", "env_kwargs": {"control_freq": 20}})
        for name, (position, actions, quaternion) in arrays.items():
            demo = data.create_group(name)
            demo.attrs["num_samples"] = len(actions)
            demo["actions"] = actions
            demo["rewards"] = np.zeros(len(actions))
            for group in ("obs", "next_obs"):
                demo[f"{group}/robot0_eef_pos"] = position
                demo[f"{group}/robot0_eef_quat"] = quaternion
            demo.create_dataset("obs/agentview_image", (len(actions), 24, 24, 3), "u1")
        file.create_group("mask")["train"] = np.array([b"demo_0", b"demo_1"])
    return path, arrays


def test_groups_are_episodes_in_natural_order(robomimic):
    path, arrays = robomimic
    demos = uc.load(path, state="obs/robot0_eef_pos", action="actions")
    assert demos.episode_labels == ("demo_0", "demo_1", "demo_2", "demo_10")
    assert np.bincount(demos.episodes).tolist() == list(LENGTHS.values())
    np.testing.assert_array_equal(demos.states, np.concatenate([arrays[name][0] for name in LENGTHS]))
    np.testing.assert_array_equal(demos.actions, np.concatenate([arrays[name][1] for name in LENGTHS]))
    notes = "\n".join(demos.notes)
    assert "4 demonstrations found in demo_*" in notes
    assert "time x dimensions (30 x 3)" in notes
    assert "mask/train" in notes


def test_the_control_frequency_gives_the_time(robomimic):
    demos = uc.load(robomimic[0], state="obs/robot0_eef_pos")
    np.testing.assert_allclose(np.diff(demos.episode(0).time), 0.05)
    assert any("steps of 0.05 s, as data/control_freq says" in note for note in demos.notes)


def test_images_are_refused_with_a_reason(robomimic):
    with pytest.raises(DataError, match="bytes along several axes, as images do"):
        uc.load(robomimic[0], state="obs/agentview_image", action="actions")


@pytest.mark.parametrize("columns", [{"action": "actions"}, {}])
def test_blocks_hold_what_load_returns(robomimic, columns):
    whole = uc.load(robomimic[0], state="obs/robot0_eef_pos", **columns)
    source = uc.open(robomimic[0], state="obs/robot0_eef_pos", **columns)
    blocks = list(source.blocks(batch_rows=20))
    assert len(blocks) > 1
    np.testing.assert_array_equal(np.concatenate([block.states for block in blocks]), whole.states)
    np.testing.assert_allclose(np.concatenate([block.actions for block in blocks]), whole.actions)
    assert tuple(map(str, source.notes)) == whole.notes


def test_streams_learn_the_same(robomimic):
    columns = {"state": "obs/robot0_eef_pos", "action": "obs/robot0_eef_quat"}
    source = pickle.loads(pickle.dumps(uc.open(robomimic[0], **columns)))
    demos = uc.load(robomimic[0], **columns)
    stream = uc.fit_stream(uc.ParametricPolicy(alpha=1.0, risk="direct"), source)
    direct = uc.ParametricPolicy(alpha=1.0, risk="direct").fit(demos)
    np.testing.assert_allclose(stream.predict(demos.states), direct.predict(demos.states), atol=1e-8)
    assert source.notes


def test_files_of_aloha_are_an_episode_each(tmp_path):
    rng = np.random.default_rng(1)
    for i in (0, 1, 10):
        with h5py.File(tmp_path / f"episode_{i}.hdf5", "w") as file:
            file.attrs["sim"] = True
            file["observations/qpos"] = rng.normal(size=(50 + i, 14))
            file["observations/qvel"] = rng.normal(size=(50 + i, 14))
            file["action"] = rng.normal(size=(50 + i, 14))
            file.create_dataset("observations/images/top", (50 + i, 48, 64, 3), "u1")
    demos = uc.load(str(tmp_path / "*.hdf5"), state="observations/qpos", action="action")
    assert (len(demos), demos.n_episodes, demos.states.shape[1]) == (161, 3, 14)
    assert demos.episode_labels == ("episode_0", "episode_1", "episode_10")
    with pytest.raises(DataError, match=r"give action=, or time="):
        uc.load(tmp_path / "episode_0.hdf5", state="observations/qpos")


def test_groups_within_groups_that_repeat_are_the_demonstrations(tmp_path):
    with h5py.File(tmp_path / "sessions.h5", "w") as file:
        for session in (1, 2):
            for demo in range(3):
                file[f"session_{session}/demo_{demo}/x"] = np.random.default_rng(demo).normal(size=(20, 2))
    demos = uc.load(tmp_path / "sessions.h5", state="x[0]", action="x[1]")
    assert demos.n_episodes == 6
    assert demos.episode_labels[-1] == "session_2/demo_2"


def test_batches_of_episodes_are_taken_apart(tmp_path):
    rng = np.random.default_rng(2)
    states, actions = rng.normal(size=(5, 40, 3)), rng.normal(size=(5, 40, 2))
    with h5py.File(tmp_path / "batch.h5", "w") as file:
        file["states"], file["actions"], file["dt"] = states, actions, 0.1
    demos = uc.load(tmp_path / "batch.h5", state="states", action="actions")
    assert demos.n_episodes == 5
    np.testing.assert_array_equal(demos.states, states.reshape(-1, 3))
    assert demos.time[39] == pytest.approx(3.9)


def test_matrices_of_one_recording_are_not_episodes(tmp_path):
    with h5py.File(tmp_path / "poses.h5", "w") as file:
        file["pose"] = np.random.default_rng(3).normal(size=(200, 4, 4))
        file["velocity"] = np.random.default_rng(3).normal(size=(200, 3))
    demos = uc.load(tmp_path / "poses.h5", state=["pose[3]", "pose[7]", "pose[11]"], action="velocity")
    assert (len(demos), demos.n_episodes) == (200, 1)


def test_records_are_columns_by_name(tmp_path):
    table = np.zeros(30, [("time", "f8"), ("x", "f4", 3), ("n", "i4")])
    table["time"], table["x"] = np.arange(30) / 10, np.random.default_rng(0).normal(size=(30, 3))
    with h5py.File(tmp_path / "r.h5", "w") as file:
        file["log/table"] = table
    demos = uc.load(tmp_path / "r.h5", state="log/table/x")
    np.testing.assert_allclose(demos.states, table["x"])
    assert any("time is log/table/time" in note for note in demos.notes)


def test_projections_are_lists_row_by_row(tmp_path):
    P = np.tile(np.diag([1.0, 0.0]), (30, 1, 1))
    with h5py.File(tmp_path / "p.h5", "w") as file:
        file["x"], file["u"] = np.random.default_rng(0).normal(size=(2, 30, 2))
        file["P"] = P
    demos = uc.load(tmp_path / "p.h5", state="x", action="u", projections="P")
    np.testing.assert_array_equal(demos.projections, P)


def test_what_differs_between_demonstrations_is_named(tmp_path):
    with h5py.File(tmp_path / "odd.h5", "w") as file:
        for i, width in enumerate((2, 2, 3)):
            file[f"demo_{i}/x"] = np.random.default_rng(i).normal(size=(20, 2))
            file[f"demo_{i}/u"] = np.random.default_rng(i).normal(size=(20, width))
        file["demo_1/late"] = np.arange(20.0)
    with pytest.raises(
        DataError, match=r"'u' has 2 numbers a sample in demonstration demo_0 but 3 in demo_2"
    ):
        uc.load(tmp_path / "odd.h5", state="x", action="u")
    with pytest.raises(DataError, match=r"'late' is missing in demonstration demo_0"):
        uc.load(tmp_path / "odd.h5", state="x", action="late")


def test_a_bad_number_is_named_with_its_demonstration(robomimic):
    with h5py.File(robomimic[0], "a") as file:
        file["data/demo_2/obs/robot0_eef_pos"][7, 1] = np.nan
    with pytest.raises(DataError, match=r"robot0_eef_pos\[?1?.*nan at row 7 .*of demonstration demo_2"):
        uc.load(robomimic[0], state="obs/robot0_eef_pos", action="actions")


def test_links_lead_nowhere_else(tmp_path, robomimic):
    path = tmp_path / "links.h5"
    with h5py.File(path, "w") as file:
        file["x"], file["u"] = np.random.default_rng(0).normal(size=(2, 30))
        file["elsewhere"] = h5py.ExternalLink(str(robomimic[0]), "/data/demo_0/actions")
        file["nothing"] = h5py.SoftLink("/missing")
        file["loop"] = h5py.SoftLink("/")
    assert len(uc.load(path, state="x", action="u")) == 30
    with pytest.raises(DataError, match="'elsewhere' lies in another file"):
        uc.load(path, state="x", action="elsewhere")


def test_arrays_larger_than_memory_are_refused_before_they_are_read(tmp_path):
    with h5py.File(tmp_path / "huge.h5", "w") as file:
        file.create_dataset("x", (10**13, 3), "f8", chunks=(1000, 3))
        file.create_dataset("u", (10**13, 3), "f8", chunks=(1000, 3))
    with pytest.raises(DataError, match="of memory"):
        uc.load(tmp_path / "huge.h5", state="x", action="u")


def test_a_damaged_file_is_one_sentence(robomimic):
    content = robomimic[0].read_bytes()
    for cut in (20, 600, len(content) // 2):
        robomimic[0].write_bytes(content[:cut])
        with pytest.raises(DataError, match="damaged or not an HDF5 file"):
            uc.load(robomimic[0], state="obs/robot0_eef_pos", action="actions")


def test_the_missing_extra_is_named(robomimic, monkeypatch):
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(DataError, match=r"pip install 'unconstrain\[hdf5\]'"):
        uc.load(robomimic[0], state="obs/robot0_eef_pos", action="actions")


def write_groups(path, **groups):
    with h5py.File(path, "w") as file:
        for name, values in groups.items():
            file[name.replace("__", "/")] = values
    return path


def test_one_of_several_sets_is_chosen_by_part(tmp_path):
    rng = np.random.default_rng(0)
    sets = {"train": 3, "test": 2}
    arrays = {
        f"{name}__demo_{i}__{what}": rng.normal(size=(50 + i, 2))
        for name, number in sets.items()
        for i in range(number)
        for what in ("x", "u")
    }
    path = write_groups(tmp_path / "a.h5", **arrays, fps=20.0)
    largest = uc.load(path, state="x", action="u")
    assert largest.n_episodes == 3
    assert any("part= reads another set: test" in note for note in largest.notes)
    chosen = uc.load(path, state="x", action="u", part="test")
    np.testing.assert_array_equal(chosen.states[:50], arrays["test__demo_0__x"])
    assert chosen.n_episodes == 2
    np.testing.assert_allclose(np.diff(chosen.episode(0).time), 0.05)
    with pytest.raises(DataError, match=r"no part that 'valid' alone stands for; there are test, .*train"):
        uc.load(path, state="x", action="u", part="valid")
    with pytest.raises(
        DataError, match="no part that 'demo_0' alone stands for; there are test/demo_0, train/demo_0"
    ):
        uc.load(path, state="x", action="u", part="demo_0")
    (tmp_path / "a.csv").write_text("x,u\n1,2\n3,4\n")
    with pytest.raises(DataError, match="part="):
        uc.load(tmp_path / "a.csv", state="x", action="u", part="test")


def test_a_mask_of_robomimic_is_a_part(robomimic):
    demos = uc.load(robomimic[0], state="obs/robot0_eef_pos", action="actions", part="train")
    assert demos.episode_labels == ("demo_0", "demo_1")


def test_a_network_beside_observations_is_no_demonstration(tmp_path):
    x = np.random.default_rng(0).normal(size=(600, 4))
    path = write_groups(
        tmp_path / "a.h5",
        observations=x,
        timeouts=np.arange(600) % 200 == 199,
        metadata__policy__fc0__weight=np.zeros((64, 4)),
        metadata__policy__fc0__bias=np.zeros(64),
    )
    demos = uc.load(path, state="observations", rate=20)
    assert demos.n_episodes == 3


def test_streams_at_another_rate_are_brought_to_the_stamps(tmp_path):
    t, slow = np.arange(0, 4, 0.01), np.arange(0.02, 4, 0.1)
    path = write_groups(
        tmp_path / "a.h5",
        joints__q=np.stack([np.sin(t), np.cos(t)], 1),
        joints__time=t,
        camera__position=np.stack([2 * slow, -slow], 1),
        camera__grip=(slow > 2).astype(int),
        camera__time=slow,
    )
    demos = uc.load(
        path, state=["joints/q", "camera/position", "camera/grip"], drop="missing", action="differentiate"
    )
    inside = (t >= slow[0]) & (t <= slow[-1])
    assert len(demos) == inside.sum()
    np.testing.assert_allclose(demos.states[:, 2:4], np.stack([2 * t, -t], 1)[inside], atol=1e-12)
    assert set(demos.states[:, 4]) == {0.0, 1.0}
    assert any("camera/position, camera/grip: brought from stamps of its own" in note for note in demos.notes)
    alone = uc.load(path, state="position", part="camera")
    np.testing.assert_array_equal(alone.states[:, 0], 2 * slow)


def test_robosuite_says_the_rate_in_another_attribute(tmp_path):
    path = tmp_path / "demo.hdf5"
    rng = np.random.default_rng(0)
    with h5py.File(path, "w") as file:
        data = file.create_group("data")
        data.attrs["env_info"] = json.dumps({"control_freq": 20})
        for i in (1, 2):
            clock = np.arange(50 + i) * 0.05
            data[f"demo_{i}/states"] = np.column_stack([clock, np.cumsum(rng.normal(size=(50 + i, 3)), 0)])
            data[f"demo_{i}/actions"] = rng.uniform(-1, 1, size=(50 + i, 4))
    found = uc.inspect(path)
    assert found.rate_hz == 20
    assert "--state 'states[1],states[2],states[3]'" in found.next
    assert any("states[0]: rises evenly, as a clock does" in note for note in found.notes)


def test_scaled_commands_are_said_to_be_no_velocities(tmp_path):
    rng = np.random.default_rng(0)
    arrays = {}
    for i in range(3):
        arrays[f"demo_{i}__pos"] = np.cumsum(rng.normal(size=(80, 3)), 0) * 0.01
        arrays[f"demo_{i}__actions"] = rng.uniform(-1, 1, size=(80, 3))
    path = write_groups(tmp_path / "a.h5", **arrays, fps=20.0)
    demos = uc.load(path, state="pos", action="actions")
    assert any("within -1 and 1 and are no derivative of the states" in note for note in demos.notes)
    assert not any("within -1 and 1" in note for note in uc.load(path, state="pos").notes)
    found = uc.inspect(path)
    assert "--action" not in found.next
    assert any("commands within -1 and 1 that a controller scales" in note for note in found.notes)


def test_observations_that_come_next_are_no_states(robomimic):
    names = [column.name for column in uc.inspect(robomimic[0]).columns]
    assert any(name.startswith("next_obs") for name in names)
    assert "next_obs" not in (uc.inspect(robomimic[0]).next or "")


def test_a_data_frame_of_pandas_has_its_names(tmp_path):
    x = np.random.default_rng(0).normal(size=(60, 2))
    with h5py.File(tmp_path / "a.h5", "w") as file:
        group = file.create_group("run")
        group.attrs["pandas_type"] = b"frame"
        group["axis1"] = np.arange(60)
        group["block0_items"] = np.array([b"px", b"py"])
        group["block0_values"] = x
        group["block1_items"] = np.array([b"t"])
        group["block1_values"] = np.arange(60, dtype="f4")[:, None] / 10
    demos = uc.load(tmp_path / "a.h5", state=["run/px", "run/py"])
    np.testing.assert_array_equal(demos.states, x)
    np.testing.assert_allclose(demos.time, np.arange(60) / 10, atol=1e-5)
