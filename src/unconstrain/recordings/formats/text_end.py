"""The end of a long text, by which it is told what of it is no sample, without reading what lies before."""

import re
from dataclasses import dataclass
from typing import Any

from unconstrain.recordings.formats.text_lines import COMMENTS, Layout
from unconstrain.recordings.formats.text_rows import LONGEST_FOOTER, PROBED, leave_out_end

Entry = tuple[int, bytes]

PIECE = 1 << 20
"""Bytes read at a time."""

LINES = 2 * (LONGEST_FOOTER + PROBED)
"""Lines by which an end is judged, at least."""

LINE_END = re.compile(rb"\r\n|\r|\n")


@dataclass(frozen=True)
class Body:
    """Where in a file the samples are.

    Parameters
    ----------
    start, stop : int
        Bytes.
    first : list of bytes
        The first lines.
    notes : tuple of str
        What was left out behind them.
    """

    start: int
    stop: int
    first: list[bytes]
    notes: tuple[str, ...]


def find_body(opened: Any, head: bytes, bom: int, layout: Layout) -> Body | None:
    """Find where the samples of a text begin and end, by its first lines and its last ones alone.

    Parameters
    ----------
    opened : pyarrow.NativeFile
        Larger than `head`.
    head : bytes
        Its first lines, whole.
    bom : int
        How long the byte-order mark before them is.
    layout : Layout

    Returns
    -------
    Body or None
        None where these lines do not tell.
    """
    start, number = _after(head, bom, layout.skipped), layout.skipped
    if start is None:
        return None
    first = _entries(LINE_END.split(head[start:]), number)[:PROBED]
    if len(first) < PROBED:
        return None
    size = opened.size()
    at = max(start, size - max(len(head), LINES * max(len(line) for _, line in first)))
    tail = opened.read_at(size - at, at)
    if at > start:  # a line that begins before
        at, tail = at + tail.find(b"\n") + 1, tail[tail.find(b"\n") + 1 :]
    lines = tail.split(b"\n")
    last = _entries([line.removesuffix(b"\r") for line in lines], 0)
    if b"\0" in tail or len(last) < LINES:
        return None
    entries = [*first, *last]
    leave_out_end(tail, entries, layout, [])
    left = len(first) + len(last) - len(entries)
    if not left:  # comments may stand behind the samples
        stop = min(at + sum(len(line) + 1 for line in lines[: last[-1][0]]), size)
        return Body(start, stop, [line for _, line in first], ())
    if b"\r" in tail.replace(b"\r\n", b"\n"):
        return None
    before = layout.skipped + _count_lines(opened, start, at)
    entries = [*first, *((before + number, line) for number, line in last)]
    notes: list[str] = []
    leave_out_end(tail, entries, layout, notes)
    kept = entries[-1][0] - before
    stop = at + sum(len(line) + 1 for line in lines[:kept])
    return Body(start, stop, [line for _, line in first], tuple(notes))


def _after(head: bytes, bom: int, skipped: int) -> int | None:
    """Return where the line begins before which so many lie."""
    if not skipped:
        return bom
    for number, end in enumerate(LINE_END.finditer(head), start=1):
        if number == skipped:
            return end.end()
    return None


def _entries(lines: list[bytes], before: int) -> list[Entry]:
    """Return the lines that say something, with their numbers."""
    return [
        (number, line)
        for number, line in enumerate(lines, start=before + 1)
        if line.strip(b" ") and not line.lstrip().startswith(COMMENTS)
    ]


def _count_lines(opened: Any, start: int, stop: int) -> int:
    return sum(opened.read_at(min(PIECE, stop - at), at).count(b"\n") for at in range(start, stop, PIECE))
