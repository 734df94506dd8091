"""One recording: files whose episodes mean the same, with their columns in their roles, read block by block."""

import math
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from unconstrain.constraints.recorded import from_forces_and_flags
from unconstrain.errors import DataError
from unconstrain.recordings.blocks import (
    Array,
    Block,
    Episode,
    Loaded,
    Motion,
    leave_out_slow,
    number_values,
)
from unconstrain.recordings.columns import Columns
from unconstrain.recordings.derivative import differentiate, spans_window
from unconstrain.recordings.files import label as label_files
from unconstrain.recordings.formats.base import GUESS, ColumnKey, Declared, Format
from unconstrain.recordings.gaps import GAP_STEPS, SUSPICIOUS, Fragments, split
from unconstrain.recordings.notes import Note
from unconstrain.recordings.pieces import (
    Piece,
    places,
    read_flags,
    read_labels,
    read_numbers,
    read_projections,
)
from unconstrain.recordings.preparation import Preparation
from unconstrain.recordings.roles import Roles
from unconstrain.recordings.table import Field
from unconstrain.recordings.time import Clock
from unconstrain.samples import Samples

Codes = NDArray[np.int64]

BLOCKS = 5
"""Into how many contiguous blocks a single file without episodes is cut, which streams take for episodes."""

CLOCKED = 10_000
"""Rows, at most, by which it is decided how stamps are read."""


class _Episodes(NamedTuple):
    """The episodes of a block: a number from 0 for each sample (N,), and the value and label of each number."""

    codes: Codes
    values: list[Any]
    labels: list[str]


