"""A recording read block by block."""

from collections.abc import Generator, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.constraints.recorded import from_forces_and_flags
from unconstrain.errors import DataError
from unconstrain.recordings.blocks import Block, Loaded, Motion, leave_out_slow, number_values
from unconstrain.recordings.cutting import cut_by_episodes, cut_by_rows
from unconstrain.recordings.formats.base import GUESS
from unconstrain.recordings.notes import Note
from unconstrain.recordings.pieces import Piece, read_flags, read_projections
from unconstrain.recordings.preparing.pipeline import prepare
from unconstrain.recordings.preparing.rows import Portion
from unconstrain.recordings.reading import tally
from unconstrain.recordings.recording import Recording
from unconstrain.recordings.steps import runs
from unconstrain.samples import Samples
from unconstrain.waiting import within


def read_blocks(
    recording: Recording,
    batch_rows: int | None,
    start: int = 0,
    stop: int | None = None,
    *,
    everything: bool = False,
) -> Generator[Block, None, None]:
    """Read rows `start` to `stop` of a recording in blocks.

    Parameters
    ----------
    recording : Recording
    batch_rows : int or None
        Rows in a block: at most as many, or, where blocks hold whole episodes, at least; None for all in one.
    start, stop : int
        Where blocks of an earlier pass ended.
    everything : bool
        Whether blocks hold all that demonstrations do, and not only what is learnt from.

    Yields
    ------
    Block
    """
    pieces = recording.read_pieces(recording.keys(everything), start, stop)
    whole = _whole_for(recording, everything)
    load = partial(_load, recording, everything)
    if batch_rows is None or (whole and all(file.at_once for file in recording.files)):
        every = list(_counted(recording, pieces))
        end = start + sum(len(piece.rows) for piece in every)
        if end > start:
            yield Block(start, end, partial(load, every, start, None))
    elif whole:
        yield from cut_by_episodes(
            pieces, start, batch_rows, whole, lambda piece, _: recording.labels([piece]), load
        )
    elif recording.is_along_episodes:  # a file without episodes is cut into some
        yield from cut_by_episodes(
            pieces, start, batch_rows, None, lambda piece, first: recording.groups([piece], first), load
        )
    else:
        yield from cut_by_rows(pieces, start, batch_rows, load)


def _counted(recording: Recording, pieces: Iterable[Piece]) -> Iterator[Piece]:
    """Say how many of a recording's rows were read so far."""
    done = 0
    with within("reading", unit="rows") as report:
        for piece in pieces:
            done += len(piece.rows)
            report(done, recording.n_rows)
            yield piece


def check_read(recording: Recording, motion: Motion, notes: Sequence[Note]) -> None:
    """Refuse a recording of which, after all of it was read, nothing is left, or in which nothing moves.

    Parameters
    ----------
    recording : Recording
    motion : Motion
        Of all its blocks.
    notes : sequence of Note
        Of all its blocks, added up.

    Raises
    ------
    DataError
        It has less than two samples, or all actions are zero.
    """
    if not motion.n_samples:
        raise DataError(f"{recording.shown}: {_why_empty(recording, notes)}")
    if recording.saves:
        return
    if motion.n_samples < 2:
        raise DataError(f"{recording.shown} has one sample; at least two are needed")
    if not motion.moves:
        remedy = "the states do not move" if recording.differentiates else "choose other action columns"
        raise DataError(f"all actions of {recording.shown} are zero: {remedy}")


def _why_empty(recording: Recording, notes: Sequence[Note]) -> str:
    found = {note.kind: note.counts[0] for note in notes if note.file == recording.name and note.counts}
    if "short" in found:
        return (
            f"split at {found.get('gap', 0)} gaps and {found.get('speed', 0)} fast steps, no fragment lasts "
            f"{recording.shortest:g} s; raise gap= or max_speed=, or lower window= or min_duration="
        )
    if "pause" in found:
        return "all of it is at rest, and nothing is left without pauses; leave them in"
    return (
        f"in each of its {found.get('empty', 0)} rows a state, an action or a stamp is missing; fill them in, choose "
        "other columns, or give resample= where columns are filled at different rates"
    )


