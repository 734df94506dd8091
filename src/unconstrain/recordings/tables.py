"""Recordings that lie in files, one after the other, as one source of samples."""

import math
from collections.abc import Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.recordings.blocks import Array, Block, Loaded, Motion
from unconstrain.recordings.loading import check_read, read_blocks
from unconstrain.recordings.notes import Note, combine, gather
from unconstrain.recordings.pieces import Piece
from unconstrain.recordings.reading import BEGINS, KIND, summarize, without_tallies
from unconstrain.recordings.recording import Recording
from unconstrain.recordings.roles import is_named
from unconstrain.recordings.smoothing import describe_smoothing
from unconstrain.spaces import Space
from unconstrain.waiting import each

HEAD_ROWS = 2

SAMPLED_ROWS = 2**16
"""Rows of a block from which a sample is drawn."""

SAMPLED_GROUPS = 16
"""Row groups, at least, that a sample is drawn from: neighbouring rows resemble each other."""

SAMPLED_IN_GROUP = 2**17
"""Rows of each of them, the first, where there are as many: what lies behind them would have to be decoded too."""

OPTIONAL = ("time", "policy", "projections", "forces", "free")
"""What demonstrations may have, in the order in which notes speak of them."""


@dataclass(frozen=True)
class Tables:
    """Several recordings, as one source. It can be sent to another process.

    Parameters
    ----------
    recordings : tuple of Recording
    guesses : tuple of Note
        What was guessed of all of them.
    """

    recordings: tuple[Recording, ...]
    guesses: tuple[Note, ...] = ()

    @cached_property
    def n_rows(self) -> int:
        """The number of rows."""
        return sum(recording.n_rows for recording in self.recordings)

    @property
    def row_groups(self) -> tuple[int, ...]:
        """The numbers of rows that are read together."""
        return tuple(size for _, _, size, _ in self._groups())

    @property
    def repeatable(self) -> bool:
        """Whether it can be read more than once."""
        return True

    @property
    def space(self) -> Space:
        """What states are."""
        return self.recordings[0].space

    @property
    def scalar_actions(self) -> bool:
        """Whether the actions were of shape (N,)."""
        return False

    @property
    def knows_projections(self) -> bool:
        """Whether samples come with projections."""
        return any([recording.knows_projections for recording in self.recordings])  # noqa: C419 - each may raise

    @property
    def noise(self) -> float | None:
        """Standard deviation of the actions' noise, where it is known of all recordings; root mean square."""
        known = [each.noise for each in self.recordings if each.noise is not None]
        return (
            math.sqrt(sum(noise**2 for noise in known) / len(known))
            if len(known) == len(self.recordings)
            else None
        )

    @property
    def whole_episodes_for(self) -> str | None:
        """What is done to a sample with its neighbours, so that blocks hold whole episodes."""
        return next((each.whole_episodes_for for each in self.recordings if each.whole_episodes_for), None)

    @property
    def relabels(self) -> bool:
        """Whether it is known only after preparation which episodes there are."""
        return any(
            each.splits or each.preparation.min_speed is not None or each.preparation.drop is not None
            for each in self.recordings
        )

    def head(self) -> tuple[NDArray[Any], NDArray[Any] | None]:
        """Read a few states (N, n) and actions (N, d); None for actions that are yet to be differentiated."""
        first = self.recordings[0]
        if first.changes_states:
            samples = next(read_blocks(first, SAMPLED_ROWS)).load().samples
            return samples.states[:HEAD_ROWS], samples.actions[:HEAD_ROWS]
        pieces = first.read_pieces(first.plain_keys())
        piece = next(piece for piece in pieces if len(piece.rows))
        X, U = first.read_plain([piece.slice(0, HEAD_ROWS) if first.preparation.drop is None else piece])
        return X[:HEAD_ROWS], None if U is None else U[:HEAD_ROWS]

    def sample(self, n_rows: int, random_state: int | None) -> tuple[NDArray[Any], NDArray[Any] | None]:
        """Read random rows, in order; all where there are no more. Of many row groups the beginnings of some are read.

        Where the states of samples are others than lie in the files, they are prepared, and all of them are read.
        """
        if any(each.changes_states for each in self.recordings):
            return self._sample_prepared(n_rows, random_state)
        if self.n_rows <= n_rows:
            return _joined([(each, list(each.read_pieces(each.plain_keys()))) for each in self.recordings])
        rng = np.random.default_rng(random_state)
        groups = self._beginnings(n_rows)
        chosen: list[int] = []
        available = 0
        for i in rng.permutation(len(groups)):
            if available >= n_rows and len(chosen) >= SAMPLED_GROUPS:
                break
            chosen.append(int(i))
            available += groups[i][2]
        picked = np.sort(rng.choice(available, n_rows, replace=False, shuffle=False))
        sampled: dict[int, list[Piece]] = {}
        at = 0
        for i in sorted(chosen):
            recording, number, size, first = groups[i]
            for piece in recording.read_pieces(recording.plain_keys(), first, first + size):
                low, high = np.searchsorted(picked, [at, at + len(piece.rows)])
                if high > low:
                    sampled.setdefault(number, []).append(piece.take(picked[low:high] - at))
                at += len(piece.rows)
        return _joined([(self.recordings[number], pieces) for number, pieces in sampled.items()])

    def _sample_prepared(self, n_rows: int, random_state: int | None) -> tuple[Array, Array]:
        rng = np.random.default_rng(random_state)
        share = min(n_rows / max(self.n_rows, 1), 1.0)
        X, U = [], []
        for block in self.blocks(n_rows):
            samples = block.load().samples
            count = len(samples.states)
            picked = np.sort(rng.choice(count, min(math.ceil(share * count), count), replace=False))
            X.append(samples.states[picked])
            U.append(samples.actions[picked])
        states, actions = np.concatenate(X), np.concatenate(U)
        if len(states) <= n_rows:
            return states, actions
        picked = np.sort(rng.choice(len(states), n_rows, replace=False))
        return states[picked], actions[picked]

    def blocks(
        self, batch_rows: int, start: int = 0, stop: int | None = None
    ) -> Generator[Block, None, None]:
        """Read light blocks from row `start`, where an earlier block ended, to row `stop`."""
        first = 0  # row of the recording at hand
        for recording in self.recordings:
            if stop is not None and first >= stop:
                break
            own = 0 if not start else max(start - first, 0)
            end = None if stop is None else stop - first
            if own and own >= recording.n_rows:
                first += recording.n_rows
                continue
            reached = own
            for block in read_blocks(recording, batch_rows, own, end):
                yield replace(block, start=first + block.start, stop=first + block.stop)
                reached = block.stop
            first += reached

    def labels(self, start: int, stop: int, *, whole: bool = False) -> Iterator[tuple[NDArray[Any], int]]:
        """Read the labels of rows alone, some at a time, each with the row where they begin.

        Nothing but the episode column is read. Labels of different recordings are never the same.
        """
        first = 0
        for recording in self.recordings:
            low, high = max(start - first, 0), min(stop - first, recording.n_rows)
            field = recording.roles.episode or recording.roles.state[0]
            at = low
            if low < high:
                for piece in recording.read_pieces([field.key], low, high):
                    values = recording.labels([piece]) if whole else recording.groups([piece], at)
                    if whole and not recording.alone:
                        values = np.char.add(f"{recording.number}:", values.astype(np.str_))
                    yield values, first + at
                    at += len(piece.rows)
            first += recording.n_rows

    def read_all(self, batch_rows: int | None) -> Iterator[Loaded]:
        """Read everything there is, as `Recordings.blocks` gives it, or with None a whole recording at a time.

        After each recording it is checked that something of it is left, and moves.
        """
        for recording in each(self.recordings, "reading", unit="recordings"):
            total = Motion()
            notes: tuple[Note, ...] = ()
            for block in read_blocks(recording, batch_rows, everything=True):
                loaded = block.load()
                assert loaded.motion is not None
                total += loaded.motion
                notes = combine((*notes, *loaded.notes))
                yield loaded
            check_read(recording, total, notes)

    def check_alike(self) -> None:
        """Refuse recordings whose columns differ: positions may mean other columns in another file.

        Raises
        ------
        DataError
            The numbers of columns differ, or their names, where both files have some.
        """
        for what in ("state", "action"):
            every = [(getattr(each.roles, f"{what}_names"), each) for each in self.recordings]
            first, one = every[0]
            for names, other in every[1:]:
                if len(names) != len(first):
                    raise DataError(
                        f"{one.shown} has {len(first)} {what} columns but {other.shown} has {len(names)}"
                    )
            named = [(names, each) for names, each in every if is_named(names)]
            for names, other in named[1:]:
                first, one = named[0]
                if names != first:
                    raise DataError(
                        f"the {what} columns are {', '.join(first)} in {one.shown} but {', '.join(names)} in "
                        f"{other.shown}; choose them by name, or load the files one by one and concatenate"
                    )
        forces = {len(each.roles.force) for each in self.recordings if each.roles.force}
        if len(forces) > 1:
            raise DataError(
                f"the forces have {' and '.join(map(str, sorted(forces)))} columns in different files"
            )

    @property
    def shared(self) -> frozenset[str]:
        """What of `OPTIONAL` all recordings have."""
        return frozenset.intersection(*(_present(each) for each in self.recordings))

    @property
    def as_saved(self) -> bool:
        """Whether all are demonstrations that are given back as they were saved, with what was noted of them then."""
        return all(each.saves and each.whole_episodes_for is None for each in self.recordings)

    def summarize(self, notes: Iterable[Note]) -> tuple[Note, ...]:
        """Replace the counts of samples and episodes among notes by one sentence on all that was read."""
        notes = tuple(notes)
        if self.as_saved:
            return without_tallies(notes)
        timed = [each for each in self.recordings if each.timed]
        if not any(note.kind == KIND and len(note.counts) > 2 for note in notes):
            timed = timed[:1]  # others were not looked at
        resampled = timed[0].preparation.resample if timed else None
        rates = [resampled] if resampled else [1.0 / each.step for each in timed if each.step]
        stamped = [each for each in timed if each.roles.time is not None and not each.saves]
        units = ["by row / rate" if not stamped else f"in {each.clock.unit}" for each in stamped or timed[:1]]
        if timed and timed[0].saves:
            units = ["in s"]
        files = sum(file.file.filesystem is not None for each in self.recordings for file in each.files)
        return summarize(gather(notes), files, rates, units)

    def notes(self) -> tuple[Note, ...]:
        """Return the notes that need no sample to be read: what files said, and what some of them do not have."""
        declared = [each.declared for each in self.recordings if each.declared is not None]
        said = dict.fromkeys(note for each in declared for note in each.notes)
        notes = [Note("saved", "", note) for note in said if self.as_saved or not note.startswith(BEGINS)]
        notes += [*self.guesses, *self.recordings[0].kind.note()]
        notes += self._smoothing()
        for what in OPTIONAL:
            missing = sum(what not in _present(each) for each in self.recordings)
            if 0 < missing < len(self.recordings):
                text = f"left out {what}, which {missing} of {len(self.recordings)} recordings do not have"
                notes.append(Note("missing", "", text))
        return tuple(notes)

    def _smoothing(self) -> tuple[Note, ...]:
        """Note over how long states are smoothed, and how sure velocities are then."""
        smoothing = [each for each in self.recordings if each.smooths]
        if not smoothing:
            return ()
        given = smoothing[0].preparation.window
        return describe_smoothing(smoothing[0].smoothing, given)

    def without_projections(self) -> "Tables":
        """Return the same source, without the projections that files hold."""
        every = [replace(each, roles=replace(each.roles, projections=())) for each in self.recordings]
        return Tables(tuple(every), self.guesses)

    def along_episodes(self) -> "Tables":
        """Return the same source, in whose blocks no samples of an episode that follow each other are torn apart."""
        every = [replace(each, is_along_episodes=True) for each in self.recordings]
        return Tables(tuple(every), self.guesses)

    @property
    def is_along_episodes(self) -> bool:
        """Whether blocks end where episodes do."""
        return any(each.is_along_episodes for each in self.recordings)

    def in_one_thread(self) -> "Tables":
        """Return the same source, of which no file is decoded by several threads."""
        every = [
            replace(each, files=tuple(file.in_one_thread() for file in each.files))
            for each in self.recordings
        ]
        return Tables(tuple(every), self.guesses)

    def identity(self) -> str:
        """Say what tells this source from another: the files, what is read of them, and how they are prepared."""
        about = [
            ([file.identity() for file in each.files], each.roles, each.preparation, each.alone, each.space)
            for each in self.recordings
        ]
        return repr(about)

    def _groups(self) -> Iterator[tuple[Recording, int, int, int]]:
        """Yield the row groups: recording, its number, rows, and the first row's number in the recording."""
        for number, recording in enumerate(self.recordings):
            first = 0
            for file in recording.files:
                for size in file.row_groups:
                    yield recording, number, size, first
                    first += size

    def _beginnings(self, n_rows: int) -> list[tuple[Recording, int, int, int]]:
        """List row groups to draw so many rows from, of large ones their beginnings where these are enough."""
        every = list(self._groups())
        if len(every) < SAMPLED_GROUPS or any(
            file.at_once for each in self.recordings for file in each.files
        ):
            return every
        cut = [(each, number, min(size, SAMPLED_IN_GROUP), first) for each, number, size, first in every]
        return cut if sum(size for _, _, size, _ in cut) >= n_rows else every


def _joined(
    parts: Sequence[tuple[Recording, Sequence[Piece]]],
) -> tuple[NDArray[Any], NDArray[Any] | None]:
    read = [recording.read_plain(pieces) for recording, pieces in parts if pieces]
    X = [states for states, _ in read]
    U = [actions for _, actions in read if actions is not None]
    states = X[0] if len(X) == 1 else np.concatenate(X)
    if len(U) < len(X):
        return states, None
    return states, U[0] if len(U) == 1 else np.concatenate(U)


def _present(recording: Recording) -> frozenset[str]:
    roles = recording.roles
    there = {
        "time": recording.timed,
        "policy": bool(roles.policy),
        "projections": bool(roles.projections) or recording.makes_projections,
        "forces": bool(roles.force),
        "free": roles.free is not None,
    }
    return frozenset(what for what, is_there in there.items() if is_there)
