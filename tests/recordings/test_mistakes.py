"""`load` on recordings that cannot be used: one sentence each, naming the file and the place in it."""

import contextlib
import io
import os
import pickle
import zipfile

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import unconstrain as uc
from unconstrain import storage
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, UnconstrainError
from unconstrain.recordings import load

XU = {"state": "x", "action": "u"}
XT = {"state": "x", "time": "t"}
MOVING = "t,x\n" + "".join(f"{i / 50},{i}\n" for i in range(20))


@pytest.mark.parametrize(
    ("content", "options", "sentence"),
    [
        ("", XU, r"a.csv is empty"),
        ("\n \n# only this\n", XU, r"a.csv is empty"),
        ("x,u\n", XU, r"a.csv has a header but no samples"),
        ("x,u\n1,2\n", XU, r"a.csv has one sample"),
        ("x,u\n1,0\n2,0\n", XU, r"all actions of .*a.csv are zero"),
        ("x,v\n1,2\n", XU, r"a.csv has no column 'u' for action; its columns are 0 'x', 1 'v'"),
        ("x,velocity\n1,2\n", XU | {"action": "velocty"}, r"did you mean 'velocity'\?"),
        ("1,2\n3,4\n", XU, r"a.csv has no column 'x' for state; it has no header but 2 columns"),
        ("x,u\n1,2\n", XU | {"state": 2}, r"no column at position 2 for state: .*from 0 to 1"),
        ("x,u\n1,2\n", XU | {"state": -1}, r"no column at position -1"),
        ("x,u\n1,2\n", XU | {"state": True}, r"state takes column names or positions .* got True"),
        ("x,u\n1,2\n", XU | {"state": 1.5}, r"state takes column names or positions .* got 1.5"),
        ("x,u\n1,2\n", XU | {"state": []}, r"no state columns were given"),
        ("x,u\n1,2\n", {}, r"give state=, .* its columns are 0 'x', 1 'u'"),
        ("x,u\n1,2\n", {"action": "u"}, r"give state= too"),
        ("x,u\n1,2\n", {"state": "x"}, r"give action=, or time="),
        ("x,u\n1,2\n\n# here\n3,oops\n", XU, r"column 'u' holds 'oops' at line 5 where a number is needed"),
        ("1,2\n3,oops\n", {"state": 0, "action": 1}, r"column 1 \(counted from 0\) holds 'oops' at line 2"),
        ("x,x,u\n1,2,3\n1,b,3\n", XU | {"state": 1}, r"column 1 \('x', counted from 0\) holds 'b' at line 3"),
        ("x,u\n1,2\n3,\n5,\n", XU, r"column 'u' is empty at line 3 and 1 more"),
        ("x\tu\n1\t2\n\t\n", XU, r"column 'x' is empty at line 3"),
        ("x,u\n1,2\nnan,3\n", XU, r"column 'x' holds nan at line 3"),
        ("x,u\n1,2\n3,1e300\n", XU, r"column 'u' holds 1e\+300 at line 3"),
        ("x,u\n" + "1" * 200_000 + ",2\n", XU, r"a.csv cannot be read as a text table"),
        ("x,u\n1,-inf\n2,3\n", XU, r"column 'u' holds -inf at line 2"),
        ("x,u\n1,2\n3,4,5\n", XU, r"a.csv: line 3 has 3 cells where the first line has 2"),
        ("x,u\n1,2\n3\n", XU, r"a.csv: line 3 has 1 cell where the first line has 2"),
        ("x,u,e\n1,2,a\n3,4,\n", XU | {"episode": "e"}, r"column 'e' is empty at line 3"),
        (b"\x00\x01\x02\xff" * 50, XU, r"a.csv is not a text table"),
        ("x,u\n1,2\n°,3\n".encode("latin-1"), XU, r"column 'x' holds '°' at line 3"),
        ("x,u\n1,2\n".encode("utf-16")[:-1], XU, r"a.csv is not a text table: save it as UTF-8"),
        (
            "x;u\n1,050;2\n1,5;3\n1,000,000;4\n",
            XU,
            r"holds '1,000,000' and '1,5', so its commas mean two things",
        ),
        (
            "x;u\n1,050;2\n1;3\n",
            XU,
            r"column 'x' holds '1,050' beside '1', so its comma may be a decimal mark",
        ),
        ("0\n8,3\n2,4\n", {"state": 0, "action": 0}, r"line 2 has 2 cells where the first line has 1"),
        ("x\n1,5\n2,5\n", {"state": 0, "action": 0}, r"line 2 has 2 cells where the first line has 1"),
        (" x u\n0 1.5 2\n1 2.5 3\n", XU, r"line 2 has 3 cells where the first line has 2"),
        ("A title\n\nx,u\n1,2\n3,4\n5,6,7\n8,9\n", XU, r"line 6 has 3 cells where the first line has 2"),
        ("t,x\n0,1\n1,2\n1,3\n", XT, r"time in column 't' repeats a stamp at line 4"),
        ("t,x\n0,1\n2,2\n1,3\n", XT, r"time in column 't' goes back at line 4"),
        ("t,x\n0,1\nlater,2\n", XT, r"column 't' holds 'later' at line 3"),
        ("t,x\n0,1\n,2\n", XT, r"column 't' is empty at line 3"),
        (
            "t,x\n0,1\n1,2\n",
            XT,
            r"episode 'a' has 2 samples over 1 s, too few to differentiate; leave it out",
        ),
        ("t,x\n0,1\n", XT, r"episode 'a' has 1 sample over 0 s, too few"),
        (MOVING, XT | {"window": 2}, r"episode 'a' has 20 samples over 0.38 s, too few .* window=2 s"),
        (
            MOVING,
            XT | {"time_unit": "min"},
            r"time_unit must be one of s, ms, us, ns",
        ),
        (MOVING, XT | {"window": 0}, r"window must be a positive number, got 0"),
        (MOVING, XT | {"max_speed": "fast"}, r"max_speed must be a positive number, got 'fast'"),
        (MOVING, XT | {"max_speed": 1e-9}, r"no fragment lasts 0.04 s; raise gap= or max_speed="),
        (MOVING, {"state": "x", "action": "t", "max_speed": 1}, r"max_speed needs to know the time"),
        (MOVING, XT | {"min_speed": 1e9}, r"no sample is as fast as min_speed=1e\+09"),
        ("t,x\n" + "".join(f"{i / 50},3.3\n" for i in range(20)), XT, r"are zero: the states do not move"),
        ("t,x,e\n0,1,a\n1,2,b\n0,3,a\n", XT | {"episode": "e"}, r"repeats a stamp at line 4"),
    ],
)
def test_text_tables(tmp_path, content, options, sentence):
    path = tmp_path / "a.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(DataError, match=sentence) as caught:
        load(path, **options)
    assert "\n" not in str(caught.value)


