"""Text in any dress: encodings, compression, layouts and numbers as people's programs write them."""

import bz2
import gzip

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from unconstrain.errors import DataError
from unconstrain.recordings import load

TIME = np.arange(20) * 0.1
X = np.column_stack([1 + 2 * TIME, 5 - TIME])
TXY = {"state": ["x", "y"], "time": "t"}


def table(header="t,x,y", mark=",", comma=False, end=""):
    lines = [header.replace(",", mark)] if header else []
    for row in zip(TIME, *X.T, strict=True):
        line = mark.join(f"{value:.2f}" for value in row) + end
        lines.append(line.replace(".", ",") if comma else line)
    return "\n".join(lines) + "\n"


def read(tmp_path, content, name="a.csv", **options):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    demos = load(path, **(options or TXY), window=0.2)
    np.testing.assert_allclose(demos.states, X, atol=1e-9)
    return demos


@pytest.mark.parametrize(
    "content",
    [
        "My recording\nmade on Monday, by me\n\n" + table(),
        "My recording,,\nRate: 100,,\n" + table(),
        "sep=;\n" + table(mark=";"),
        "Subject;A\nRate;100\nUnits;mm\n\n" + table(mark=";", comma=True),
        "".join(f"line {i} of a header block\n" for i in range(40)) + table(),
        "% recorded\n% t x y\n" + table("", " "),
        "// recorded\n" + table(),
        table("t,x,y,", ";", end=";"),
        table(mark=";", end=";"),
        table("t,x,y,ok", " ", end=" True"),
        table("t,x,y,who", " ", end=" me"),
        table(mark=" ", comma=True),
        table("t,x,y\n[s],[m],[m]"),
        "Log\n\n" + table("t,x,y\ns,mm,mm"),
        "t,x,y\n"
        + "".join(f'"{line.replace(",", chr(34) + "," + chr(34))}"\n' for line in table("").split()),
    ],
)
def test_layouts_are_found(tmp_path, content):
    assert read(tmp_path, content).state_names == ("x", "y")


def test_pairs_above_a_table_of_two_columns(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("Subject,A\nRate,100\nx,u\n1,2\n3,4\n")
    assert load(path, state="x", action="u").states.tolist() == [[1.0], [3.0]]


def test_what_is_guessed_of_a_layout_is_noted(tmp_path):
    notes = read(tmp_path, "Log\n\n" + table("t,x,y\ns,mm,mm")).notes[:-1]
    assert notes == (
        "a.csv: line 1 is taken for a title, since the table begins after, and left out",
        "a.csv: line 4 is taken for units: s, mm",
        "a.csv: units are those of the file, and not converted: x, y in mm",
    )


@pytest.mark.parametrize("name", ["a", "a.log", "a.weird", "a.CSV"])
def test_what_is_text_is_read_as_text(tmp_path, name):
    assert not read(tmp_path, table(), name).notes[:-1]


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "latin-1"])
def test_encodings_are_noted(tmp_path, encoding):
    (note,) = read(tmp_path, table("t,x,y,°", end=",é").encode(encoding)).notes[:-1]
    assert ("Latin-1" if encoding == "latin-1" else "UTF-16") in note