@dataclass(frozen=True)
class Recording:
    """Files that are read one after the other. It can be sent to another process.

    Parameters
    ----------
    shown : str
        What the user calls it.
    name : str
        What notes call it.
    label : str
        What its episodes are called after.
    number : int
        Which of the recordings it is.
    alone : bool
        Whether it is the only one.
    files : tuple of Format
    roles : Roles
    columns : Columns
        As the user gives them.
    preparation : Preparation
    declared : Declared or None
        What the files say of themselves.
    is_along_episodes : bool
        Whether blocks end where episodes do even if samples are taken by themselves.
    """

    shown: str
    name: str
    label: str
    number: int
    alone: bool
    files: tuple[Format, ...]
    roles: Roles
    columns: Columns
    preparation: Preparation
    declared: Declared | None = None
    is_along_episodes: bool = False

    @cached_property
    def n_rows(self) -> int:
        """The number of rows in all files; text is read to count them."""
        return sum(sum(file.row_groups) for file in self.files)

    @property
    def differentiates(self) -> bool:
        """Whether the actions are the derivative of the states."""
        return not self.roles.action

    @property
    def splits(self) -> bool:
        """Whether episodes may be split."""
        return self.differentiates or not (self.preparation.gap is self.preparation.max_speed is None)

    @property
    def reads_projections(self) -> bool:
        """Whether files hold the projections."""
        return bool(self.roles.projections) and not self.makes_projections

    @property
    def makes_projections(self) -> bool:
        """Whether projections are made of forces or flags."""
        chosen, threshold = self.columns, self.preparation.force_threshold
        if chosen.projections is not None:
            return False
        if self.roles.force and (chosen.force is not None or threshold is not None):
            return threshold is not None
        return chosen.free is not None

    @property
    def knows_projections(self) -> bool:
        """Whether it is read for what is known of constraints. Raises `DataError` for forces without a threshold."""
        if self.columns.force is not None and self.preparation.force_threshold is None:
            raise DataError(
                "give force_threshold=, above which a force is a contact, in the unit of the forces"
            )
        return self.columns.projections is not None or self.makes_projections

    @property
    def whole_episodes_for(self) -> str | None:
        """What is done with a sample that takes its neighbours, where anything is."""
        if self.splits:
            return "differentiate" if self.differentiates else "split"
        return "filter the forces of" if self.makes_projections and self.roles.force else None

    def read_pieces(
        self, keys: Sequence[ColumnKey], start: int = 0, stop: int | None = None
    ) -> Iterator[Piece]:
        """Read rows `start` to `stop` of these columns, in order, some at a time."""
        at = {key: i for i, key in enumerate(keys)}
        if start == 0 and stop is None:
            for number, file in enumerate(self.files):
                yield from (Piece(file, number, first, rows, at) for first, rows in file.read(keys))
            return
        stop = self.n_rows if stop is None else min(stop, self.n_rows)
        begin = 0  # row of the file at hand
        for number, file in enumerate(self.files):
            n_rows = sum(file.row_groups)
            low, high = max(start - begin, 0), min(stop - begin, n_rows)
            if low < high:
                yield from (
                    Piece(file, number, first, rows, at) for first, rows in file.read(keys, low, high)
                )
            begin += n_rows

    def read_plain(self, pieces: Sequence[Piece]) -> tuple[NDArray[Any], NDArray[Any] | None]:
        """Return the states (N, n) and actions (N, d) of pieces as they lie in the files, or None for actions."""
        roles = self.roles
        if self.differentiates:
            return read_numbers(pieces, roles.state, "state").T, None
        both = read_numbers(pieces, (*roles.state, *roles.action), "state and action")
        n = len(roles.state)
        return both[:n].T, both[n:].T

    def plain_keys(self) -> list[ColumnKey]:
        """Return the columns of states and actions."""
        return _distinct(self.roles.state, self.roles.action)

    def blocks(
        self, batch_rows: int | None, start: int = 0, stop: int | None = None, *, everything: bool = False
    ) -> Generator[Block, None, None]:
        """Read rows `start` to `stop` in blocks.

        Parameters
        ----------
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
        pieces = self.read_pieces(self._keys(everything), start, stop)
        timed = everything and self.roles.time is not None and not self._saved
        whole = self.whole_episodes_for or ("time" if timed else None)
        load = partial(self._load, everything=everything)
        if batch_rows is None or (whole and all(file.at_once for file in self.files)):
            every = list(pieces)
            end = start + sum(len(piece.rows) for piece in every)
            if end > start:
                yield Block(start, end, partial(load, every, start))
        elif whole:
            yield from self._whole_episodes(pieces, start, batch_rows, whole, load)
        elif self.is_along_episodes:
            yield from self._whole_episodes(pieces, start, batch_rows, None, load)
        else:
            yield from _blocks_of_rows(pieces, start, batch_rows, load)

    def labels(self, pieces: Sequence[Piece]) -> NDArray[Any]:
        """Return what is not torn apart in blocks of whole episodes, (N,): the values of the episode column."""
        if self.roles.episode is None:
            return np.repeat([piece.file for piece in pieces], [len(piece.rows) for piece in pieces])
        return read_labels(pieces, self.roles.episode)

    def groups(self, pieces: Sequence[Piece], start: int) -> NDArray[Any]:
        """Return what cross-validation leaves out, (N,), of pieces the first of which begins at row `start`."""
        if self._undivided:
            rows = start + np.arange(sum(len(piece.rows) for piece in pieces))
            return rows * BLOCKS // self.n_rows
        values = self.labels(pieces)
        if self.alone:
            return values
        codes, found = number_values(values)
        return np.array([self._group(value, 0) for value in found])[codes]

    def check(self, motion: Motion, notes: Sequence[Note]) -> None:
        """Refuse a recording of which, after all of it was read, nothing is left, or in which nothing moves.

        Parameters
        ----------
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
            found = {note.kind: note.counts[0] for note in notes if note.file == self.name and note.counts}
            raise DataError(
                f"{self.shown}: split at {found.get('gap', 0)} gaps and {found.get('speed', 0)} fast steps, no "
                f"fragment lasts {self._shortest:g} s; raise gap= or max_speed=, or lower window= or min_duration="
            )
        if self._saved:
            return
        if motion.n_samples < 2:
            raise DataError(f"{self.shown} has one sample; at least two are needed")
        if not motion.moves:
            remedy = "the states do not move" if self.differentiates else "choose other action columns"
            raise DataError(f"all actions of {self.shown} are zero: {remedy}")

    @cached_property
    def clock(self) -> Clock:
        """How stamps are read, decided by the first rows."""
        assert self.roles.time is not None
        keys = _distinct((self.roles.time,), () if self.roles.episode is None else (self.roles.episode,))
        piece = next(piece for piece in self.read_pieces(keys) if len(piece.rows))
        piece = piece.slice(0, CLOCKED) if not piece.format.at_once else piece
        codes, _ = number_values(self.labels([piece]))
        unit = "s" if self._saved else self.preparation.time_unit
        return Clock.decide(piece.cells(self.roles.time, "time"), codes, unit)

    @property
    def _saved(self) -> bool:
        """Whether the files hold demonstrations, which are given back as they were."""
        return self.declared is not None and self.declared.saved

    @property
    def _undivided(self) -> bool:
        """Whether nothing tells episodes apart, not even files."""
        return self.roles.episode is None and len(self.files) == 1 and self.alone

    @property
    def _shortest(self) -> float:
        window = self.preparation.window if self.differentiates else 0.0
        return max(window, self.preparation.min_duration or 0.0)

    def _keys(self, everything: bool) -> list[ColumnKey]:
        roles = self.roles
        fields = [*roles.state, *roles.action]
        columns: tuple[ColumnKey, ...] = ()
        made = self.makes_projections
        if roles.time is not None and (everything or self.splits):
            fields.append(roles.time)
        if everything or self.reads_projections:
            columns = roles.projections
        if everything or made:
            fields += roles.force
            fields += () if roles.free is None else (roles.free,)
        last = () if roles.episode is None else (roles.episode,)
        return list(
            dict.fromkeys(
                [*_distinct(fields), *columns, *_distinct(roles.policy if everything else (), last)]
            )
        )

    def _load(self, pieces: Sequence[Piece], start: int, everything: bool) -> Loaded:
        prepares = everything or self.whole_episodes_for is not None
        loaded = self._prepare(pieces, start, everything) if prepares else Loaded(self._take(pieces, start))
        guesses: dict[bytes, None] = {}
        for piece in pieces:
            said = (piece.rows.schema.metadata or {}).get(GUESS, b"")
            guesses |= dict.fromkeys(guess for guess in said.split(b"\n") if guess)
        notes = (Note("guess", self.name, guess.decode()) for guess in guesses)
        loaded = replace(loaded, notes=(*notes, *loaded.notes))
        least = self.preparation.min_speed
        if least is not None:
            return leave_out_slow(loaded, least)
        if not everything:
            return loaded
        U = loaded.samples.actions
        return replace(loaded, motion=Motion(len(U), bool(np.any(U)), 0.0))

    def _take(self, pieces: Sequence[Piece], start: int) -> Samples:
        """Return samples that do not depend on their neighbours."""
        X, U = self.read_plain(pieces)
        assert U is not None
        N = None
        if self.reads_projections:
            N = read_projections(pieces, self.roles.projections, self.roles.n_actions)
        elif self.makes_projections:
            assert self.roles.free is not None
            N = from_forces_and_flags(
                None, read_flags(pieces, self.roles.free), U, np.zeros(len(U), np.int64)
            )
        return Samples(X, U, self.groups(pieces, start), N)

    def _prepare(self, pieces: Sequence[Piece], start: int, everything: bool) -> Loaded:
        """Return samples split into fragments, timed, differentiated, and with their projections."""
        roles = self.roles
        X = np.ascontiguousarray(read_numbers(pieces, roles.state, "state").T, dtype=np.float64)
        U = np.zeros_like(X)
        if roles.action:
            U = np.ascontiguousarray(read_numbers(pieces, roles.action, "action").T, dtype=np.float64)
        time = forces = free = policy = N = None
        made = self.makes_projections
        if roles.force and (everything or made):
            forces = np.ascontiguousarray(read_numbers(pieces, roles.force, "force").T, dtype=np.float64)
        if roles.free is not None and (everything or made):
            free = read_flags(pieces, roles.free)
        if roles.policy and everything:
            policy = np.ascontiguousarray(read_numbers(pieces, roles.policy, "policy").T, dtype=np.float64)
        if self.reads_projections:
            checked = self.columns.projections is not None
            N = read_projections(pieces, roles.projections, roles.n_actions, check=checked)
        episodes = self._label(self.labels(pieces))
        codes, origins = episodes.codes, [(code, 0) for code in range(len(episodes.labels))]
        notes: tuple[Note, ...] = ()
        rows = np.arange(len(X))
        if roles.time is not None and (everything or self.splits):
            time = self._seconds(pieces, codes)
            notes = () if self._saved else self.clock.note(self.name)
            if self.splits or not self._saved:
                found = self._split(X, time, episodes)
                notes += self._notes(found)
                rows, codes, origins = found.samples, found.episodes, list(found.origins)
                X, U, time = X[rows], U[rows], time[rows]
                forces, free, policy, N = (None if a is None else a[rows] for a in (forces, free, policy, N))
        if self.differentiates and len(X):
            assert time is not None
            order = np.argsort(codes, kind="stable")
            for own in np.split(order, np.cumsum(np.bincount(codes))[:-1]):
                U[own] = differentiate(X[own], time[own], window=self.preparation.window)
        if made:
            N = (
                from_forces_and_flags(
                    forces, free, U, codes, force_threshold=self.preparation.force_threshold
                )
                if len(X)
                else np.zeros((0, roles.n_actions, roles.n_actions))
            )
        kept = tuple(
            Episode(
                (self.number, episodes.values[code], part),
                f"{episodes.labels[code]}/{part}" if part else episodes.labels[code],
            )
            for code, part in origins
        )
        if everything:
            return Loaded(Samples(X, U, codes, N), notes, None, kept, time, policy, forces, free)
        if self._undivided and len(kept) == 1:
            groups: NDArray[Any] = (start + rows) * BLOCKS // self.n_rows
        elif self.splits:
            names = [self._group(episodes.values[code], part) for code, part in origins]
            groups = np.array(names, dtype=np.str_)[codes]
        else:
            groups = self.groups(pieces, start)
        return Loaded(Samples(X, U, groups, N), notes)

    def _group(self, value: Any, part: int) -> str:
        """Return a name that no other fragment of the source has."""
        if self.roles.episode is None and len(self.files) == 1:
            name = self.label
        else:
            name = _describe_label(value) if self.alone else f"{self.label}:{_describe_label(value)}"
        return f"{name}/{part}" if part else name

    def _label(self, values: NDArray[Any]) -> _Episodes:
        declared = self.declared
        if self._saved and declared is not None and self.roles.episode is not None:
            distinct, codes = np.unique(values, return_inverse=True)
            numbers = distinct.tolist()
            try:
                labels = [declared.episode_labels[number] for number in numbers]
                if min(numbers, default=0) < 0:
                    raise IndexError
            except (IndexError, TypeError) as error:
                raise DataError(
                    f"{self.shown} is damaged and cannot be read as saved demonstrations"
                ) from error
            return _Episodes(codes.astype(np.int64), numbers, labels)
        codes, found = number_values(values)
        if self.roles.episode is None:
            if len(self.files) == 1:
                return _Episodes(codes, found, [self.label])
            names = label_files([file.file.shown for file in self.files])
            labels = [names[number] for number in found]
        else:
            labels = [_describe_label(value) for value in found]
        return _Episodes(
            codes, found, labels if self.alone else [f"{self.label}:{label}" for label in labels]
        )

    def _seconds(self, pieces: Sequence[Piece], codes: Codes) -> Array:
        field = self.roles.time
        assert field is not None
        stamps = [piece.alike(field, "time") for piece in pieces]
        if self._saved and not self.splits:
            return np.concatenate([part.numbers() for part in stamps])
        ticks = np.concatenate([self.clock.ticks(part) for part in stamps])
        return self.clock.seconds(ticks, codes, stamps[0].path, field.called, places(pieces))

    def _split(self, X: Array, time: Array, episodes: _Episodes) -> Fragments:
        how = self.preparation
        if self.differentiates:
            self._check_long_enough(time, episodes)
        gap = how.gap
        if gap is None and not self.differentiates:
            gap = math.inf  # given actions do not depend on their neighbours, so a gap does no harm

        def long_enough(stamps: Array) -> bool:
            # Rounding must not drop a fragment of exactly the duration asked for.
            lasts = stamps[-1] - stamps[0] >= (how.min_duration or 0.0) * (1 - 1e-9)
            return bool(lasts) and (not self.differentiates or spans_window(stamps, how.window))

        return split(X, time, episodes.codes, gap=gap, max_speed=how.max_speed, long_enough=long_enough)

    def _check_long_enough(self, time: Array, episodes: _Episodes) -> None:
        window = self.preparation.window
        order = np.argsort(episodes.codes, kind="stable")
        bounds = np.cumsum(np.bincount(episodes.codes))[:-1]
        for label, stamps in zip(episodes.labels, np.split(time[order], bounds), strict=True):
            if not spans_window(stamps, window):
                samples = f"{len(stamps)} sample{'' if len(stamps) == 1 else 's'}"
                raise DataError(
                    f"{self.shown}: episode {label!r} has {samples} over {stamps[-1] - stamps[0]:.3g} s, too few to "
                    f"differentiate with window={window:g} s; leave it out, or lower window="
                )

    def _notes(self, found: Fragments) -> tuple[Note, ...]:
        how, name = self.preparation, self.name
        length = f"{GAP_STEPS:g} typical steps" if how.gap is None else f"{how.gap:g} s"
        notes = [
            Note("gap", name, f"split at {{}} longer than {length}", (found.gaps,), ("gap",)),
            Note(
                "short", name, f"dropped {{}} ({{}}) shorter than {self._shortest:g} s",
                (found.dropped, found.dropped_samples), ("fragment", "sample"),
            ),
        ]  # fmt: skip
        if how.max_speed is not None:
            text = f"split at {{}} faster than {how.max_speed:g} per second"
            notes.append(Note("speed", name, text, (found.fast,), ("step",)))
        else:
            text = (
                f"{{}} more than {SUSPICIOUS:g} times faster than 95 % of them, as when a tracker jumps; give "
                "max_speed= to split there"
            )
            notes.append(Note("jump", name, text, (found.suspicious,), ("step",)))
        return tuple(note for note in notes if note.counts[0])

    def _whole_episodes(
        self, pieces: Iterator[Piece], start: int, batch_rows: int, why: str | None, load: Any
    ) -> Generator[Block, None, None]:
        """Yield blocks of whole episodes, of `batch_rows` rows or more.

        Without a reason `why` they have to be whole, an episode that comes back after others is taken for another.
        """
        waiting: list[Piece] = []
        count = 0  # rows waiting
        current: Any = None
        here: set[Any] = set()  # episodes that wait
        gone: set[Any] = set()  # episodes of earlier blocks
        for piece in pieces:
            # A file without episodes is cut into some.
            values = self.groups([piece], start + count) if why is None else self.labels([piece])
            changes = (np.flatnonzero(values[1:] != values[:-1]) + 1).tolist()
            used = 0  # of the piece
            for at in changes if values[0] == current else [0, *changes]:
                complete = count + at - used  # rows of episodes that have ended
                if complete >= batch_rows and (why is None or values[at] not in here):
                    block = [*waiting, piece.slice(used, at - used)] if at > used else waiting
                    yield Block(start, start + complete, partial(load, block, start))
                    waiting, count, start, used = [], 0, start + complete, at
                    gone |= here
                    here = set()
                current = values[at]
                if why is None:
                    continue
                if current in gone:
                    place = piece.format.place(piece.first + at)
                    why = "time the samples of" if why == "time" else why
                    raise DataError(
                        f"{piece.format.file.shown}: episode {current} goes on at {place} after others were read; to "
                        f"{why} a stream, sort it by episode"
                    )
                here.add(current)
            waiting.append(piece.slice(used, len(piece.rows) - used))
            count += len(piece.rows) - used
        if waiting:
            yield Block(start, start + count, partial(load, waiting, start))


def _blocks_of_rows(
    pieces: Iterator[Piece], start: int, batch_rows: int, load: Any
) -> Generator[Block, None, None]:
    """Yield blocks of at most `batch_rows` rows, each of as many pieces as go into it."""
    waiting: list[Piece] = []
    count = 0
    for piece in pieces:
        if waiting and count + len(piece.rows) > batch_rows:
            yield Block(start, start + count, partial(load, waiting, start))
            waiting, count, start = [], 0, start + count
        while len(piece.rows) > batch_rows:
            stop = start + batch_rows
            yield Block(start, stop, partial(load, [piece.slice(0, batch_rows)], start))
            piece, start = piece.slice(batch_rows, len(piece.rows) - batch_rows), stop
        if len(piece.rows):
            waiting.append(piece)
            count += len(piece.rows)
    if waiting:
        yield Block(start, start + count, partial(load, waiting, start))


def _describe_label(value: Any) -> str:
    return str(int(value)) if isinstance(value, float) and value.is_integer() else str(value)


def _distinct(*fields: Sequence[Field]) -> list[ColumnKey]:
    return list(dict.fromkeys(field.key for each in fields for field in each))