def test_paths(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("x,u\n1,2\n3,4\n")
    (tmp_path / "b.xlsx").write_text("x")
    (tmp_path / "b.bin").write_bytes(bytes(range(256)))
    (tmp_path / "folder.csv").mkdir()
    for paths, sentence in [
        (tmp_path / "none.csv", r"there is no file .*none.csv"),
        (tmp_path / "folder.csv", r"is a folder without Parquet files: give its files, or a pattern"),
        (tmp_path / "b.xlsx", r"b.xlsx is damaged or not an Excel workbook"),
        (tmp_path / "b.bin", r"suffix '.bin'; those known are .csv, .tsv, .txt, .*.npz, .*.parquet"),
        (str(tmp_path / "*.tsv"), r"no file matches"),
        ([], r"nothing was given to open"),
        ([path, path], r"a.csv is given twice"),
        (None, r"source must be a path or several"),
        ([1], r"the source is not a path"),
        ([path, 1], r"paths must be a path or several"),
    ]:
        with pytest.raises(DataError, match=sentence):
            load(paths, **XU)


def npz(**arrays):
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


ONES = np.ones(3)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (npz(x=ONES, u=ONES[:2]), r"'u' has shape \(2,\), of which no axis has the 3 samples"),
        (npz(x=np.array([1, np.nan, 2]), u=ONES), r"column 'x' holds nan at row 1 \(counted from 0\)"),
        (npz(x=np.array(["a", "b", "c"]), u=ONES), r"column 'x' holds 'a' at row 0"),
        (npz(x=np.array([1, "a", None], dtype=object), u=ONES), r"'x' holds pickled Python objects"),
        (npz(x=ONES * 1j, u=ONES), r"'x' holds values of type complex128"),
        (npz(x=ONES[:0], u=ONES[:0]), r"empty"),
        (npz(), r"is empty|is damaged"),
        (npz(x=ONES, u=ONES)[:-40], r"a.npz is damaged"),
        (npz(x=ONES, u=ONES).replace(ONES.tobytes(), b"\x07" * 24), r"a.npz is damaged"),
        (pickle.dumps({"x": ONES}), r"a.npz is not an NPZ archive"),
        (b"", r"a.npz is empty"),
    ],
)
def test_npz(tmp_path, content, sentence):
    (tmp_path / "a.npz").write_bytes(content)
    with pytest.raises(DataError, match=sentence):
        load(tmp_path / "a.npz", **XU)


