"""What a reader found in a recording, or did to it, that its user should know."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

KINDS = (
    "saved", "guess", "time", "burst", "rotation", "turn", "frame", "actions", "smoothing", "empty", "repeated",
    "angle", "gap", "speed", "short", "jump", "pause", "missing", "slow", "stuck", "relative", "order", "phase", "read",
)  # fmt: skip
"""In the order in which notes on one file are given; a new finding adds a line of its own here."""

MOST_ALIKE = 3
"""Files in which the same was found, and which are named one by one."""


@dataclass(frozen=True)
class Note:
    """One finding in one file.

    Pieces of a file that are read one by one leave a note each; their counts add up to the note of the whole file.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    file : str
        The file, without the folders of this computer; empty for a note on all recordings together.
    text : str
        The sentence, with ``{}`` where each count belongs.
    counts : tuple of int
        What was counted. A note whose first count is zero is no finding, and is left out.
    things : tuple of str
        What each count counts, in the singular; empty for a bare number.

    Examples
    --------
    >>> note = Note("gap", "wipe.csv", "split at {} longer than 1 s", (2,), ("gap",))
    >>> str(note)
    'wipe.csv: split at 2 gaps longer than 1 s'
    """

    kind: str
    file: str
    text: str
    counts: tuple[int, ...] = ()
    things: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Return the sentence."""
        counted = [count(number, thing) for number, thing in zip(self.counts, self.things, strict=True)]
        first, *others = self.text.split("{}") if counted else [self.text]
        sentence = first + "".join(map("".join, zip(counted, others, strict=True)))
        return f"{self.file}: {sentence}" if self.file else sentence


def count(number: int, thing: str) -> str:
    """Say a number of things, as in "2 gaps"."""
    if not thing:
        return str(number)
    return f"{number} {thing}{'' if number == 1 else 's'}"


def combine(notes: Iterable[Note]) -> tuple[Note, ...]:
    """Add up notes on the same finding in the same file.

    Parameters
    ----------
    notes : iterable of Note
        In the order of the files; the order of those on one file does not matter.

    Returns
    -------
    tuple of Note
        One note per finding, in the order of the files and of `KINDS`; notes on all recordings come last.
    """
    files: dict[str, int] = {}
    found: dict[tuple[str, str, str], Note] = {}
    for note in notes:
        files.setdefault(note.file, len(files))
        key = (note.file, note.kind, note.text)
        before = found.get(key)
        if before is None:
            found[key] = note
        elif note.counts:
            sums = tuple(a + b for a, b in zip(before.counts, note.counts, strict=True))
            found[key] = replace(before, counts=sums)
    ordered = sorted(
        found.values(), key=lambda note: (not note.file, files[note.file], KINDS.index(note.kind))
    )
    return tuple(ordered)


def gather(notes: Iterable[Note]) -> tuple[Note, ...]:
    """Say once what was found alike in many files.

    Parameters
    ----------
    notes : iterable of Note

    Returns
    -------
    tuple of Note
        Of those that differ by nothing but the file and numbers, where there are more than `MOST_ALIKE`, the first,
        with all their counts, that says how many they are.
    """
    every = tuple(notes)
    alike: dict[tuple[str, str], list[Note]] = {}
    for note in every:
        if note.file:
            alike.setdefault(_kind_of(note), []).append(note)
    said: list[Note] = []
    for note in every:
        several = alike.get(_kind_of(note), []) if note.file else []
        if len(several) <= MOST_ALIKE:
            said.append(note)
        elif note is several[0]:
            sums = tuple(map(sum, zip(*(each.counts for each in several), strict=True)))
            more = "and" if sums else "and, with other numbers perhaps,"
            file = f"{note.file} {more} {len(several) - 1} more files"
            said.append(replace(note, file=file, counts=sums))
    return tuple(said)


def _kind_of(note: Note) -> tuple[str, str]:
    return note.kind, re.sub(r"\d+", "#", note.text)


def add_up(notes: Iterable[Note]) -> tuple[Note, ...]:
    """Combine notes, and keep those that found something."""
    return tuple(note for note in combine(notes) if not note.counts or note.counts[0])
