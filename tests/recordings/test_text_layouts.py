"""What programs write around a table: headers of several lines, footers, and what a crash leaves."""

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.errors import DataError

N = 40
TIME = np.arange(N) * 0.02
X = np.column_stack([1 + 2 * TIME, 5 - TIME])
ROWS = [f"{t:.3f},{x:.4f},{y:.4f}" for t, (x, y) in zip(TIME, X, strict=True)]
BODY = "\n".join(ROWS) + "\n"


def load(tmp_path, content, **options):
    path = tmp_path / "a.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return uc.load(path, **({"state": ["x", "y"], "time": "t"} | options))


def notes(demos):
    """Join what was noted of the file, without the sentences on what was read and on the states' noise."""
    return " | ".join(note.removeprefix("a.csv: ") for note in demos.notes[:-1] if "window=" not in note)


@pytest.mark.parametrize(
    ("header", "names"),
    [
        ("scorer,net,net\nbody,hand,hand\nt,x,y\n", {}),
        (",hand,hand\n,x,y\nt,,\n", {"state": "hand"}),
        ("time,hand,\n,x,y\ns,mm,mm\n", {"state": "hand", "time": "time"}),
        ("t,x,y\n(s),(bar),(furlong)\n", {}),
    ],
)
def test_names_in_several_lines(tmp_path, header, names):
    demos = load(tmp_path, header + BODY, **({"state": [1, 2], "time": 0} | names))
    np.testing.assert_allclose(demos.states, X, atol=1e-4)
    np.testing.assert_allclose(demos.time, TIME, atol=1e-9)
    assert "lines 1 to" in notes(demos) or "taken for units" in notes(demos)


@pytest.mark.parametrize(
    "footer", ["End of file\n", "Total,1.0,2.0\n", "\nMean,1,2\nStd,1,2\n", "\n40 samples written\n"]
)
def test_footers_are_no_samples(tmp_path, footer):
    demos = load(tmp_path, "t,x,y\n" + BODY + footer)
    assert len(demos) == N
    assert "taken for a footer and left out" in notes(demos)


def test_a_short_line_of_numbers_is_no_footer(tmp_path):
    with pytest.raises(DataError, match="line 42 has 2 cells"):
        load(tmp_path, "t,x,y\n" + BODY + "1,2\n")


@pytest.mark.parametrize("cut", ["0.800,2.6", "0.800,2.6,", "0.800,2.6000,4.2", "0.800,2.6000,-"])
def test_a_last_line_that_is_cut_off_is_left_out(tmp_path, cut):
    demos = load(tmp_path, "t,x,y\n" + BODY + cut)
    assert len(demos) == N
    assert "the last line, 42, is cut off, and left out" in notes(demos)


def test_a_last_line_without_an_end_is_a_sample(tmp_path):
    assert not notes(load(tmp_path, "t,x,y\n" + BODY.rstrip()))


def test_what_is_no_footer_and_no_cut_line(tmp_path):
    labels = ["r1"] * 20 + ["end"] * 20
    body = "".join(f"{label},{row}\n" for label, row in zip(labels, ROWS, strict=True))
    assert load(tmp_path, "run,t,x,y\n" + body, episode="run").episode_labels == ("r1", "end")
    whole = "\n".join(f"{i / 2},{i / 2 + 0.5},{(i % 5) / 2 + 0.5 * (i < 9)}" for i in range(10))
    assert len(load(tmp_path, "t,x,y\n" + whole)) == 10
    wheel = "".join(f"{t:.2f},{i},{i % 7}\n" for i, t in enumerate(TIME))
    demos = load(tmp_path, "t,s,us\n" + wheel, state=["s", "us"], angle="none")
    assert not notes(demos)
    demos = load(
        tmp_path,
        "Baud rate: 9600\nfrequency of the filter 6\nx,y\n" + "".join(f"{x},{y}\n" for x, y in X),
        time=None,
        rate=50,
    )
    assert "rate of the header" not in notes(demos)


def test_zeros_that_a_crash_leaves(tmp_path):
    content = ("t,x,y\n" + BODY).encode()
    assert len(load(tmp_path, content + b"\0" * 600)) == N
    middle = content.index(b"0.400")
    demos = load(tmp_path, content[:middle] + b"\0" * 30 + content[middle:])
    assert len(demos) == N - 1
    assert "left out 1 line with bytes that are zero" in notes(demos)


@pytest.mark.parametrize("between", ["", "\n", "# started\n", "Logger 1.2,,\nMonday,,\n"])
def test_a_header_that_comes_again_begins_an_episode(tmp_path, between):
    demos = load(tmp_path, "t,x,y\n" + BODY + between + "t,x,y\n" + BODY)
    assert demos.n_episodes == 2
    assert len(demos) == 2 * N
    assert "the header comes again at line" in notes(demos)
    again = load(
        tmp_path, "t,x,y,run\n" + BODY.replace("\n", ",1\n") + "t,x,y,run\n" + BODY.replace("\n", ",2\n")
    )
    assert again.n_episodes == 2


def test_a_comment_that_names_the_columns_begins_an_episode_too(tmp_path):
    content = "# t x y\n" + BODY.replace(",", " ")
    demos = load(tmp_path, content + "# stopped\n" + content)
    assert demos.n_episodes == 2
    assert "comes again at line 43" in notes(demos)