def parquet(columns):
    buffer = io.BytesIO()
    pq.write_table(pa.table(columns), buffer)
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (parquet({"x": [1.0, None], "u": [1, 2]}), r"column 'x' is empty at row 1"),
        (parquet({"x": [True, False], "u": [1, 2]}), r"column 'x' holds bool values where numbers"),
        (
            parquet({"x": [[1], [2, 3]], "u": [1, 2]}),
            r"'x' holds lists that .* differ in length, first at row 1",
        ),
        (parquet({"x": [[[1]]] * 2, "u": [1, 2]}), r"'x' holds list<.* values"),
        (parquet({"x": pa.array([], pa.float64()), "u": pa.array([], pa.float64())}), r"has no samples"),
        (parquet({"y": [1], "u": [1]}), r"no column 'x' for state"),
        (parquet({"x": [1.0], "u": [1]})[:-9], r"a.parquet is damaged or not a Parquet file"),
        (b"nothing like it", r"a.parquet is damaged or not a Parquet file"),
    ],
)
def test_parquet(tmp_path, content, sentence):
    (tmp_path / "a.parquet").write_bytes(content)
    with pytest.raises(DataError, match=sentence):
        load(tmp_path / "a.parquet", **XU)


def test_one_role_one_column(tmp_path):
    np.savez(tmp_path / "a.npz", x=np.ones((3, 2)), u=ONES)
    with pytest.raises(DataError, match=r"episode takes one column, but 'x' stands for 2"):
        load(tmp_path / "a.npz", state="x", action="u", episode="x")
    np.savez(tmp_path / "a.npz", x=ONES, u=ONES, e=ONES[:2])
    with pytest.raises(DataError, match=r"'e' has shape \(2,\), of which no axis has the 3 samples"):
        load(tmp_path / "a.npz", state="x", action="u", episode="e")
    with pytest.raises(DataError, match=r"'e' has shape \(2,\), of which no axis has the 3 samples"):
        load(tmp_path / "a.npz", state="x", action="u", time="e")


def test_saved_files_that_are_damaged_or_too_new(tmp_path):
    demos = Demonstrations(np.ones((3, 2)), np.ones((3, 2)))
    path = tmp_path / "a.npz"
    demos.save(path)
    about, arrays = storage.read(path, storage.Kind.DEMONSTRATIONS)
    for changes, others, sentence in [
        ({"format": 99}, {}, "newer release"),
        ({"roles": {}}, {}, "damaged and cannot be read as saved"),
        ({"roles": about["roles"] | {"time": "t"}}, {}, "damaged and cannot be read as saved"),
        ({"state_names": 3}, {}, "damaged and cannot be read as saved"),
        ({}, {"states": np.ones((2, 2))}, "damaged and cannot be read as saved"),
        ({}, {"episodes": np.array([0, 0, 5])}, "damaged and cannot be read as saved"),
    ]:
        storage.write(path, storage.Kind.DEMONSTRATIONS, about | changes, arrays | others)
        with pytest.raises(DataError, match=sentence):
            load(path)
    storage.write(path, storage.Kind.DEMONSTRATIONS, [], {})
    with pytest.raises(DataError, match="empty"):
        load(path)
    storage.write(path, storage.Kind.MOMENTS, about, arrays)
    with pytest.raises(DataError, match=r"holds moments, not demonstrations: load them with moments.load"):
        load(path)


@pytest.mark.parametrize("suffix", [".npz", ".parquet"])
def test_a_changed_byte_of_a_saved_file_is_noticed(tmp_path, suffix):
    states = np.random.default_rng(0).normal(size=(200, 3))
    path = tmp_path / f"a{suffix}"
    Demonstrations(states, states).save(path)
    good = path.read_bytes()
    for place in range(50, len(good), 499):
        path.write_bytes(good[:place] + bytes([good[place] ^ 1]) + good[place + 1 :])
        with contextlib.suppress(DataError):  # otherwise it was a byte of no consequence
            np.testing.assert_array_equal(load(path).states, states)


def columns(tmp_path, name, **arrays):
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    pq.write_table(pa.table(arrays), path, row_group_size=1000)
    return path


