"""Stamps as people and their programs write them, made those of ISO 8601, which Arrow reads."""

import re

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")

CLOCK = (
    r"(?P<hour>\d{1,2}):(?P<minute>\d{1,2})(?::(?P<second>\d{1,2})(?:[.,:](?P<fraction>\d{1,9}))?)?"
    r"(?: ?(?P<half>[AaPp][Mm]))?"
)
YEAR_FIRST = (
    rf"^(?P<year>\d{{4}})[-/.](?P<month>\d{{1,2}})[-/.](?P<day>\d{{1,2}})[ T]+{CLOCK}"
    r"(?P<zone> ?(?:Z|UTC|GMT|[+-]\d{2}:?\d{2}))?$"
)
COMPACT = (
    r"^(?P<year>(?:19|20)\d{2})(?P<month>\d{2})(?P<day>\d{2})[T_ -]?(?P<hour>\d{2})(?P<minute>\d{2})(?P<second>\d{2})"
    r"[.,]?(?P<fraction>\d{0,9})$"
)
YEAR_LAST = (
    rf"^(?P<one>\d{{1,2}})(?P<mark>[-/.])(?P<two>\d{{1,2}})[-/.](?P<year>\d{{4}}|\d{{2}})[, T]+{CLOCK}$"
)
BY_NAME = rf"^(?P<day>\d{{1,2}})[- ](?P<name>[A-Za-z]{{3}})[a-z]*[- ](?P<year>\d{{4}})[, T]+{CLOCK}$"
OF_DAY = rf"^(?:(?P<days>\d+) days? \+?)?{CLOCK}$"
MINUTES = r"^(?P<minute>\d{1,2}):(?P<second>\d{1,2})\.(?P<fraction>\d{1,9})$"

DAY = 86_400
BILLION = 1_000_000_000

NO_DAY = "times of day are taken for those of one day"
MIDNIGHT = "times of day go back by half a day or more, which is taken for midnight"
IN_MINUTES = "times such as 03:05.1 are read as minutes and seconds"


def iso_times(column: pa.Array) -> tuple[pa.Array, tuple[str, ...]]:
    """Return stamps as ISO 8601 has them, where all of them are written alike; other text as it is.

    Days and months are told apart by the whole column, where one of them is above 12; else the order in which the
    stamps span less time is taken, and of two alike the month first, as with a 12-hour clock, or the day.

    Parameters
    ----------
    column : pyarrow.Array of text
        Without spaces around the stamps.

    Returns
    -------
    stamps : pyarrow.Array of text
    guesses : tuple of str
        What was guessed, as the end of a sentence on the column.
    """
    some = column.drop_null()
    if not len(some) or not (":" in some[0].as_py() or re.match(COMPACT, some[0].as_py())):
        return column, ()
    for pattern, read in (
        (YEAR_FIRST, _year_first), (COMPACT, _year_first), (YEAR_LAST, _year_last), (BY_NAME, _by_name),
        (OF_DAY, _of_day), (MINUTES, _minutes),
    ):  # fmt: skip
        if re.match(pattern, some[0].as_py()) and pc.all(pc.match_substring_regex(some, pattern)).as_py():
            parts = pc.extract_regex(some, pattern)
            nanoseconds, guesses = read(parts)
            if nanoseconds is None:
                return column, ()
            stamps = pa.array(nanoseconds, pa.int64()).cast(pa.timestamp("ns")).cast(pa.string())
            there = column.is_valid()
            places = pc.subtract(pc.cumulative_sum(there.cast(pa.int64())), 1)
            return stamps.take(pc.if_else(there, places, pa.scalar(None, pa.int64()))), guesses
    return column, ()


def _numbers(parts: pa.Array, name: str) -> np.ndarray:
    """Return a part of the stamps as integers, zero where it is left out."""
    text = parts.field(name)
    return pc.if_else(pc.equal(text, ""), "0", text).cast(pa.int64()).to_numpy()


