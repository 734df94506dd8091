"""Numbers and stamps as programs write them."""

import datetime

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import unconstrain as uc
from unconstrain.errors import DataError

N = 40
TIME = np.arange(N) * 0.02


def load(tmp_path, cells, times=None, mark=";", **options):
    path = tmp_path / "a.csv"
    times = [f"{t:.2f}" for t in TIME] if times is None else times
    lines = [f"{t}{mark}{x}{mark}{i % 7}" for i, (t, x) in enumerate(zip(times, cells, strict=True))]
    path.write_text(mark.join("txy") + "\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return uc.load(path, **({"state": ["x", "y"], "time": "t"} | options))


@pytest.mark.parametrize(
    "word", ["NA", "N/A", "NULL", "None", "-", "---", "#N/A", "1.#QNAN", "-1.#IND", "-9999", "nan", ""]
)
def test_words_for_what_is_missing(tmp_path, word):
    cells = [word if i in (10, 11) else f"{0.01 * i:.2f}" for i in range(N)]
    demos = load(tmp_path, cells, drop="missing")
    assert len(demos) == N - 2
    assert word in ("", "nan") or f"{word} in 2 rows" in demos.notes[0].replace("'", "")
    with pytest.raises(DataError, match=r"column 'x' (is empty|holds nan) at line 12"):
        load(tmp_path, cells)


def test_a_number_is_no_sentinel_where_others_are_like_it(tmp_path):
    cells = [str(-9999 if i == 10 else -9000 - 200 * i) for i in range(N)]
    assert len(load(tmp_path, cells)) == N


def test_a_word_for_missing_among_other_words_is_a_word(tmp_path):
    demos = load(tmp_path, ["a" if i < 20 else "-" for i in range(N)], state="y", episode="x")
    assert demos.episode_labels == ("a", "-")


def test_text_in_a_column_of_numbers_is_named_and_can_be_left_out(tmp_path):
    cells = ["lost" if i == 10 else str(i) for i in range(N)]
    with pytest.raises(DataError, match="column 'x' holds 'lost' at line 12"):
        load(tmp_path, cells)
    assert len(load(tmp_path, cells, drop="missing")) == N - 1


@pytest.mark.parametrize("thousand", ["'", "’", "\u00a0", "\u202f", " "])
@pytest.mark.parametrize("point", [".", ","])
def test_marks_between_thousands(tmp_path, thousand, point):
    numbers = [990 + i + 0.5 for i in range(N)]
    cells = [f"{x:,.1f}".replace(",", "T").replace(".", point).replace("T", thousand) for x in numbers]
    demos = load(tmp_path, cells)
    assert demos.states[:, 0].tolist() == numbers
    assert any("setting off thousands" in note for note in demos.notes)


def test_exponents_of_fortran(tmp_path):
    cells = [f"{i / 7:.6E}".replace("E", "D") for i in range(N)]
    np.testing.assert_allclose(load(tmp_path, cells).states[:, 0], np.arange(N) / 7, rtol=1e-5)


def test_units_behind_numbers(tmp_path):
    demos = load(tmp_path, [f"{i}.5 mm" for i in range(N)], [f"{t:.2f} sec" for t in TIME])
    assert demos.states[0, 0] == 0.5
    assert "have the unit mm behind them" in demos.notes[0]


DAY = datetime.datetime(2026, 11, 26, 14, 3, 5, 123000)
BOTH = datetime.datetime(2024, 4, 3, 23, 59, 59, 900000)


@pytest.mark.parametrize(
    ("pattern", "start", "said"),
    [
        ("%d.%m.%Y %H:%M:%S,%f", DAY, "such as 26.11.2026 are read with the day first"),
        ("%d.%m.%Y %H:%M:%S.%f", BOTH, "such as 03.04.2024 are read with the day first"),
        ("%d/%m/%Y %H:%M:%S.%f", DAY, "such as 26/11/2026 are read with the day first"),
        ("%m/%d/%Y %H:%M:%S.%f", DAY, "such as 11/26/2026 are read with the month first"),
        ("%m/%d/%Y %I:%M:%S.%f %p", DAY, "month first"),
        ("%m/%d/%Y %H:%M:%S.%f", BOTH, "month first, which no day above 12 tells"),
        ("%d/%m/%Y %H:%M:%S.%f", BOTH, "day first, which no day above 12 tells"),
        ("%d-%b-%Y %H:%M:%S.%f", DAY, ""),
        ("%Y-%m-%d %H:%M:%S,%f", DAY, ""),
        ("%Y-%m-%dT%H:%M:%S.%fZ", DAY, ""),
        ("%Y-%m-%d %H:%M:%S.%f UTC", DAY, ""),
        ("%Y-%m-%d %H:%M:%S.%f +0100", DAY, ""),
        ("%Y%m%dT%H%M%S.%f", DAY, ""),
        ("%Y%m%d%H%M%S%f", DAY, "dates and times written without marks"),
        ("%H:%M:%S.%f", DAY, "times of day are taken for those of one day"),
        ("%H:%M:%S:%f", DAY, "times of day are taken for those of one day"),
        ("%H:%M:%S.%f", BOTH, "taken for midnight"),
        ("%M:%S.%f", DAY, "minutes and seconds"),
    ],
)
def test_dates_and_times(tmp_path, pattern, start, said):
    stamps = [(start + datetime.timedelta(seconds=t)).strftime(pattern) for t in TIME]
    demos = load(tmp_path, range(N), stamps)
    np.testing.assert_allclose(demos.time, TIME, atol=1e-9)
    assert said in " ".join(demos.notes)
    assert not said or said in " ".join(uc.inspect(tmp_path / "a.csv").notes)


@settings(deadline=None, max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    start=st.datetimes(datetime.datetime(1971, 1, 1), datetime.datetime(2099, 1, 1)),
    order=st.sampled_from(["%d/%m", "%m/%d"]),
)
def test_days_and_months_are_told_apart_over_many_days(tmp_path, start, order):
    start = start.replace(microsecond=0)
    every = [start + datetime.timedelta(days=i) for i in range(40)]
    stamps = [when.strftime(f"{order}/%Y %H:%M:%S") for when in every]
    demos = load(tmp_path, range(40), stamps, action="y", state="x", drop=None)
    np.testing.assert_allclose(np.diff(demos.time), 86_400.0)


def test_a_time_that_cannot_be_read_is_told(tmp_path):
    load(tmp_path, range(N), [f"at 10:{i}" for i in range(N)], time=None, rate=10)
    found = uc.inspect(tmp_path / "a.csv")
    assert any("t holds text such as 'at 10:0', of which no time can be made" in note for note in found.notes)