def test_the_content_of_a_file_tells_its_format(tmp_path):
    path = columns(tmp_path, "a.csv", x=ONES, u=ONES)
    assert len(load(path, **XU)) == 3
    (tmp_path / "b.dat").write_bytes(npz(x=ONES, u=ONES))
    assert len(load(tmp_path / "b.dat", **XU)) == 3
    Demonstrations(np.ones((3, 2)), np.ones((3, 2))).save(tmp_path / "c.npz")
    (tmp_path / "c.npz").rename(tmp_path / "c.txt")
    assert load(tmp_path / "c.txt").states.shape == (3, 2)


def test_pipes_and_devices_are_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    for path in (tmp_path / "pipe.csv", "/dev/zero"):
        with pytest.raises(DataError, match="is a pipe or a device and not a file"):
            load(path, **XU)
    columns(tmp_path, "parts/a.parquet", x=ONES, u=ONES)
    os.mkfifo(tmp_path / "parts" / "b.parquet")
    assert len(load(tmp_path / "parts", **XU)) == 3


def test_links_do_not_multiply_samples(tmp_path):
    folder = columns(tmp_path, "parts/a.parquet", x=ONES, u=ONES).parent
    for name in ("again", "and_again"):
        (folder / name).symlink_to(folder)
    (folder / "b.parquet").symlink_to(folder / "a.parquet")
    os.link(folder / "a.parquet", folder / "c.parquet")
    (folder / "nowhere.parquet").symlink_to(folder / "gone")
    assert len(load(folder, **XU)) == 3
    (folder / "nowhere.parquet").unlink()
    assert len(load(str(folder / "*.parquet"), **XU)) == 3
    assert len(load(str(folder / "**" / "*.parquet"), **XU)) == 3
    for twice in (
        [folder / "a.parquet", folder / "b.parquet"],
        [folder, folder / "a.parquet"],
        [folder.as_uri(), folder.as_uri()],
    ):
        with pytest.raises(DataError, match="is given twice"):
            load(twice, **XU)


def test_a_file_cut_while_it_is_read_is_one_sentence(tmp_path):
    x = np.random.default_rng(0).normal(size=3_000_000)
    path = columns(tmp_path, "a.parquet", x=x, u=x)
    blocks = uc.open(path, **XU).blocks(100_000)
    assert len(next(blocks)) == 100_000
    os.truncate(path, 10_000)
    with pytest.raises(DataError, match=r"a.parquet is damaged or not a Parquet file"):
        list(blocks)


def test_sizes_are_checked_before_memory_is_taken(tmp_path):
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**15,)})
    path = tmp_path / "a.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("x.npy", header.getvalue())
        archive.writestr("u.npy", header.getvalue())
    with pytest.raises(DataError, match=r"a.npz is damaged: x.npy does not hold what it promises"):
        load(path, **XU)
    big = columns(tmp_path, "a.parquet", x=np.ones(100_000), u=np.ones(100_000))
    recordings = uc.open(big, **XU)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("unconstrain.memory.available_memory", lambda: 1e6)
        with pytest.raises(
            DataError, match=r"a.parquet would take .* use fit_stream, or read them block by block"
        ):
            recordings.load()
        assert sum(len(block) for block in recordings.blocks()) == 100_000