def _clock(parts: pa.Array) -> np.ndarray:
    """Return nanoseconds since the beginning of the day."""
    names = {field.name for field in parts.type}
    hours = _numbers(parts, "hour") if "hour" in names else np.int64(0)
    if "half" in names:
        half = pc.utf8_lower(parts.field("half")).to_numpy(zero_copy_only=False)
        hours = np.where(half == "", hours, hours % 12 + np.where(half == "pm", 12, 0))
    fraction = pc.utf8_rpad(parts.field("fraction"), 9, "0").cast(pa.int64()).to_numpy()
    return ((hours * 60 + _numbers(parts, "minute")) * 60 + _numbers(parts, "second")) * BILLION + fraction


def _date(year: np.ndarray, month: np.ndarray, day: np.ndarray) -> np.ndarray | None:
    """Return nanoseconds since 1970 of dates, or None where a month or a day is none."""
    if not (np.all((month >= 1) & (month <= 12)) and np.all((day >= 1) & (day <= 31))):
        return None
    if not np.all((year >= 1970) & (year < 2200)):
        return None
    months = ((year - 1970) * 12 + month - 1).astype("datetime64[M]")
    days = months.astype("datetime64[D]").astype(np.int64) + day - 1
    return days * (DAY * BILLION)


def _year_first(parts: pa.Array) -> tuple[np.ndarray | None, tuple[str, ...]]:
    date = _date(*(_numbers(parts, name) for name in ("year", "month", "day")))
    zones = {field.name for field in parts.type} & {"zone"}
    if date is None or any(len(pc.unique(parts.field(zone))) > 1 for zone in zones):
        return None, ()
    return date + _clock(parts), ()


def _year_last(parts: pa.Array) -> tuple[np.ndarray | None, tuple[str, ...]]:
    one, two, year = (_numbers(parts, name) for name in ("one", "two", "year"))
    year = np.where(year < 100, 2000 + year, year)
    by_day, by_month = _date(year, two, one), _date(year, one, two)
    if by_day is None and by_month is None:
        return None, ()
    example = f"{parts[0]['one']}{parts[0]['mark']}{parts[0]['two']}{parts[0]['mark']}{parts[0]['year']}"
    clock = _clock(parts)
    is_unsure = False
    if by_day is not None and by_month is not None:
        spans = np.ptp(by_day), np.ptp(by_month)
        points = parts[0]["mark"].as_py() == "."
        halves = pc.any(pc.not_equal(parts.field("half"), "")).as_py()
        day_first = spans[0] < spans[1] or (spans[0] == spans[1] and not halves)
        day_first, is_unsure = (True, False) if points else (day_first, True)
    else:
        day_first = by_day is not None
    first = "day" if day_first else "month"
    guess = f"dates such as {example} are read with the {first} first"
    if is_unsure:
        guess += ", which no day above 12 tells; write them as 2024-12-31 if that is wrong"
    date = by_day if day_first else by_month
    assert date is not None
    return date + clock, (guess,)


def _by_name(parts: pa.Array) -> tuple[np.ndarray | None, tuple[str, ...]]:
    places = pc.index_in(pc.utf8_lower(parts.field("name")), pa.array(MONTHS))
    if places.null_count:
        return None, ()
    month = places.to_numpy().astype(np.int64) + 1
    date = _date(_numbers(parts, "year"), month, _numbers(parts, "day"))
    return (None, ()) if date is None else (date + _clock(parts), ())


def _of_day(parts: pa.Array) -> tuple[np.ndarray | None, tuple[str, ...]]:
    nanoseconds = _clock(parts) + _numbers(parts, "days") * (DAY * BILLION)
    if pc.any(pc.not_equal(parts.field("days"), "")).as_py():
        return nanoseconds, ()
    nights = np.diff(nanoseconds, prepend=nanoseconds[:1]) < -DAY * BILLION // 2
    guesses = (NO_DAY, MIDNIGHT) if nights.any() else (NO_DAY,)
    return nanoseconds + np.cumsum(nights) * (DAY * BILLION), guesses


def _minutes(parts: pa.Array) -> tuple[np.ndarray | None, tuple[str, ...]]:
    return _clock(parts), (IN_MINUTES,)
