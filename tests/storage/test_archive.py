"""The file: what is written comes back, and whatever the bytes, a file is read or refused in one sentence."""

import io
import json
import os
import struct
import zipfile
import zlib
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from unconstrain import storage
from unconstrain.errors import ArchiveError, DataError, UnconstrainError

POLICY = storage.Kind.POLICY
ARRAYS = {"coef_": np.arange(6.0).reshape(2, 3), "names": np.array(["x", "yÿ"]), "none": np.zeros((0, 3))}
TREE = {"a": [1, None, True, 0.5, "text"], "b": {"array": "coef_"}}


@pytest.fixture
def saved(tmp_path):
    path = tmp_path / "file.skops"
    storage.write(path, POLICY, TREE, ARRAYS)
    return path


def test_what_is_written_comes_back(saved):
    tree, arrays = storage.read(saved, POLICY)
    assert tree == TREE
    assert list(arrays) == list(ARRAYS)
    for name, array in ARRAYS.items():
        np.testing.assert_array_equal(arrays[name], array)
        assert arrays[name].dtype == array.dtype
        assert arrays[name].flags.writeable


def test_numpy_reads_the_arrays(saved):
    with np.load(saved) as found:
        np.testing.assert_array_equal(found["coef_"], ARRAYS["coef_"])
        assert json.loads(found["unconstrain.json"])["kind"] == "policy"


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    hnp.arrays(
        st.sampled_from(["f8", "f4", "f2", "i8", "i1", "u4", "?", "U3", "S4", ">f8", ">i4", ">U2"]),
        hnp.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=4),
    ),
    st.booleans(),
)
def test_arrays_of_any_type_shape_and_order_come_back(tmp_path, array, fortran):
    if array.dtype.kind == "U":  # text only: NumPy's arrays of it can hold what no text can
        array = np.char.encode(array, "ascii", "replace").astype(array.dtype)
    array = np.asarray(array, order="F" if fortran else "C")
    storage.write(tmp_path / "a", POLICY, None, {"a": array})
    found = storage.read(tmp_path / "a", POLICY)[1]["a"]
    np.testing.assert_array_equal(found, array)
    assert found.dtype == array.dtype.newbyteorder("=")
    assert found.flags.f_contiguous == array.flags.f_contiguous


def test_kinds_are_told_by_content(saved, tmp_path):
    assert storage.kind_of(saved) is POLICY
    (tmp_path / "renamed.csv").write_bytes(saved.read_bytes())
    assert storage.kind_of(tmp_path / "renamed.csv") is POLICY
    np.savez(tmp_path / "other.npz", states=np.eye(2))
    (tmp_path / "text.skops").write_text("t,x\n")
    (tmp_path / "empty.skops").touch()
    os.mkfifo(tmp_path / "pipe")
    for name in ("other.npz", "text.skops", "empty.skops", "nothing", "pipe", "."):
        assert storage.kind_of(tmp_path / name) is None


@pytest.mark.parametrize("kind", [kind for kind in storage.Kind if kind is not POLICY])
def test_another_kind_is_told_and_what_to_do_with_it(saved, kind):
    sentence = f"file.skops holds a policy, not {kind.described}: load it with load_policy"
    with pytest.raises(ArchiveError, match=sentence):
        storage.read(saved, kind)


def refused(path, sentence):
    with pytest.raises(ArchiveError, match=sentence) as caught:
        storage.read(path, POLICY)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_what_is_no_file_is_refused_without_waiting(tmp_path):
    refused(tmp_path / "nothing.skops", "there is no such policy file")
    refused(tmp_path / "nothing.skops" / "below", "there is no such policy file")
    refused(tmp_path, "is a folder")
    os.mkfifo(tmp_path / "pipe.skops")
    refused(tmp_path / "pipe.skops", "is not a file")
    refused("/dev/zero", "is not a file")
    (tmp_path / "loop").symlink_to("loop")
    refused(tmp_path / "loop", "cannot be read: too many levels")
    with pytest.raises(ArchiveError, match="cannot be read"):
        storage.read("a\0b", POLICY)


def test_what_others_wrote_is_foreign(tmp_path):
    path = tmp_path / "other.skops"
    for content in (b"", b"hello", b"PK\x03\x04", b"PK\x05\x06" + bytes(18), os.urandom(5000)):
        path.write_bytes(content)
        refused(path, "holds no policy saved by unconstrain")
    with zipfile.ZipFile(path, "w") as other:
        other.writestr("schema.json", json.dumps({"__loader__": "ReduceNode", "__module__": "os"}))
    refused(path, "holds no policy saved by unconstrain")
    with path.open("wb") as file:
        np.savez(file, a=np.array([{}], dtype=object))
    refused(path, "holds no policy saved by unconstrain")


def test_a_newer_layout_asks_for_an_upgrade(saved):
    rewrite(saved, note={"kind": "mind", "layout": 2, "release": "9.0", "tree": None})
    refused(saved, r"written by unconstrain 9\.0, in a newer layout .*: upgrade unconstrain")