def test_names_reach_no_terminal_as_they_are(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("\x1b[31mx,u\n1,2\n3,oops\n")
    with pytest.raises(DataError) as caught:
        load(path, state=0, action="u")
    assert str(caught.value).isprintable()
    with pytest.raises(DataError) as caught:
        load(path, state="y", action="u")
    assert str(caught.value).isprintable()
    path.write_text("\x1b[31mx,u\n1,2\n3,4\n")
    assert repr(load(path, state=0, action="u")).isprintable()


def test_files_of_a_folder_hold_columns_of_one_kind(tmp_path):
    columns(tmp_path, "parts/a.parquet", x=ONES, u=ONES, e=[1, 1, 2], v=[[1.0, 2.0]] * 3)
    columns(tmp_path, "parts/b.parquet", x=ONES, u=ONES, e=["1", "1", "2"], v=[[1.0, 2.0, 3.0]] * 3)
    with pytest.raises(
        DataError, match=r"b.parquet and the files beside it hold text and number values in column 'e'"
    ):
        load(tmp_path / "parts", **XU, episode="e")
    with pytest.raises(DataError, match=r"b.parquet: 'v' holds lists that are missing or differ in length"):
        load(tmp_path / "parts", state="v", action="u")


def test_columns_and_options_are_given_once(tmp_path):
    path = columns(tmp_path, "a.parquet", x=ONES, u=ONES)
    opened = uc.open(
        path, columns=uc.Columns(state="x", action="u"), preparation=uc.Preparation(min_speed=0.5)
    )
    assert len(opened.load()) == 3
    assert uc.open(opened) is opened
    for options, sentence in [
        ({"columns": uc.Columns(state="x"), "action": "u"}, "give either columns= or action="),
        ({"columns": {"state": "x"}}, "columns= must be a Columns"),
        ({"preparation": uc.Preparation(), "window": 1.0}, "give either preparation= or window="),
    ]:
        with pytest.raises(DataError, match=sentence):
            uc.open(path, **options)
    with pytest.raises(DataError, match="are open already"):
        uc.open(opened, state="x")
    with pytest.raises(DataError, match="window= is about columns of files"):
        uc.open([(np.ones((3, 1)), np.ones((3, 1)))], window=1.0)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"time_unit": ["s"]}, "time_unit must be one of s, ms, us, ns, got"),
        ({"window": 10**400}, "window must be a positive number, got 1000"),
        ({"gap": float("nan")}, "gap must be a positive number, got nan"),
        ({"state": 1.5}, "state takes column names or positions"),
        ({"state": np.array(None)}, "state takes column names or positions"),
        ({"time": ["t"]}, "time takes a column's name or position"),
        ({"episode": np.eye(2)}, "episode takes a column's name or position"),
        ({"projections": 1e308}, "projections takes column names or positions"),
    ],
)
def test_options_of_another_kind_are_told_before_anything_is_read(given, sentence):
    with pytest.raises(UnconstrainError, match=sentence) as caught:
        load("nothing.csv", **given)
    assert len(str(caught.value)) < 200


def test_columns_may_be_an_array_or_a_number_of_numpy(tmp_path):
    (tmp_path / "a.csv").write_text("x,y,u,v\n1,2,3,4\n5,6,7,8\n")
    demos = load(tmp_path / "a.csv", state=np.array(["x", "y"]), action=np.array([2, 3]))
    assert demos.actions.tolist() == [[3.0, 4.0], [7.0, 8.0]]
    assert load(tmp_path / "a.csv", state=np.int8(0), action=np.int8(2)).states.tolist() == [[1.0], [5.0]]


def test_an_archive_without_states_is_damaged(tmp_path):
    path = tmp_path / "a.npz"
    Demonstrations(np.eye(2), np.eye(2)).save(path)
    about, arrays = storage.read(path, storage.Kind.DEMONSTRATIONS)
    storage.write(path, storage.Kind.DEMONSTRATIONS, about, arrays | {"states": np.array("x")})
    with pytest.raises(DataError, match="it holds no states"):
        load(path)


@pytest.mark.parametrize(
    ("options", "missing"),
    [({"action": "u"}, "x"), ({"action": "u", "time": "t"}, "x"), ({"time": "t"}, "x"), ({"time": "t"}, "t")],
)
def test_a_recording_with_something_missing_in_every_row(tmp_path, options, missing):
    path = tmp_path / "a.parquet"
    columns = {"t": np.arange(30) / 50, "x": np.arange(30.0), "u": np.ones(30)}
    columns[missing] = np.full(30, np.nan)
    pq.write_table(pa.table(columns), path)
    with pytest.raises(
        DataError, match=r"a.parquet: in each of its 30 rows a state, an action or a stamp is"
    ):
        load(path, state="x", drop="missing", **options)


def test_a_recording_at_rest_without_its_pauses(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("t,x\n" + "".join(f"{i / 50},1\n" for i in range(99)))
    with pytest.raises(DataError, match=r"a.csv: all of it is at rest"):
        load(path, **XT, drop="pauses")


def test_the_row_that_is_named_is_that_of_the_file(tmp_path):
    path = tmp_path / "a.parquet"
    x = np.arange(100.0)
    x[60:] = np.nan
    lists = [[1.0]] * 100
    lists[10] = [1.0, 2.0]
    pq.write_table(pa.table({"x": x, "u": np.ones(100), "n": lists}), path)
    with pytest.raises(DataError, match=r"is nan at row [6-9]\d |holds nan at row [6-9]\d "):
        uc.open(path, state="x", action="u").source.sample(50, 0)
    x[:60] = np.where(np.arange(60) < 5, np.nan, x[:60])
    pq.write_table(pa.table({"x": x, "u": np.ones(100), "n": lists}), path)
    with pytest.raises(DataError, match=r"holds a list of 2 at row 10 "):
        load(path, state="x", action="u", projections="n", drop="missing")
