"""Long texts are read by a way of their own, which must give what reading line by line gives."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import unconstrain as uc
from unconstrain.errors import DataError
from unconstrain.recordings.episodewise import median, norms, percentile, step_norms
from unconstrain.recordings.files import File, locate
from unconstrain.recordings.formats import kept, text
from unconstrain.recordings.formats.text import Text

ROWS = 1400  # longer than what is looked at to find the layout
COLUMNS = {"state": ["x", "y"], "action": ["u", "v"], "time": "t", "episode": "run"}


def lines(separator: str = ",", stamps: str = "t", labels: str = "{}") -> list[str]:
    rng = np.random.default_rng(0)
    numbers = rng.standard_normal((ROWS, 4)).round(7)
    every = []
    for i, row in enumerate(numbers):
        t = {"t": f"{i % 700 * 0.01:.2f}", "ns": str(1_700_000_000_000_000_000 + i * 10_000_019)}
        t |= {"whole": str(i), "date": f"2024-01-01 12:{i // 60 % 60:02}:{i % 60:02}.5"}
        cells = [t[stamps], labels.format(i // 700), *map(repr, row.tolist()), "word"]
        every.append(separator.join(cells))
    return every


HEADER = "t,run,x,y,u,v,said"


@pytest.fixture
def outcomes(tmp_path, monkeypatch):
    """What is read of a text by either way: demonstrations, or the sentence of a mistake."""

    def read(content: bytes, long: float, options: dict):
        path = tmp_path / "log.csv"
        path.write_bytes(content)
        monkeypatch.setattr(text, "LONG", long)
        try:
            return uc.load(path, **COLUMNS | options)
        except DataError as error:
            return str(error)

    def both(content: bytes, **options):
        return read(content, 0, options), read(content, float("inf"), options)

    return both


def assert_same(one, other):
    if isinstance(one, str) or isinstance(other, str):
        assert one == other
        return
    for name in ("states", "actions", "episodes", "time"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert one.episode_labels == other.episode_labels
    assert one.notes == other.notes


def replaced(place: int, cell: int, value: str, separator: str = ","):
    def change(every: list[str]) -> list[str]:
        cells = every[place % len(every)].split(separator)
        cells[cell % len(cells)] = value
        return [*every[: place % len(every)], separator.join(cells), *every[place % len(every) + 1 :]]

    return change


def inserted(place: int, line: str):
    return lambda every: [*every[: place % len(every)], line, *every[place % len(every) :]]


cells = ["", " ", "nan", "NA", "-9999", "1,5", '"1,5"', "inf", "1e3", " 2.5 ", "2.5 mm", "°", "1\0", "a", '"a\nb"',
    "0x1f", "1D3", "# no", "//", "1.", "-", "007", "12", "+3", "1'000", "2024-01-01 12:00:00", "--", "50%"]  # fmt: skip
rows = ["", "   ", "# comment", "% comment", " // comment", HEADER, "t,run", "Total,,,,,,", "stopped by the user",
    ",,,,,,", "\0\0\0", "1,2", '"', "s,,m,m,m/s,m/s,", "1,0,1,1,1,1,1,1"]  # fmt: skip
dirt = st.one_of(
    st.builds(replaced, st.integers(-60, ROWS), st.integers(0, 6), st.sampled_from(cells)),
    st.builds(inserted, st.sampled_from([0, 1, 3, 30, 700, ROWS - 1, -1, -2, -30]), st.sampled_from(rows)),
)


def mostly(usual, *others):
    return st.one_of(st.just(usual), st.just(usual), st.sampled_from(others))


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    dirt=st.lists(dirt, max_size=2),
    separator=mostly(",", ";", "\t", " "),
    stamps=mostly("t", "ns", "whole", "date"),
    labels=mostly("{}", "00{}", "wipe {}", '"wipe {}"', "{}.0", "-999{}", "n{}", "{},5", "{} mm", "NA", "{}e1"),
    head=mostly(HEADER, '"t","run","x","y","u","v","said"', HEADER + "\ns,,m,m,m/s,m/s,", "# " + HEADER,
        "made by a logger\n" + HEADER, "# rate: 100 Hz\n" + HEADER),
    tail=mostly("\n", "", "\n# end\n", "\n\n% end", "\n# end\n3.01,1,1,1,1,1,word\n", "\n\n", "\n3.01,1,0.5",
        "\n3.01,1,0.5,0.1,0.2,0.", "\nend of file\n", "\0\0", "\x1a"),
    ends=mostly("\n", "\r\n", "\r", "mixed"),
    bom=mostly(b"", b"\xef\xbb\xbf"),
    encoding=mostly("utf-8", "latin-1", "utf-16"),
    drop=mostly("missing", None, "missing,duplicates"),
    more=mostly({}, {"free": "said"}, {"action": None}, {"state": ["x", "t"]}, {"episode": None}, {"time": "run"},
        {"state": ["x", "nothing"]}, {"episode": "said"}),
)  # fmt: skip
def test_either_way_of_reading_gives_the_same(
    outcomes, dirt, separator, stamps, labels, head, tail, ends, bom, encoding, drop, more
):
    every = lines(separator, stamps, labels)
    for change in dirt:
        every = change(every)
    content = head.replace(",", separator) + "\n" + "\n".join(every) + tail.replace(",", separator)
    if ends == "mixed":
        content = content.replace("\n", "\r\n", 300)
    elif ends != "\n":
        content = content.replace("\n", ends)
    assert_same(*outcomes(bom + content.encode(encoding), drop=drop, **more))


def opened(path) -> Text:
    (file,) = locate(path)
    assert isinstance(file, File)
    return Text(file).for_columns(uc.Columns(**COLUMNS))


@pytest.mark.parametrize(
    ("separator", "stamps", "ends"), [(",", "t", "\n"), ("\t", "ns", "\r\n"), (";", "date", "\n")]
)
def test_plain_texts_are_not_read_line_by_line(tmp_path, monkeypatch, separator, stamps, ends):
    path = tmp_path / "log.csv"
    path.write_bytes(ends.join([HEADER.replace(",", separator), *lines(separator, stamps), ""]).encode())
    monkeypatch.setattr(text, "LONG", 0)
    monkeypatch.setattr(Text, "_rows", lambda self: pytest.fail("read line by line"))
    assert len(uc.load(path, **COLUMNS)) == ROWS


def test_a_half_last_line_and_a_footer_are_left_out_without_reading_line_by_line(tmp_path, monkeypatch):
    path = tmp_path / "log.csv"
    path.write_text("\n".join([HEADER, *lines(), "3.01,1,0.5"]))
    monkeypatch.setattr(text, "LONG", 0)
    monkeypatch.setattr(Text, "_rows", lambda self: pytest.fail("read line by line"))
    demos = uc.load(path, **COLUMNS)
    assert len(demos) == ROWS
    assert any(f"the last line, {ROWS + 2}, is cut off" in note for note in demos.notes)


def test_what_is_kept_of_a_file_goes_with_it_and_does_not_travel(tmp_path, monkeypatch):
    import pickle

    path = tmp_path / "log.csv"
    path.write_text("\n".join([HEADER, *lines(), ""]))
    monkeypatch.setattr(text, "LONG", 0)
    one = opened(path)
    assert one.row_groups == (ROWS,)
    assert kept.find(one) is not None
    assert len(pickle.dumps(one)) < 10_000
    monkeypatch.setattr(kept, "available_memory", lambda: 0.0)
    other = opened(path)
    assert other.row_groups == (ROWS,)
    assert kept.find(other) is None


numbers = st.floats(-1e6, 1e6) | st.sampled_from([0.0, 1e-300, 1e150])


@given(st.lists(numbers, min_size=1, max_size=60), st.sampled_from([0.0, 50.0, 95.0, 99.0, 100.0]))
def test_percentiles_are_those_of_numpy(values, percent):
    values = np.array(values)
    assert percentile(values, percent) == np.percentile(values, percent)
    assert median(values) == np.median(values)


@pytest.mark.parametrize("n", [1, 2, 3, 7, 8, 9, 17])
def test_norms_are_those_of_numpy(n):
    V = np.random.default_rng(n).standard_normal((5000, n)) * 10.0 ** np.arange(n)
    np.testing.assert_array_equal(norms(V), np.linalg.norm(V, axis=1))
    np.testing.assert_array_equal(step_norms(V), np.linalg.norm(np.diff(V, axis=0), axis=1))