@pytest.mark.parametrize("share", [0.1, 0.3, 0.5, 0.95, 0.999])
def test_a_file_cut_off_is_damaged(saved, share):
    whole = saved.read_bytes()
    saved.write_bytes(whole[: int(share * len(whole))])
    refused(saved, r"is damaged \(.*\): save the policy again")


@settings(deadline=None, max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_bytes_changed_anywhere_are_told_or_harmless(saved, data):
    storage.write(saved, POLICY, TREE, ARRAYS)
    broken = bytearray(saved.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        broken[data.draw(st.integers(0, len(broken) - 1))] = data.draw(st.integers(0, 255))
    cut = data.draw(st.sampled_from([0, 0, 0, 1, 22, 60]))
    saved.write_bytes(bytes(broken)[: len(broken) - cut])
    with suppress(ArchiveError):
        tree, arrays = storage.read(saved, POLICY)  # what no checksum covers: dates, flags, versions
        assert tree == TREE
        np.testing.assert_array_equal(arrays["coef_"], ARRAYS["coef_"])


def rewrite(path, note=None, members=(), compression=zipfile.ZIP_STORED):
    """A file that begins as ours, with another note or other members, made by someone who knows the format."""
    names = [name.removesuffix(".npy") for name, _ in members]
    plain = {"kind": "policy", "layout": 1, "release": "0.1.0", "arrays": names, "tree": None}
    given = plain if note is None else note
    text = given if isinstance(given, bytes) else json.dumps(given).encode()
    with zipfile.ZipFile(path, "w", compression) as crafted:
        crafted.writestr(zipfile.ZipInfo("unconstrain.json"), text)
        for name, content in members:
            crafted.writestr(name, content)


def npy(array, **changes):
    file = io.BytesIO()
    np.save(file, array, allow_pickle=True)
    content = file.getvalue()
    for old, new in changes.values():
        assert old in content
        content = content.replace(old, new)
    return content


def header(text, content=b""):
    text = text.encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + content


@pytest.mark.parametrize(
    ("members", "sentence"),
    [
        ([("../../etc/passwd.npy", npy(np.eye(2)))], "holds a part called"),
        ([("/etc/passwd", b"root")], "holds a part called"),
        ([("a\\b.npy", npy(np.eye(2)))], "holds a part called"),
        ([("code.py", b"import os")], "holds a part called"),
        ([(".npy", npy(np.eye(2)))], "holds a part called"),
        ([("a" * 300 + ".npy", npy(np.eye(2)))], "holds a part called"),
        ([("a.npy", npy(np.array([{}, 3], dtype=object)))], "not an array of numbers"),
        ([("a.npy", npy(np.zeros(2, dtype="f8,i4")))], "not an array of numbers"),
        ([("a.npy", npy(np.zeros(2, dtype=complex)))], "not an array of numbers"),
        ([("a.npy", npy(np.zeros(2, dtype="M8[s]")))], "not an array of numbers"),
        ([("a.npy", b"")], "is not an array"),
        ([("a.npy", b"\x93NUMPY\x02\x00" + bytes(50))], "is not an array"),
        ([("a.npy", npy(np.eye(2))[:-1])], "not as long as it says"),
        ([("a.npy", npy(np.eye(2)) + b"0")], "not as long as it says"),
        ([("a.npy", npy(np.eye(2), shape=(b"(2, 2)", b"(9**9)")))], "not an array of numbers"),
        ([("a.npy", npy(np.eye(2), shape=(b"(2, 2)", b"(2,-2)")))], "not an array of numbers"),
        (
            [("a.npy", header("{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000, 1000), }\n"))],
            "not as long as it says",
        ),
        (
            [
                (
                    "a.npy",
                    header("{'descr': '<f8', 'fortran_order': False, 'shape': (0, 9999999999999999999), }\n"),
                )
            ],
            "Maximum allowed dimension",
        ),
        (
            [
                (
                    "a.npy",
                    header(
                        "{'descr': '<U1', 'fortran_order': False, 'shape': (1,), }\n", b"\xff\xff\xff\x7f"
                    ),
                )
            ],
            "holds what is no text",
        ),
        (
            [
                (
                    "a.npy",
                    header(
                        "{'descr': '<U1', 'fortran_order': False, 'shape': (1,), }\n", b"\x00\xd8\x00\x00"
                    ),
                )
            ],
            "holds what is no text",
        ),
        ([("a.npy", header("(" * 5000 + ")" * 5000))], "not an array of numbers"),
        ([("a.npy", header("__import__('os').system('touch ran')"))], "not an array of numbers"),
    ],
)
def test_crafted_members_are_refused(members, sentence, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rewrite("crafted.skops", members=members)
    refused("crafted.skops", rf"is damaged \(.*{sentence}")
    assert os.listdir(tmp_path) == ["crafted.skops"]


@pytest.mark.parametrize(
    "note",
    [
        b"",
        b"{",
        b"[1, 2]",
        b"\xff\xfe",
        b"[" * 200_000,
        b'{"a":' * 100_000,
        b'{"layout": NaN}',
        b'{"layout": 1, "kind": "policy", "tree": Infinity}',
        b'{"layout": 1, "kind": "policy", "tree": ' + b"9" * 10_000 + b"}",
        {"layout": 1, "kind": "policy"},
        {"layout": True, "kind": "policy", "arrays": [], "tree": 1},
        {"layout": "1", "kind": "policy", "arrays": [], "tree": 1},
        {"layout": 1, "kind": ["policy"], "arrays": [], "tree": 1},
        {"layout": 1, "kind": {"policy": 1}, "arrays": [], "tree": 1},
        {"layout": 1, "kind": "mind", "arrays": [], "tree": 1},
        {"layout": -1, "kind": None, "arrays": [], "tree": 1},
        {"layout": 1, "kind": "policy", "tree": 1},
        {"layout": 1, "kind": "policy", "arrays": [1], "tree": 1},
        {"layout": 1, "kind": "policy", "arrays": ["a"], "tree": 1},
    ],
)
def test_crafted_notes_are_refused(note, tmp_path):
    rewrite(tmp_path / "crafted.skops", note=note)
    refused(tmp_path / "crafted.skops", "is damaged")


def test_a_part_that_is_there_twice_is_refused(tmp_path):
    with pytest.warns(UserWarning, match="Duplicate name"):
        rewrite(tmp_path / "crafted.skops", members=[("a.npy", npy(np.eye(2)))] * 2)
    refused(tmp_path / "crafted.skops", "holds a.npy twice")


def peak_of(call):
    """How many bytes Python and NumPy allocated at most."""
    import tracemalloc

    tracemalloc.start()
    try:
        call()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_a_bomb_is_refused_before_it_unpacks(tmp_path):
    path = tmp_path / "bomb.skops"
    zeros = npy(np.zeros(2**25))  # 256 MB, packed into less than one
    rewrite(path, members=[("a.npy", zeros)], compression=zipfile.ZIP_DEFLATED)
    assert path.stat().st_size < 2**20
    assert peak_of(lambda: refused(path, "a.npy is compressed")) < 2**22


def test_a_note_that_unpacks_to_more_than_the_file_is_refused(tmp_path):
    path = tmp_path / "bomb.skops"
    note = b'{"kind": "policy", "layout": 1, "tree": [' + b"[]," * 10**7 + b"0]}"
    with zipfile.ZipFile(path, "w") as crafted:
        crafted.writestr(zipfile.ZipInfo("unconstrain.json"), note)
    assert peak_of(lambda: refused(path, "missing or too long")) < 2**22


def test_parts_that_overlap_are_refused(tmp_path):
    """One stored array, listed a thousand times in the table of contents."""
    path = tmp_path / "bomb.skops"
    rewrite(path, members=[("a0000.npy", npy(np.zeros(10_000)))])
    whole = path.read_bytes()
    end = whole.rindex(b"PK\x05\x06")
    (offset,) = struct.unpack("<L", whole[end + 16 : end + 20])
    listed = whole[offset:end]
    entry = listed[listed.rindex(b"PK\x01\x02") :]
    table = listed + b"".join(entry.replace(b"a0000", f"a{i:04}".encode()) for i in range(1, 1000))
    finish = struct.pack("<4s4H2LH", b"PK\x05\x06", 0, 0, 1001, 1001, len(table), offset, 0)
    path.write_bytes(whole[:offset] + table + finish)
    assert peak_of(lambda: refused(path, "longer than the file")) < 2**23


@pytest.mark.parametrize("large", [False, True])
def test_a_table_of_contents_without_end_is_refused_unread(saved, large):
    whole = bytearray(saved.read_bytes())
    if large:
        zip64 = struct.pack("<4sQ2H2L4Q", b"PK\x06\x06", 44, 45, 45, 0, 0, 2**40, 2**40, 2**40, 0)
        zip64 += struct.pack("<4sLQL", b"PK\x06\x07", 0, len(whole) - 22, 1)
        whole[-22:-22] = zip64
    else:
        whole[-10:-6] = struct.pack("<L", 2**32 - 2)
    saved.write_bytes(bytes(whole))
    refused(saved, "table of contents is too long")


def test_an_array_that_is_not_what_its_checksum_says_is_refused(saved):
    whole = saved.read_bytes()
    spot = whole.index(ARRAYS["coef_"].tobytes())
    saved.write_bytes(whole[: spot + 8] + b"\xff" + whole[spot + 9 :])
    assert zlib.crc32(whole) != zlib.crc32(saved.read_bytes())
    refused(saved, "Bad CRC")


def test_a_file_larger_than_memory_is_told(saved, monkeypatch):
    monkeypatch.setattr("unconstrain.memory.available_memory", lambda: 100.0)
    monkeypatch.setattr("unconstrain.memory.NO_MATTER", 0.0)
    with pytest.raises(DataError, match=r"reading .*file.skops would take .* are left: read it on a machine"):
        storage.read(saved, POLICY)


def test_a_tree_too_large_to_be_read_is_not_written(tmp_path):
    with pytest.raises(UnconstrainError, match="8 MB are the most"):
        storage.write(tmp_path / "p.skops", POLICY, ["text"] * 2 * 10**6, {})
    assert not list(tmp_path.iterdir())
