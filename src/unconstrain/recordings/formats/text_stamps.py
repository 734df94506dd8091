"""Time that no column of a text holds as it is: at the rate that its header tells, or in two columns."""

import re
from collections.abc import Sequence
from itertools import pairwise

from unconstrain.recordings.formats.text_made import FrameTime, JoinedTime, RowTime

RATE = re.compile(
    r"(?:(?:sampl\w*|update|frame|capture|camera|video|data|acquisition|record\w*|scan|output|measur\w*)[ _-]*)?"
    r"(?:rate|frequency|freq|fps|hz)\b\s*(?:[\[(]\s*\w+\s*[\])])?[\s\"':=,;]*(\d+(?:\.\d+)?)\s*(?:hz|fps)?\W*",
    re.IGNORECASE,
)
TIMED = re.compile(
    r"time|stamp|zeit|temps|clock|date|tick|elapsed|^t$|^t[ _\[(.]|(^|[ _.])(m|u|n)?secs?", re.IGNORECASE
)
COUNTER = re.compile(r"frame|count|^index$|^samples?$", re.IGNORECASE)
STAMPED = re.compile(r"time|stamp|zeit|temps|^t$", re.IGNORECASE)
REST = re.compile(
    r"(?P<stem>.*?)(?P<small>n|nano|u|micro)(?P<unit>s|secs?|seconds?)(?P<end>\W*)", re.IGNORECASE
)
WHOLE = ("s", "sec", "secs", "second", "seconds")

DISAGREES = 0.2
"""How far steps may be from those of the rate that a header tells."""

EPOCH = range(1_000_000_000, 4_000_000_000)
"""Seconds since 1970."""


def find_rate(lines: Sequence[str]) -> float | None:
    """Return the rate (Hz) that lines above a table tell, such as ``Sample Rate: 100 Hz``."""
    for line in lines:
        found = RATE.match(line.strip(" \t\"'#%/;,"))
        if found and float(found[1]) > 0:
            return float(found[1])
    return None


def tell_time(names: Sequence[str]) -> bool:
    """Whether any name is that of the time."""
    return any(map(TIMED.search, names))


def make_time(
    names: Sequence[str], body: Sequence[Sequence[str]], above: Sequence[str]
) -> tuple[FrameTime | JoinedTime | RowTime | None, str]:
    """Make the time that no column holds as it is.

    Parameters
    ----------
    names : sequence of str
        Of the cells, "" where there are none.
    body : sequence of sequence of str
        The first samples.
    above : sequence of str
        What stands above the table.

    Returns
    -------
    made : FrameTime, JoinedTime, RowTime or None
    note : str
    """
    pair = find_pair(names)
    if pair is not None and _are_rests([row[pair[1]] for row in body if pair[1] < len(row)], pair[2]):
        seconds, rest, ticks = pair
        note = f"time is made of {names[seconds]} and {names[rest]}; time= names another column"
        return JoinedTime(seconds, rest, ticks), note
    if not any(names):
        if _begins_with_stamps(body):
            return JoinedTime(0, 1), "time is made of the first two columns; time= names another column"
        if body and len(body[0]) > 1 and _increases([row[0] for row in body]):
            return None, ""
    rate = find_rate(above)
    if rate is None:
        return None, ""
    if tell_time(names):
        return None, _note_disagreement(names, body, rate)
    frame = _find_counter(names, body)
    if frame is not None:
        note = f"time is made of {names[frame]} and the rate of the header, {rate:g} Hz; rate= overrules this"
        return FrameTime(frame, None, rate), note
    note = f"no column tells the time, so it is made of the rate of the header, {rate:g} Hz; rate= overrules this"
    return RowTime(rate), note


def _note_disagreement(names: Sequence[str], body: Sequence[Sequence[str]], rate: float) -> str:
    """Say that the steps of the time are not those of the rate of the header in any unit; "" where they are."""
    for i, name in enumerate(names):
        own = [row[i] for row in body if i < len(row)]
        if not (STAMPED.search(name) and _increases(own)):
            continue
        numbers = [float(cell.replace(",", ".")) for cell in own]
        ticks = (numbers[-1] - numbers[0]) / (len(numbers) - 1) * rate
        if ticks == rate or any(abs(ticks / unit - 1) < DISAGREES for unit in (1.0, 1e3, 1e6, 1e9)):
            return ""  # frames, or a unit of time
        return (
            f"the header says {rate:g} Hz, of which the steps of {name} tell nothing in s, ms, us or ns: if it is the "
            f"time, give rate={ticks:g}"
        )
    return ""


def _find_counter(names: Sequence[str], body: Sequence[Sequence[str]]) -> int | None:
    """Return the column that counts frames, if there is one."""
    for i, name in enumerate(names):
        own = [row[i].strip() for row in body if i < len(row)]
        if COUNTER.search(name) and all(cell.isdecimal() for cell in own) and _increases(own):
            return i
    return None


def find_pair(names: Sequence[str]) -> tuple[int, int, int] | None:
    """Find two columns of which one holds seconds, and the other what is left of a second.

    Parameters
    ----------
    names : sequence of str

    Returns
    -------
    (int, int, int) or None
        Which columns they are, and how many ticks of the second make a second.
    """
    places = {name.strip().lower(): i for i, name in enumerate(names)}
    for i, name in enumerate(names):
        found = REST.fullmatch(name.strip())
        if found is None:
            continue
        stem, end = found["stem"].lower(), found["end"].lower()
        for unit in (found["unit"].lower(), *WHOLE):
            if not stem and unit == "s":
                continue  # letters such as these name other things
            whole = places.get(f"{stem}{unit}{end}")
            if whole is not None:
                return whole, i, 10**9 if found["small"].lower().startswith("n") else 10**6
    return None


def _are_rests(cells: Sequence[str], ticks: int) -> bool:
    """Whether cells hold whole numbers that are less than a second."""
    return all(cell.strip().isdecimal() and int(cell) < ticks for cell in cells)


def _begins_with_stamps(body: Sequence[Sequence[str]]) -> bool:
    """Whether lines begin with seconds since 1970 and with nanoseconds, as `ros2 topic echo --csv` writes."""
    both = [(row[0].strip(), row[1].strip()) for row in body if len(row) > 2]
    if len(both) < 2 or not all(a.isdecimal() and b.isdecimal() for a, b in both):
        return False
    stamps = [(int(a), int(b)) for a, b in both]
    return (
        all(seconds in EPOCH and rest < 10**9 for seconds, rest in stamps)
        and max(rest for _, rest in stamps) > 10**6
        and stamps == sorted(stamps)
    )


def _increases(cells: Sequence[str]) -> bool:
    try:
        numbers = [float(cell.replace(",", ".")) for cell in cells]
    except ValueError:
        return False
    return len(numbers) > 1 and all(b > a for a, b in pairwise(numbers))