def test_names_with_line_breaks(tmp_path):
    demos = load(tmp_path, '"t\n(s)","x\n(mm)","y\n(mm)"\n' + BODY, state=["x (mm)", "y (mm)"], time="t (s)")
    np.testing.assert_allclose(demos.states, X, atol=1e-4)
    lines = BODY.splitlines()
    lines[7] = lines[7].replace("0.140", "lost")
    with pytest.raises(DataError, match="holds 'lost' at line 12"):
        load(tmp_path, '"t\n(s)","x\n(mm)","y\n(mm)"\n' + "\n".join(lines) + "\n", state=[1], time=0)


@pytest.mark.parametrize(
    "above", ["Sample Rate: 50 Hz", "// Update Rate: 50.0Hz", "FREQUENCY\t50", '"Sampling frequency (Hz)";50']
)
def test_the_rate_of_a_header_makes_the_time(tmp_path, above):
    body = "".join(f"{x:.4f};{y:.4f}\n" for x, y in X)
    demos = load(tmp_path, f"{above}\n\nx;y\n{body}", time=None)
    np.testing.assert_allclose(demos.time, TIME, atol=1e-9)
    assert "made of the rate of the header, 50 Hz; rate= overrules this" in notes(demos)
    assert load(tmp_path, f"{above}\n\nx;y\n{body}", time=None, rate=10).time[-1] == pytest.approx(3.9)


@pytest.mark.parametrize(
    ("names", "ticks"), [("sec,nsec", 1e9), ("ZeitInSec,ZeitInNanoSec", 1e9), ("secs,usecs", 1e6), ("", 1e9)]
)
def test_seconds_and_the_rest_in_two_columns(tmp_path, names, ticks):
    stamps = [(1_700_000_000 + int(t + 0.5), round((t + 0.5) % 1 * ticks)) for t in TIME]
    header = f"{names},x,y\n" if names else ""
    body = "".join(f"{a},{b},{x:.4f},{y:.4f}\n" for (a, b), (x, y) in zip(stamps, X, strict=True))
    demos = load(tmp_path, header + body, state=[2, 3], time="time")
    np.testing.assert_allclose(demos.time, TIME, atol=1e-6)
    assert "time is made of" in notes(demos)


@pytest.mark.parametrize("mark", [",", " ", ";"])
def test_row_names_as_r_writes_them(tmp_path, mark):
    body = "".join(f'"{i}"{mark}{row.replace(",", mark)}\n' for i, row in enumerate(ROWS, start=1))
    demos = load(tmp_path, mark.join(['"t"', '"x"', '"y"']) + "\n" + body)
    np.testing.assert_allclose(demos.states, X, atol=1e-4)


def test_bars_between_cells(tmp_path):
    np.testing.assert_allclose(load(tmp_path, ("t,x,y\n" + BODY).replace(",", "|")).states, X, atol=1e-4)


def test_decimal_commas_between_commas_are_told(tmp_path):
    with pytest.raises(DataError, match="commas may be decimal marks there as well as separate cells"):
        load(tmp_path, "t,x,y\n" + BODY.replace(".", ","))


def test_letters_of_windows(tmp_path):
    demos = load(tmp_path, ("t,x,y\n" + BODY).replace("x,y", "x,Größe – y").encode("cp1252"), state=["x"])
    assert "Windows-1252" in notes(demos)


@pytest.mark.parametrize(("unit", "stamps"), [("ms", TIME * 1e3 / 40), ("s", TIME * 250)])
def test_the_unit_of_a_header_is_that_of_the_time(tmp_path, unit, stamps):
    body = "".join(f"{t:.4f},{x:.4f},{y:.4f}\n" for t, (x, y) in zip(stamps, X, strict=True))
    last = stamps[-1] / (1000 if unit == "ms" else 1)
    for header, time in ((f"t [{unit}],x,y\n", f"t [{unit}]"), (f"t,x,y\n{unit},m,m\n", "t")):
        assert load(tmp_path, header + body, time=time, window=30.0 if unit == "s" else 0.005).time[
            -1
        ] == pytest.approx(last)
    assert load(tmp_path, header + body, time_unit="us", window=1e-6).time[-1] == pytest.approx(
        stamps[-1] / 1e6
    )


@pytest.mark.parametrize("write", [str, lambda row: str(row).replace(",", "")])
def test_lists_in_cells(tmp_path, write):
    body = "".join(f'{t:.3f},"{write(row)}"\n' for t, row in zip(TIME, X.tolist(), strict=True))
    demos = load(tmp_path, "t,pos\n" + body, state="pos")
    np.testing.assert_array_equal(demos.states, X)
    assert demos.state_names == ("pos[0]", "pos[1]")
    for odd, sentence in (
        ('"[1, a]"', "something else than numbers, first at line 27"),
        ('"[1, 2, 3]"', "differ in length, first at line 27"),
    ):
        lines = body.splitlines()
        lines[25] = f"0.5,{odd}"
        with pytest.raises(DataError, match=sentence):
            load(tmp_path, "t,pos\n" + "\n".join(lines * 2) + "\n", state="pos")


def test_a_rate_that_the_time_does_not_have_is_told(tmp_path):
    body = "".join(f"{100 * i};{x:.4f};{y:.4f}\n" for i, (x, y) in enumerate(X))
    demos = load(tmp_path, f"// Update Rate: 100.0Hz\nSampleTimeFine;x;y\n{body}", time="SampleTimeFine")
    assert "if it is the time, give rate=10000" in notes(demos)
    demos = load(
        tmp_path, f"// Update Rate: 100.0Hz\nSampleTimeFine;x;y\n{body}", time="SampleTimeFine", rate=10000
    )
    np.testing.assert_allclose(demos.time, np.arange(N) / 100)