@pytest.mark.parametrize(
    "compress", [gzip.compress, bz2.compress, lambda data: pa.compress(data, "zstd", asbytes=True)]
)
def test_compressed_text(tmp_path, compress):
    packed = compress(table().encode())
    assert not read(tmp_path, packed, "a.csv.packed").notes[:-1]
    for damaged in (packed[: len(packed) // 2], compress(bytes(range(256)))):
        with pytest.raises(DataError, match=r"a.csv.gz (is|cannot)"):
            read(tmp_path, damaged, "a.csv.gz")


def test_numbers_that_name_columns(tmp_path):
    demos = read(tmp_path, table("0,1,2"), state=["1", "2"], time="0")
    assert demos.notes[:-1] == (
        "a.csv: the numbers 0, 1, 2 in line 1 are taken for the names of the columns",
    )
    read(tmp_path, table("2019,2020,2021"), state=[2020, 2021], time="2019")
    read(tmp_path, table("t,2020,2021"), state=["2020", "2021"], time="t")
    read(tmp_path, table("t,0,1"), state=[0, 1], time="t")


def test_the_index_of_pandas_is_no_state(tmp_path):
    lines = table("").splitlines()
    content = ",t,x,y\n" + "".join(f"{i},{line}\n" for i, line in enumerate(lines))
    (note,) = read(tmp_path, content, state=[1, 2], time=0).notes[:-1]
    assert "counts the rows, is left out" in note


def test_letters_above_letters_are_no_units(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("run,x,u\nm,1,2\nm,3,4\ns,5,6\n")
    assert load(path, state="x", action="u", episode="run").states.tolist() == [[1.0], [3.0], [5.0]]


def test_long_text_in_two_bytes_a_letter(tmp_path):
    rows = "".join(f"{i},{i % 7}\n" for i in range(20_000))
    for encoding in ("utf-16", "utf-16-be"):
        (tmp_path / "a.csv").write_bytes(("x,u\n" + rows).encode(encoding))
        assert len(load(tmp_path / "a.csv", state="x", action="u")) == 20_000


@pytest.mark.parametrize("mark", [";", "\t", "quoted"])
def test_thousands_are_no_decimals(tmp_path, mark):
    numbers = [900 + 10 * i for i in range(20)]
    cells = [f'"{x:,}"' if mark == "quoted" else f"{x:,}" for x in numbers]
    mark = "," if mark == "quoted" else mark
    path = tmp_path / "a.csv"
    path.write_text(f"t{mark}x\n" + "".join(f"{i / 10}{mark}{cell}\n" for i, cell in enumerate(cells)))
    demos = load(path, state="x", time="t", window=0.2)
    assert demos.states[:, 0].tolist() == numbers
    assert demos.notes[:-1] == ("a.csv: commas in numbers of column 'x' are read as setting off thousands",)


@pytest.mark.parametrize(
    "stamp",
    [
        lambda s: f"12:00:{s:05.2f}",
        lambda s: f"2024/03/04 10:11:{s:04.1f}",
        lambda s: f"04.03.2024 10:11:{s:04.1f}",
        lambda s: f"2024-03-04T10:11:{s:04.1f}",
    ],
)
def test_stamps_as_people_write_them(tmp_path, stamp):
    lines = [f"{stamp(i / 10)};{x};{y}" for i, (x, y) in enumerate(X)]
    np.testing.assert_allclose(read(tmp_path, "t;x;y\n" + "\n".join(lines)).time, TIME, atol=1e-9)


@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    numbers=st.lists(
        st.tuples(*[st.floats(-1e6, 1e6).map(lambda x: round(x, 4))] * 3), min_size=2, max_size=8
    ).filter(lambda rows: any(row[2] for row in rows)),
    mark=st.sampled_from([",", ";", "\t", " "]),
    comma=st.booleans(),
    title=st.sampled_from(["", "A title\n", "Made by me on Monday\nwith care\n\n", "# a remark\n"]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16"]),
    packed=st.booleans(),
)
def test_numbers_come_back_from_any_dress(tmp_path, numbers, mark, comma, title, encoding, packed):
    lines = [mark.join(f"{value:.4f}" for value in row) for row in numbers]
    if comma and mark != ",":
        lines = [line.replace(".", ",") for line in lines]
    content = (title + mark.join("abu") + "\n" + "\n".join(lines)).encode(encoding)
    path = tmp_path / "a.csv"
    path.write_bytes(gzip.compress(content) if packed else content)
    demos = load(path, state=["a", "b"], action="u")
    np.testing.assert_array_equal(np.column_stack([demos.states, demos.actions]), numbers)
