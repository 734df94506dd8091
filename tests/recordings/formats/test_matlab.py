"""MATLAB files: cells and arrays of structs, either order of axes, version 5 and 7.3."""

from pathlib import Path

import numpy as np
import pytest
import scipy.io
from hypothesis import given, settings
from hypothesis import strategies as st

import unconstrain as uc
from unconstrain.errors import DataError
from unconstrain.recordings.files import locate
from unconstrain.recordings.formats import recognize
from unconstrain.recordings.formats.stacking import find_lengths
from unconstrain.recordings.formats.trees import Leaf

DATA = Path(__file__).parents[4] / "shared" / "data"

real = pytest.mark.skipif(not DATA.is_dir(), reason="the recordings are not part of the project")


def cells(parts):
    """A MATLAB cell array (1, n)."""
    made = np.empty((1, len(parts)), object)
    for i, part in enumerate(parts):
        made[0, i] = part
    return made


def structs(parts):
    """A MATLAB array of structs (1, n)."""
    made = np.empty((1, len(parts)), [(name, object) for name in parts[0]])
    for i, part in enumerate(parts):
        for name, value in part.items():
            made[name][0, i] = value
    return made


def movements(lengths, dimensions=3):
    rng = np.random.default_rng(0)
    return [(rng.normal(size=(n, dimensions)), rng.normal(size=(n, dimensions))) for n in lengths]


def columns_of(path):
    return [column.name for column in recognize(locate(path)[0]).columns().columns]


@pytest.mark.parametrize("of", [cells, structs])
@pytest.mark.parametrize("transposed", [False, True])
def test_demonstrations_are_read_in_either_order_of_axes(tmp_path, of, transposed):
    parts = movements((40, 50, 60))
    turn = np.transpose if transposed else np.asarray
    demos = [
        {"pos": turn(x), "vel": turn(u), "t": np.arange(len(x))[None] * 0.1, "dt": 0.1, "name": f"run{i}"}
        for i, (x, u) in enumerate(parts)
    ]
    scipy.io.savemat(tmp_path / "demos.mat", {"demos": of(demos), "dt": 0.1})
    read = uc.load(tmp_path / "demos.mat", state="pos", action="vel")
    np.testing.assert_array_equal(read.states, np.concatenate([x for x, _ in parts]))
    np.testing.assert_array_equal(read.actions, np.concatenate([u for _, u in parts]))
    assert np.bincount(read.episodes).tolist() == [40, 50, 60]
    assert read.episode_labels == ("1", "2", "3")
    np.testing.assert_allclose(read.episode(2).time, np.arange(60) * 0.1)
    order = "dimensions x time (3 x 40)" if transposed else "time x dimensions (40 x 3)"
    assert any(f"pos, vel are read as {order}" in note for note in read.notes)
    assert any("time is t; time= names another column" in note for note in read.notes)
    assert columns_of(tmp_path / "demos.mat")[-3:] == ["dt", "name", "episode"]
    named = uc.load(tmp_path / "demos.mat", state="pos", action="vel", time="t", episode="name")
    assert named.episode_labels == ("run0", "run1", "run2")


def test_the_order_may_differ_between_demonstrations(tmp_path):
    (x, u), (y, v) = movements((30, 40))
    scipy.io.savemat(tmp_path / "m.mat", {"d": cells([{"x": x, "u": u}, {"x": y.T, "u": v.T}])})
    read = uc.load(tmp_path / "m.mat", state="x", action="u")
    np.testing.assert_array_equal(read.states, np.concatenate([x, y]))
    text = "time x dimensions (30 x 3) in 1 demonstrations and dimensions x time (3 x 40) in 1 demonstrations"
    assert any(text in note for note in read.notes)


def test_cells_of_matrices_beside_each_other_are_demonstrations(tmp_path):
    parts = movements((7, 90))  # the first is as long as it is wide, but for what differs
    scipy.io.savemat(
        tmp_path / "m.mat", {"X": cells([x.T for x, _ in parts]), "U": cells([u.T for _, u in parts])}
    )
    read = uc.load(tmp_path / "m.mat", state="X", action="U")
    np.testing.assert_array_equal(read.states, np.concatenate([x for x, _ in parts]))


