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
from unconstrain.recordings.actions import VELOCITY, ActionKind, find_kind, per_second
from unconstrain.recordings.angles import unwrap
from unconstrain.recordings.blocks import (
    Array,
    Block,
    Episode,
    Loaded,
    Motion,
    leave_out_slow,
    number_values,
    select,
)
from unconstrain.recordings.columns import NO_ANGLE, Columns
from unconstrain.recordings.derivative import differentiate, spans_window
from unconstrain.recordings.files import label as label_files
from unconstrain.recordings.formats.base import GUESS, ColumnKey, Declared, Format
from unconstrain.recordings.gaps import GAP_STEPS, SUSPICIOUS, Fragments, split
from unconstrain.recordings.notes import Note
from unconstrain.recordings.pauses import AT_REST, SHORTEST, find_pauses
from unconstrain.recordings.pieces import (
    Piece,
    places,
    read_flags,
    read_labels,
    read_numbers,
    read_projections,
)
from unconstrain.recordings.preparation import Preparation
from unconstrain.recordings.reading import tally
from unconstrain.recordings.relative import describe, end_of, moving_centre
from unconstrain.recordings.resampling import make_grid
from unconstrain.recordings.roles import Roles
from unconstrain.recordings.steps import comes_in_bursts, runs
from unconstrain.recordings.table import Field
from unconstrain.recordings.time import Clock, repeated
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
    kind : ActionKind
        What recorded actions are.
    leader : Recording, optional
        The recording whose unit of time is taken where it has to be guessed.
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
    kind: ActionKind = VELOCITY
    leader: "Recording | None" = None

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
        """Whether samples are prepared by their time: split, resampled, differentiated, or left out by it."""
        if not self.timed:
            return False
        how = self.preparation
        asked = not (how.gap is how.max_speed is how.resample is None)
        by_time = any(how.drops(what) for what in ("duplicates", "short", "pauses"))
        return self.differentiates or asked or by_time or self.kind.kind == "increment"

    @property
    def timed(self) -> bool:
        """Whether the time of samples is known."""
        return self.roles.time is not None or self.preparation.rate is not None

    @property
    def unwraps(self) -> bool:
        """Whether states are looked through for angles."""
        chosen = self.columns.angle
        return chosen != NO_ANGLE and (self.differentiates or chosen is not None)

    @property
    def is_relative(self) -> bool:
        """Whether states are taken relative to something."""
        return not (self.columns.relative_to is self.preparation.moving_centre is None)

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
        if self.is_relative:
            return "find what is relative in"
        if self.unwraps or self.preparation.drop is not None:
            return "unwrap" if self.unwraps else "drop samples of"
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

    @property
    def saves(self) -> bool:
        """Whether the files hold what this package saved: actions are velocities there."""
        return self._saved

    def find_kind(self) -> str:
        """Find what the recorded actions are, by the first rows."""
        if len(self.roles.state) != len(self.roles.action) or self.roles.state == self.roles.action:
            return "velocity"
        time = () if self.roles.time is None else (self.roles.time,)
        episode = () if self.roles.episode is None else (self.roles.episode,)
        pieces: list[Piece] = []
        for piece in self.read_pieces(_distinct(self.roles.state, self.roles.action, time, episode)):
            pieces.append(piece.slice(0, CLOCKED))
            if sum(len(each.rows) for each in pieces) >= CLOCKED:
                break
        pieces = [piece for piece in self._complete(pieces) if len(piece.rows)]
        if not pieces:
            return "velocity"
        n = len(self.roles.state)
        both = read_numbers(pieces, (*self.roles.state, *self.roles.action), "state and action").astype(
            np.float64
        )
        codes = number_values(self.labels(pieces))[0]
        order = np.argsort(codes, kind="stable")
        seconds = None
        if self.roles.time is not None:
            ticks = np.concatenate(
                [self.clock.ticks(piece.cells(self.roles.time, "time")) for piece in pieces]
            )
            seconds = (ticks - ticks[0])[order] / self.clock.ticks_a_second
        elif self.timed:
            seconds = self._counted(codes)[order]
        return find_kind(both[:n].T[order], both[n:].T[order], codes[order], seconds)

    def read_plain(self, pieces: Sequence[Piece]) -> tuple[NDArray[Any], NDArray[Any] | None]:
        """Return the states (N, n) and actions (N, d) of pieces as they lie in the files, or None for actions."""
        roles = self.roles
        pieces = self._complete(pieces)
        if self.differentiates:
            return read_numbers(pieces, roles.state, "state").T, None
        both = read_numbers(pieces, (*roles.state, *roles.action), "state and action")
        n = len(roles.state)
        U = both[n:].T
        return both[:n].T, U / self.step if self.kind.kind == "increment" and self.timed else U

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
        whole = self._whole_for(everything)
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

    @cached_property
    def step(self) -> float:
        """The typical step (s) between samples, as they lie in the files; 0.0 where it is not known."""
        if self.roles.time is not None:
            return self.clock.step
        return 0.0 if self.preparation.rate is None else 1.0 / self.preparation.rate

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
        if self.preparation.drops("missing"):
            piece = piece.without(piece.missing(self.roles.time, "time"))
        codes, _ = number_values(self.labels([piece]))
        unit = "s" if self._saved else self.preparation.time_unit
        cells = piece.cells(self.roles.time, "time")
        own = Clock.decide(cells, codes, unit, self.preparation.rate)
        if unit is not None or self.leader is None or own.of_type:
            return own
        return own.led_by(self.leader.clock)

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
        if roles.time is not None and (everything or self.splits or self.is_relative):
            fields.append(roles.time)
        fields += roles.reference
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
        notes = [Note("guess", self.name, guess.decode()) for guess in guesses]
        if not prepares and self.roles.time is not None:
            notes += self.clock.note(self.name)
        loaded = replace(loaded, notes=(*notes, *loaded.notes))
        least = self.preparation.min_speed
        if least is not None:
            loaded = leave_out_slow(loaded, least)
        elif everything:
            U = loaded.samples.actions
            loaded = replace(loaded, motion=Motion(len(U), bool(np.any(U)), 0.0))
        return replace(loaded, notes=(*loaded.notes, self._tally(loaded, pieces, start)))

    def _tally(self, loaded: Loaded, pieces: Sequence[Piece], start: int) -> Note:
        """Count samples and episodes of a block."""
        groups, time = loaded.samples.groups, loaded.time
        assert groups is not None
        if self._whole_for(bool(loaded.episodes)) is None:
            values = self.labels(pieces)
            begins = int(np.sum(values[1:] != values[:-1])) + self._begins(values[:1], start)
            return tally(self.name, len(groups), begins, None)
        codes, found = number_values(groups)
        if self._undivided and not loaded.episodes:
            codes, found = np.zeros_like(codes), found[:1]
        if time is None:
            return tally(self.name, len(groups), len(found), None)
        lasted = sum(float(time[own[-1]] - time[own[0]]) for own in runs(codes))
        return tally(self.name, len(groups), len(found), lasted)

    def _whole_for(self, everything: bool) -> str | None:
        """Return why blocks hold whole episodes, where they do."""
        timed = everything and self.timed and not self._saved
        return self.whole_episodes_for or ("time" if timed else None)

    def _begins(self, first: NDArray[Any], start: int) -> int:
        """Return 1 if the row `start`, of this label (1,), is the first of its episode; 0 otherwise."""
        if not start:
            return 1
        field = self.roles.episode or self.roles.state[0]
        before = list(self.read_pieces([field.key], start - 1, start))
        return int(self.labels(before)[0] != first[0])

    def _complete(self, pieces: Sequence[Piece]) -> Sequence[Piece]:
        """Leave out the rows without a state, an action or a stamp, where that is asked for."""
        if not self.preparation.drops("missing"):
            return pieces
        roles = self.roles
        several = (("state", roles.state), ("action", roles.action))
        wanted = [(role, field) for role, fields in several for field in fields]
        complete = []
        for piece in pieces:
            missing = np.zeros(len(piece.rows), dtype=bool)
            timed = roles.time is not None and roles.time.key in piece.at
            for role, field in [*wanted, *([("time", roles.time)] if timed else [])]:
                assert field is not None
                missing |= piece.missing(field, role)
            complete.append(piece.without(missing) if missing.any() else piece)
        return complete

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
        count = sum(len(piece.rows) for piece in pieces)
        raw = number_values(self.labels(pieces))[0] if roles.time is None and self.timed else None
        pieces = self._complete(pieces)
        rows = _kept(pieces)
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
        reference = None
        if roles.reference:
            reference = np.ascontiguousarray(
                read_numbers(pieces, roles.reference, "relative_to").T, dtype=np.float64
            )
        if roles.policy and everything:
            policy = np.ascontiguousarray(read_numbers(pieces, roles.policy, "policy").T, dtype=np.float64)
        if self.reads_projections:
            checked = self.columns.projections is not None
            N = read_projections(pieces, roles.projections, roles.n_actions, check=checked)
        episodes = self._label(self.labels(pieces))
        codes, origins = episodes.codes, [(code, 0) for code in range(len(episodes.labels))]
        notes: tuple[Note, ...] = ()
        if len(rows) < count:
            notes = (
                Note(
                    "empty", self.name, "left out {} with something missing", (count - len(rows),), ("row",)
                ),
            )

        def take(chosen: Codes) -> None:
            nonlocal rows, X, U, time, forces, free, policy, N, reference
            rows, X, U = rows[chosen], X[chosen], U[chosen]
            time, forces, free, policy, N, reference = (
                None if each is None else each[chosen] for each in (time, forces, free, policy, N, reference)
            )

        if self.timed and (everything or self.splits or self.is_relative) and len(X):
            seconds, again = self._seconds(pieces, codes) if raw is None else (self._counted(raw)[rows], None)
            if again is not None and again.any():
                text = "left out {} with the stamp of the one before"
                notes += (Note("repeated", self.name, text, (int(again.sum()),), ("row",)),)
                codes = codes[~again]
                take(np.flatnonzero(~again))
            time = seconds
            if roles.time is not None and not self._saved:
                notes += self.clock.note(self.name)
        if self.unwraps and len(X):
            found, turned = self._unwrap(X, codes)
            X, notes = found, (*notes, *turned)
        if time is not None and (self.splits or not self._saved):
            episodes = _Episodes(codes, episodes.values, episodes.labels)
            if not self._saved:
                notes += self._bursts(time, codes)
            fragments = self._split(X, time, episodes)
            notes += self._notes(fragments)
            codes, origins = fragments.episodes, list(fragments.origins)
            take(fragments.samples)
        if time is not None and self.kind.kind == "increment":
            for own in runs(codes):
                U[own] = per_second(U[own], time[own])
        if time is not None and self.preparation.resample is not None and len(X):
            grid = make_grid(time, codes, self.preparation.resample)
            X, U = grid.between(X), grid.between(U)
            forces, policy, reference = (
                None if each is None else grid.between(each) for each in (forces, policy, reference)
            )
            rows = rows[grid.nearest]
            free, N = (None if each is None else each[grid.nearest] for each in (free, N))
            time, codes = grid.time, grid.episodes
        if self.differentiates and len(X):
            assert time is not None
            for own in runs(codes):
                U[own] = differentiate(X[own], time[own], window=self.preparation.window)
        if self.is_relative:
            for own in runs(codes):
                stamps = None if time is None else time[own]
                apart = None if reference is None else reference[own]
                X[own], U[own] = self._relate(X[own], U[own], stamps, apart)
            said = describe(self.columns.relative_to, self.preparation.moving_centre)
            notes += (Note("relative", self.name, said),)
            policy = None  # that of the states as they were
        resting = np.zeros(len(X), dtype=bool)
        if time is not None and not self._saved:
            resting, paused = self._pauses(U, time, codes)
            notes += paused
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
        groups: NDArray[Any]
        if everything:
            groups = codes
        elif self._undivided and len(kept) == 1:
            groups = (start + rows) * BLOCKS // self.n_rows
        elif self.splits:
            names = [self._group(episodes.values[code], part) for code, part in origins]
            groups = np.array(names, dtype=np.str_)[codes]
        else:
            groups = self.groups(pieces, start)
        loaded = Loaded(Samples(X, U, groups, N), notes, None, kept if everything else (), time)
        if everything:
            loaded = replace(loaded, policy=policy, forces=forces, free=free)
        return select(loaded, ~resting) if self.preparation.drops("pauses") and resting.any() else loaded

    def _unwrap(self, X: Array, codes: Codes) -> tuple[Array, tuple[Note, ...]]:
        """Return the states with angles unwrapped, and what was found."""
        notes: tuple[Note, ...] = ()
        result = X
        for own in runs(codes):
            unwrapped, found = unwrap(X[own], self.roles.state_names, self.roles.angle, self.name)
            if found:
                result = result.copy() if result is X else result
                result[own] = unwrapped
                notes += found
        return result, notes

    def _bursts(self, time: Array, codes: Codes) -> tuple[Note, ...]:
        """Note episodes whose stamps come in bursts."""
        count = sum(comes_in_bursts(np.diff(time[own])) for own in runs(codes))
        text = (
            "the stamps of {} come in bursts, as when messages are stamped where they arrive; name better stamps with "
            "time= if there are any, or give resample= to spread these evenly"
        )
        return (Note("burst", self.name, text, (count,), ("episode",)),) if count else ()

    def _pauses(self, U: Array, time: Array, codes: Codes) -> tuple[NDArray[np.bool_], tuple[Note, ...]]:
        """Find the samples (N,) in pauses, and note how many they are."""
        resting = np.zeros(len(U), dtype=bool)
        count = 0
        for own in runs(codes):
            resting[own], number = find_pauses(U[own], time[own])
            count += number
        if not count:
            return resting, ()
        what = f"in {{}} of {SHORTEST:g} s or more below {AT_REST:.0%} of the usual speed"
        if self.preparation.drops("pauses"):
            text = f"left out {{}} {what}"
        else:
            text = f'{{}} are at rest, {what}; drop="pauses" leaves them out, or min_speed= slow ones'
        counts = (int(resting.sum()), count)
        return resting, (Note("pause", self.name, text, counts, ("sample", "pause")),)

    def _counted(self, codes: Codes) -> Array:
        """Return the time (s) of rows without stamps, (N,): their number within the episode by the rate."""
        assert self.preparation.rate is not None
        time = np.empty(len(codes))
        for own in runs(codes):
            time[own] = np.arange(len(own)) / self.preparation.rate
        return time

    def _relate(self, X: Array, U: Array, time: Array | None, reference: Array | None) -> tuple[Array, Array]:
        """Return states and actions of one episode relative to what the options say."""
        to, seconds = self.columns.relative_to, self.preparation.moving_centre
        if reference is not None:
            assert time is not None
            X, U = X - reference, U - differentiate(reference, time, window=self.preparation.window)
        elif to is not None:
            X = X - end_of(X, str(to))
        if seconds is not None:
            assert time is not None
            X, U = X - moving_centre(X, time, seconds), U - moving_centre(U, time, seconds)
        return X, U

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

    def _seconds(self, pieces: Sequence[Piece], codes: Codes) -> tuple[Array, NDArray[np.bool_] | None]:
        """Return the time (s), and where stamps that are repeated are to be left out, which rows (N,) these are."""
        field = self.roles.time
        assert field is not None
        stamps = [piece.alike(field, "time") for piece in pieces]
        if self._saved and not self.splits:
            return np.concatenate([part.numbers() for part in stamps]), None
        ticks = np.concatenate([self.clock.ticks(part) for part in stamps])
        where = places(pieces)
        again = None
        if self.preparation.drops("duplicates"):
            again = repeated(ticks, codes)
            left = np.flatnonzero(~again)
            ticks, codes = ticks[left], codes[left]
            return self.clock.seconds(
                ticks, codes, stamps[0].path, field.called, lambda i: where(int(left[i]))
            ), again
        return self.clock.seconds(ticks, codes, stamps[0].path, field.called, where), None

    def _split(self, X: Array, time: Array, episodes: _Episodes) -> Fragments:
        how = self.preparation
        if (self.differentiates or self.kind.kind == "increment") and not how.drops("short"):
            self._check_long_enough(time, episodes)
        gap = how.gap
        if gap is None and not self.differentiates:
            gap = (
                None if how.resample is not None else math.inf
            )  # given actions do not depend on their neighbours, so a gap does no harm

        def long_enough(stamps: Array) -> bool:
            # Rounding must not drop a fragment of exactly the duration asked for.
            lasts = stamps[-1] - stamps[0] >= (how.min_duration or 0.0) * (1 - 1e-9)
            if not lasts or (len(stamps) < 2 and self.kind.kind == "increment"):
                return False
            return not self.differentiates or spans_window(stamps, how.window)

        return split(
            X, time, episodes.codes, gap=gap, max_speed=how.max_speed, long_enough=long_enough,
            drop_short=how.drops("short"),
        )  # fmt: skip

    def _check_long_enough(self, time: Array, episodes: _Episodes) -> None:
        window = self.preparation.window
        order = np.argsort(episodes.codes, kind="stable")
        bounds = np.cumsum(np.bincount(episodes.codes))[:-1]
        for label, stamps in zip(episodes.labels, np.split(time[order], bounds), strict=True):
            if len(stamps) < 2 or (self.differentiates and not spans_window(stamps, window)):
                samples = f"{len(stamps)} sample{'' if len(stamps) == 1 else 's'}"
                raise DataError(
                    f"{self.shown}: episode {label!r} has {samples} over {stamps[-1] - stamps[0]:.3g} s, too few to "
                    f'differentiate with window={window:g} s; leave it out with drop="short", or lower window='
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


def _kept(pieces: Sequence[Piece]) -> Codes:
    """Return the numbers of the rows of pieces, counted from the first, where some may have been left out."""
    at, every = 0, []
    for piece in pieces:
        every.append(at + (np.arange(len(piece.rows)) if piece.kept is None else piece.kept))
        at += piece.length
    return np.concatenate(every)


def _describe_label(value: Any) -> str:
    return str(int(value)) if isinstance(value, float) and value.is_integer() else str(value)


def _distinct(*fields: Sequence[Field]) -> list[ColumnKey]:
    return list(dict.fromkeys(field.key for each in fields for field in each))
