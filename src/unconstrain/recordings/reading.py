"""What was read, in one sentence: the last note of every reading."""

from collections.abc import Iterable, Sequence

from unconstrain.recordings.notes import Note, combine, count

KIND = "read"
BEGINS = "read: "
"""How the sentence begins."""


def tally(file: str, samples: int, episodes: int, seconds: float | None) -> Note:
    """Count what a block holds; the notes of all blocks add up to one for each file.

    Parameters
    ----------
    file : str
        As notes call it.
    samples, episodes : int
    seconds : float or None
        How long the episodes last together; None where it was not read.

    Returns
    -------
    Note
        For `summarize` only, and not for users.
    """
    if seconds is None:
        return Note(KIND, file, "{}{}", (samples, episodes), ("sample", "episode"))
    return Note(KIND, file, "{}{}{}", (samples, episodes, round(seconds * 1e6)), ("sample", "episode", ""))


def summarize(
    notes: Iterable[Note], n_files: int, rates: Sequence[float], units: Sequence[str]
) -> tuple[Note, ...]:
    """Replace the counts of `tally` by one sentence.

    Parameters
    ----------
    notes : iterable of Note
    n_files : int
        How many files were read; 0 where it was none.
    rates : sequence of float
        Samples a second, of each recording whose time is known.
    units : sequence of str
        How the time of each was read, as in "in ms".

    Returns
    -------
    tuple of Note
        The other notes, and last the sentence.
    """
    every = list(notes)
    others = without_tallies(every)
    tallies = combine(note for note in every if note.kind == KIND)
    if not tallies:
        return others
    samples, episodes = (sum(note.counts[i] for note in tallies) for i in (0, 1))
    said = [count(samples, "sample"), count(episodes, "episode")]
    if n_files:
        said.append(count(n_files, "file"))
    if rates:
        low, high = f"{min(rates):.4g}", f"{max(rates):.4g}"
        said.append(f"{low} Hz" if low == high else f"{low} to {high} Hz")
        if all(len(note.counts) > 2 for note in tallies):
            said.append(f"{sum(note.counts[2] for note in tallies) / 1e6:.4g} s")
        else:
            said.append(f"about {samples / (sum(rates) / len(rates)):.3g} s")
    else:
        said.append("without time")
    if units:
        said.append(f"time {' and '.join(dict.fromkeys(units))}")
    return (*others, Note(KIND, "", f"{BEGINS}{', '.join(said)}"))


def without_tallies(notes: Iterable[Note]) -> tuple[Note, ...]:
    """Return the notes that are for users."""
    return tuple(note for note in notes if note.kind != KIND)