def test_empty_cells_are_left_out_and_said(tmp_path):
    demos = [{"x": x, "u": u} for x, u in movements((30, 40))]
    scipy.io.savemat(tmp_path / "m.mat", {"demos": cells([demos[0], np.zeros((0, 0)), demos[1]])})
    read = uc.load(tmp_path / "m.mat", state="x", action="u")
    assert read.episode_labels == ("1", "3")
    assert any("2 demonstrations found in demos (1 of 3 without numbers left out)" in n for n in read.notes)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.integers(8, 40), min_size=2, max_size=4),
    st.integers(1, 12),
    st.booleans(),
)
def test_the_axis_that_differs_is_time(lengths, dimensions, transposed):
    if len(set(lengths)) == 1:
        lengths[0] += 1
    shapes = [(dimensions, n) if transposed else (n, dimensions) for n in lengths]
    demos = [{"x": Leaf(shape, np.dtype(float), None)} for shape in shapes]
    if max(dimensions, 0) < min(lengths):
        assert find_lengths(demos) == lengths


def test_structs_nested_deeper_have_dotted_paths_and_dt_gives_the_time(tmp_path):
    x, u = movements((50,))[0]
    log = {"arm": {"state": {"q": x.T}, "command": u.T}, "dt": 0.02}
    scipy.io.savemat(tmp_path / "log.mat", {"log": log})
    assert columns_of(tmp_path / "log.mat")[:4] == [
        "log.arm.state.q[0]",
        "log.arm.state.q[1]",
        "log.arm.state.q[2]",
        "log.arm.command[0]",
    ]
    read = uc.load(tmp_path / "log.mat", state="log.arm.state.q")
    assert read.n_episodes == 1
    np.testing.assert_allclose(np.diff(read.time), 0.02)
    assert any("steps of 0.02 s, as log.dt says" in note for note in read.notes)


@pytest.mark.parametrize("version", ["4", "5"])
def test_plain_matrices_are_one_recording(tmp_path, version):
    x, u = movements((50,))[0]
    variables = {"x": x, "u": u, "t": np.arange(50.0)[:, None], "gains": np.eye(4)}
    scipy.io.savemat(tmp_path / "p.mat", variables, format=version)
    read = uc.load(tmp_path / "p.mat", state="x", action="u")
    assert (len(read), read.n_episodes) == (50, 1)
    with pytest.raises(DataError, match=r"'gains' has shape \(4, 4\).*no axis has the 50 samples"):
        uc.load(tmp_path / "p.mat", state="gains", action="u")


def test_a_sensor_that_stopped_is_noted(tmp_path):
    parts = movements((50, 50, 50))
    parts[1][0][5:, 2] = 1.5
    demos = cells([{"x": x, "u": u} for x, u in parts])
    scipy.io.savemat(tmp_path / "m.mat", {"demos": demos})
    notes = uc.load(tmp_path / "m.mat", state="x", action="u").notes
    assert sum("x[2] does not change in most steps of episode 2" in note for note in notes) == 1
    assert sum("does not change" in note for note in notes) == 1


def test_what_matlab_alone_can_read_is_refused_with_a_reason(tmp_path):
    x, u = movements((50,))[0]
    sparse = scipy.sparse.csc_matrix(np.eye(50))
    scipy.io.savemat(tmp_path / "m.mat", {"x": x, "u": u, "s": sparse, "c": x + 1j})
    with pytest.raises(DataError, match="'s' is a sparse matrix"):
        uc.load(tmp_path / "m.mat", state="s", action="u")
    with pytest.raises(DataError, match="'c' holds values of type complex128"):
        uc.load(tmp_path / "m.mat", state="c", action="u")