def _load(
    recording: Recording, everything: bool, pieces: Sequence[Piece], start: int, before: Piece | None
) -> Loaded:
    prepares = everything or recording.whole_episodes_for is not None
    if prepares:
        loaded = prepare(Portion(recording, pieces, start, everything))
    else:
        loaded = Loaded(_take(recording, pieces, start))
    notes = _guesses(recording, pieces)
    if not prepares and recording.roles.time is not None:
        notes += recording.clock.note(recording.name)
    loaded = replace(loaded, notes=(*notes, *loaded.notes))
    least = recording.preparation.min_speed
    if least is not None:
        loaded = leave_out_slow(loaded, least)
    elif everything:
        loaded = replace(loaded, motion=Motion.of(loaded.samples.actions))
    return replace(loaded, notes=(*loaded.notes, _tally(recording, loaded, pieces, start, before)))


def _take(recording: Recording, pieces: Sequence[Piece], start: int) -> Samples:
    """Return samples that do not depend on their neighbours, as they lie in the files."""
    X, U = recording.read_plain(pieces)
    assert U is not None
    roles = recording.roles
    N = None
    if recording.reads_projections:
        N = read_projections(pieces, roles.projections, roles.n_actions)
    elif recording.makes_projections:
        assert roles.free is not None
        N = from_forces_and_flags(None, read_flags(pieces, roles.free), U, np.zeros(len(U), np.int64))
    return Samples(X, U, recording.groups(pieces, start), N)


def _guesses(recording: Recording, pieces: Sequence[Piece]) -> tuple[Note, ...]:
    """Note what the format guessed of these rows."""
    guesses: dict[bytes, None] = {}
    for piece in pieces:
        said = (piece.rows.schema.metadata or {}).get(GUESS, b"")
        guesses |= dict.fromkeys(guess for guess in said.split(b"\n") if guess)
    return tuple(Note("guess", recording.name, guess.decode()) for guess in guesses)


def _tally(
    recording: Recording, loaded: Loaded, pieces: Sequence[Piece], start: int, before: Piece | None
) -> Note:
    """Count samples and episodes of a block."""
    groups, time, name = loaded.samples.groups, loaded.time, recording.name
    assert groups is not None
    if _whole_for(recording, bool(loaded.episodes)) is None:
        values = recording.labels(pieces)
        begins = int(np.sum(values[1:] != values[:-1])) + _begins(recording, values[:1], start, before)
        return tally(name, len(groups), begins, None)
    codes, found = number_values(groups)
    # Fragments have names; numbers are those of the blocks that one long episode is cut into.
    if recording.undivided and not loaded.episodes and np.issubdtype(groups.dtype, np.integer):
        codes, found = np.zeros_like(codes), found[:1]
    if time is None:
        return tally(name, len(groups), len(found), None)
    lasted = sum(float(time[own[-1]] - time[own[0]]) for own in runs(codes))
    return tally(name, len(groups), len(found), lasted)


def _whole_for(recording: Recording, everything: bool) -> str | None:
    """Return why blocks hold whole episodes, where they do."""
    timed = everything and recording.timed and not recording.saves
    return recording.whole_episodes_for or ("time" if timed else None)


def _begins(recording: Recording, first: NDArray[Any], start: int, before: Piece | None) -> int:
    """Return 1 if the row `start`, of this label (1,), is the first of its episode; 0 otherwise."""
    if not start:
        return 1
    if before is not None:
        return int(recording.labels([before])[0] != first[0])
    field = recording.roles.episode or recording.roles.state[0]
    read = list(recording.read_pieces([field.key], start - 1, start))
    return int(recording.labels(read)[0] != first[0])