@pytest.mark.parametrize("compressed", [False, True])
def test_a_damaged_file_is_one_sentence(tmp_path, compressed):
    parts = movements((40, 50))
    path = tmp_path / "m.mat"
    scipy.io.savemat(path, {"demos": cells([{"x": x, "u": u} for x, u in parts])}, do_compression=compressed)
    content = path.read_bytes()
    rng = np.random.default_rng(0)
    for cut in (100, 130, 300, len(content) // 2, len(content) - 9):
        path.write_bytes(content[:cut])
        with pytest.raises(DataError, match=r"m\.mat"):
            uc.load(path, state="x", action="u")
    for _ in range(60):
        broken = bytearray(content)
        for at in rng.integers(128, min(len(content), 900), 3):
            broken[at] = rng.integers(256)
        path.write_bytes(bytes(broken))
        try:
            uc.load(path, state="x", action="u")
        except DataError:
            continue


def test_a_bomb_is_refused_before_it_goes_off(tmp_path, monkeypatch):
    scipy.io.savemat(tmp_path / "m.mat", {"x": np.zeros((3_000_000, 2))}, do_compression=True)
    assert (tmp_path / "m.mat").stat().st_size < 100_000
    monkeypatch.setattr("unconstrain.memory.available_memory", lambda: 1e8)
    with pytest.raises(DataError, match="of memory"):
        uc.load(tmp_path / "m.mat", state="x[0]", action="x[1]")


def write_73(path, variables):
    """Write a file as MATLAB does with -v7.3: HDF5 with axes in reverse, cells as references."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        refs = file.create_group("#refs#")

        def write(group, name, value):
            if isinstance(value, dict):
                inner = group.create_group(name)
                inner.attrs["MATLAB_class"] = np.bytes_("struct")
                for key, each in value.items():
                    write(inner, key, each)
            elif isinstance(value, list):
                stored = group.create_dataset(name, (len(value), 1), h5py.ref_dtype)
                stored.attrs["MATLAB_class"] = np.bytes_("cell")
                for i, each in enumerate(value):
                    write(refs, key := f"r{len(refs)}", each)
                    stored[i, 0] = refs[key].ref
            elif isinstance(value, str):
                stored = group.create_dataset(name, data=np.array([[ord(c)] for c in value], "u2"))
                stored.attrs["MATLAB_class"] = np.bytes_("char")
            else:
                stored = group.create_dataset(name, data=np.atleast_2d(value).T)
                stored.attrs["MATLAB_class"] = np.bytes_("double")

        for name, value in variables.items():
            write(file, name, value)
    content = bytearray(path.read_bytes())
    header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Thu Nov 26 2026 HDF5 schema 1.00 ."
    content[: len(header)] = header
    path.write_bytes(bytes(content))


@pytest.mark.parametrize("form", ["cells", "structs"])
def test_version_73_reads_as_version_5_does(tmp_path, form):
    parts = movements((40, 50, 60))
    demos = [{"pos": x.T, "vel": u.T, "dt": np.array(0.1), "name": "run"} for x, u in parts]
    stored = demos if form == "cells" else {name: [demo[name] for demo in demos] for name in demos[0]}
    write_73(tmp_path / "new.mat", {"demos": stored, "note": "a text"})
    scipy.io.savemat(tmp_path / "old.mat", {"demos": cells(demos)})
    new, old = (uc.load(tmp_path / f"{name}.mat", state="pos", action="vel") for name in ("new", "old"))
    np.testing.assert_array_equal(new.states, old.states)
    np.testing.assert_array_equal(new.actions, old.actions)
    np.testing.assert_array_equal(new.episodes, old.episodes)
    np.testing.assert_allclose(new.time, old.time)
    assert [note.replace("new.mat", "old.mat") for note in new.notes] == list(old.notes)


@real
@pytest.mark.parametrize("shape", sorted((DATA / "handwriting").glob("*.mat")), ids=lambda path: path.stem)
def test_handwriting(shape):
    demos = uc.load(shape, state="pos", action="vel")
    assert (len(demos), demos.n_episodes, demos.states.shape[1]) == (7000, 7, 2)
    assert np.bincount(demos.episodes).tolist() == [1000] * 7
    recorded = scipy.io.loadmat(shape)["demos"][0, 3]
    np.testing.assert_array_equal(demos.episode(3).states, recorded["pos"][0, 0].T)
    np.testing.assert_array_equal(demos.episode(3).time, recorded["t"][0, 0].ravel())


@real
@pytest.mark.parametrize(("name", "episodes"), [("reaching_cluttered", 10), ("box_closing", 6)])
def test_reaching(name, episodes):
    demos = uc.load(DATA / "reaching" / f"{name}.mat", state="pos", action="vel", time="time")
    assert (len(demos), demos.n_episodes, demos.states.shape[1]) == (250 * episodes, episodes, 3)
    assert any("time x dimensions (250 x 3)" in note for note in demos.notes)


@real
@pytest.mark.parametrize(("name", "samples", "stopped"), [("rim", 10920, {5}), ("fender", 6617, {1, 2})])
def test_wiping(name, samples, stopped):
    source = uc.open(DATA / "wiping" / f"demos_{name}_processed_data.mat", state=["X[0]", "X[1]", "X[2]"])
    demos = source.load()
    assert (len(demos), demos.n_episodes) == (samples, {"rim": 6, "fender": 3}[name])
    for episode in range(1, demos.n_episodes + 1):
        noted = any(f"X[12] do not change in most steps of episode {episode}" in note for note in demos.notes)
        assert noted == (episode in stopped)
    assert any("time is counted in steps of 0.009" in note for note in demos.notes)
    streamed = np.concatenate([block.actions for block in source.blocks(1000)])
    np.testing.assert_array_equal(streamed, demos.actions)


@pytest.mark.parametrize("axes", [(2, 1, 0), (1, 2, 0)])
def test_arrays_of_three_axes_count_demonstrations_along_the_last(tmp_path, axes):
    batch = np.random.default_rng(0).normal(size=(7, 60, 4))
    scipy.io.savemat(tmp_path / "m.mat", {"Data": batch.transpose(axes), "dt": 0.05})
    demos = uc.load(tmp_path / "m.mat", state="Data")
    assert demos.n_episodes == 7
    np.testing.assert_array_equal(demos.states, batch.reshape(-1, 4))
    assert any("7 demonstrations found in the last axis of Data" in note for note in demos.notes)


def test_poses_of_three_axes_are_one_demonstration(tmp_path):
    scipy.io.savemat(tmp_path / "m.mat", {"H": np.random.default_rng(0).normal(size=(4, 4, 60)), "dt": 0.05})
    demos = uc.load(tmp_path / "m.mat", state="H")
    assert (demos.n_episodes, demos.states.shape) == (1, (60, 16))


def test_the_goal_of_a_demonstration_is_a_column(tmp_path):
    parts = [{"x": x, "u": u, "aim": x[-1:]} for x, u in movements((50, 60))]
    scipy.io.savemat(tmp_path / "m.mat", {"demos": structs(parts), "dt": 0.05})
    by_column = uc.load(tmp_path / "m.mat", state="x", relative_to="goal", action="u", action_is="velocity")
    named = uc.load(tmp_path / "m.mat", state="x", relative_to="aim", action="u")
    np.testing.assert_allclose(by_column.states, named.states)
    found = uc.inspect(tmp_path / "m.mat")
    assert {column.kind for column in found.columns if column.name.startswith("aim")} == {"constant"}


def test_a_single_cell_of_version_7_3_is_not_the_field_of_a_struct(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "m.mat", "w", userblock_size=512) as file:
        cell = file.create_dataset("demos", (2, 1), dtype=h5py.ref_dtype)
        cell.attrs["MATLAB_class"] = np.bytes_("cell")
        for i, (x, u) in enumerate(movements((50, 60))):
            group = file.create_group(f"#refs#/{'ab'[i]}")
            group["x"], group["u"] = x.T, u.T
            cell[i, 0] = group.ref
    with (tmp_path / "m.mat").open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file")
    demos = uc.load(tmp_path / "m.mat", state="x", action="u")
    assert demos.n_episodes == 2
    assert any("2 demonstrations found in demos" in note for note in demos.notes)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (
            b"\x06\x00\x00\x00\x00\x00\x00\x00\x05\x00\x00\x00",
            b"\x06\x08\x00\x00\x00\x00\x00\x00\x05\x00\x00\x00",
        ),
        (b"\x09\x00\x00\x00\xe0\x01\x00\x00", b"\xf1\x00\x00\x00\xe0\x01\x00\x00"),
    ],
    ids=["no imaginary part", "no such type"],
)
def test_damage_at_which_scipy_would_end_the_program_is_a_sentence(tmp_path, before, after):
    path = tmp_path / "m.mat"
    scipy.io.savemat(path, {"x": np.random.default_rng(0).normal(size=(20, 3))})
    content = path.read_bytes()
    assert before in content
    path.write_bytes(content.replace(before, after))
    with pytest.raises(DataError, match="is damaged or not a MATLAB file"):
        uc.load(path, state="x", rate=1)
