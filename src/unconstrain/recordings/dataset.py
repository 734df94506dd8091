"""A table of Parquet files in its roles, as a stream: which columns are states, actions, episodes and time."""

import os
from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.fitting.solve import EpisodeFolds
from unconstrain.recordings import saved
from unconstrain.recordings.blocks import Array, Block
from unconstrain.recordings.files import Paths
from unconstrain.recordings.formats import lerobot
from unconstrain.recordings.known import Known
from unconstrain.recordings.loading import NothingLeft, derived
from unconstrain.recordings.reading import Reading
from unconstrain.recordings.roles import DIFFERENTIATE, Roles
from unconstrain.recordings.shards import Field, Piece, Shards
from unconstrain.recordings.stamps import seconds
from unconstrain.recordings.table import Column, Table
from unconstrain.samples import Samples

HEAD_ROWS = 2


@dataclass(frozen=True)
class Derivation:
    """How states become actions; see `load` for what each means."""

    time: str
    time_unit: str | None = None
    window: float = 0.2
    gap: float | None = None
    max_speed: float | None = None
    min_duration: float | None = None


@dataclass(frozen=True)
class Dataset:
    """Parquet files of which it is known which columns are what. Can be sent to another process.

    action: fields, or how they are derived from the states. episode: the column that tells episodes apart; its values
    mean the same in all files, unless `restarts`. Without it every file is an episode; a single file then has none,
    and contiguous blocks of it are what cross-validation leaves out. known: the columns that tell of constraints.
    """

    shards: Shards
    state: tuple[Field, ...]
    action: tuple[Field, ...] | Derivation
    episode: str | None
    batch_rows: int
    restarts: bool = False
    known: Known | None = None

    @property
    def repeatable(self) -> bool:
        return True

    @property
    def scalar_actions(self) -> bool:
        return False

    @property
    def n_rows(self) -> int:
        return self.shards.n_rows

    @property
    def tells_constraints(self) -> bool:
        return self.known is not None

    @property
    def columns(self) -> list[str]:
        """The columns that are read, and no others are."""
        used = self._columns_of_samples
        used += [self.action.time] if isinstance(self.action, Derivation) else []
        used += self.known.columns if self.known else []
        return list(dict.fromkeys(used + ([self.episode] if self.episode else [])))

    @property
    def differentiates(self) -> bool:
        return isinstance(self.action, Derivation)

    @property
    def needs_whole_episodes(self) -> str | None:
        """What is done with a sample that takes its neighbours, where anything is."""
        if self.differentiates:
            return "differentiate"
        return "filter the forces of" if self.known and self.known.of_whole_episodes else None

    def head(self) -> tuple[Array, Array | None]:
        return self._plain(list(self.shards.pieces(self._columns_of_samples, 0, HEAD_ROWS)))

    def sample(self, n_rows: int, random_state: int | None) -> tuple[Array, Array | None]:
        return self._plain(self.shards.sample(self._columns_of_samples, n_rows, random_state))

    def blocks(self, start: int = 0, stop: int | None = None) -> Generator[Block, None, None]:
        pieces = self.shards.pieces(self.columns, start, stop)
        return (
            self._whole_episodes(pieces, start) if self.needs_whole_episodes else self._blocks(pieces, start)
        )

    def identity(self) -> str:
        files = list(zip(map(os.path.basename, self.shards.paths), self.shards.row_groups, strict=True))
        about = (files, self.state, self.action, self.episode, self.restarts)
        return repr(about if self.known is None else (*about, self.known))

    def groups(self, pieces: list[Piece], start: int) -> NDArray[Any]:
        """Labels (N,) of what cross-validation leaves out, of pieces the first of which begins at row `start`."""
        if self.episode is None and len(self.shards.paths) == 1 and not isinstance(self.action, Derivation):
            rows = start + np.arange(sum(len(piece.rows) for piece in pieces))
            return rows * EpisodeFolds().n_folds // self.n_rows
        return self.episodes(pieces)

    def episodes(self, pieces: list[Piece]) -> NDArray[Any]:
        """Episode labels (N,) of pieces: what is not torn apart where samples take their neighbours."""
        if self.episode is None:
            return np.repeat([piece.file for piece in pieces], [len(piece.rows) for piece in pieces])
        labels = self.shards.labels(pieces, self.episode)
        if not self.restarts:
            return labels
        if labels.dtype.kind not in "iu":
            raise DataError(f"{self.shards.shown}: the column {self.episode!r} must hold whole numbers")
        return labels + (replace(self, episode=None).episodes(pieces) << 32)

    def labels(self, start: int, stop: int, *, whole: bool = False) -> Iterator[tuple[NDArray[Any], int]]:
        """The labels of rows `start` to `stop`, some at a time, each with the row where they begin.

        They are those of `groups`, or with `whole` those of `episodes`. Nothing but the episode column is read.
        """
        column = self.episode or self.state[0].column
        for piece in self.shards.pieces([column], start, stop):
            yield self.episodes([piece]) if whole else self.groups([piece], start), start
            start += len(piece.rows)

    @property
    def _columns_of_samples(self) -> list[str]:
        given = () if isinstance(self.action, Derivation) else self.action
        return list(dict.fromkeys(field.column for field in (*self.state, *given)))

    def _plain(self, pieces: list[Piece]) -> tuple[Array, Array | None]:
        if isinstance(self.action, Derivation):
            return self.shards.numbers(pieces, self.state, "state").T, None
        both = self.shards.numbers(pieces, (*self.state, *self.action), "state and action")
        n = len(self.state)
        return both[:n].T, both[n:].T

    def _blocks(self, pieces: Iterator[Piece], start: int) -> Generator[Block, None, None]:
        """Blocks of at most `batch_rows` rows, each of as many pieces as go into it: what was read at once stays so."""
        waiting: list[Piece] = []
        count = 0
        for piece in pieces:
            if waiting and count + len(piece.rows) > self.batch_rows:
                yield Block(start, start + count, partial(self._loaded, waiting, start))
                waiting, count, start = [], 0, start + count
            while len(piece.rows) > self.batch_rows:
                stop = start + self.batch_rows
                yield Block(start, stop, partial(self._loaded, [piece.slice(0, self.batch_rows)], start))
                piece, start = piece.slice(self.batch_rows, len(piece.rows) - self.batch_rows), stop
            if len(piece.rows):
                waiting.append(piece)
                count += len(piece.rows)
        if waiting:
            yield Block(start, start + count, partial(self._loaded, waiting, start))

    def _loaded(self, pieces: list[Piece], start: int) -> Samples:
        if isinstance(self.action, Derivation):
            return self._derived(pieces, start, self.action)
        X, U = self._plain(pieces)
        assert U is not None
        groups = self.groups(pieces, start)
        if self.known is None:
            return Samples(X, U, groups)
        codes = _runs(self.episodes(pieces))[0]
        demos = Demonstrations(X, U, codes, **self.known.told(self.shards, pieces))
        return Samples(X, U, groups, self._projections(demos, pieces))

    def _projections(self, demos: Demonstrations, pieces: list[Piece]) -> Array | None:
        return None if self.known is None else self.known.of(demos, self.shards.name(pieces[0].file))

    def _whole_episodes(self, pieces: Iterator[Piece], start: int) -> Generator[Block, None, None]:
        """Blocks of whole episodes, of `batch_rows` rows or more."""
        waiting: list[Piece] = []
        count = 0  # rows waiting
        current: Any = None
        ended: set[Any] = set()
        for piece in pieces:
            labels = self.episodes([piece])
            changes = (np.flatnonzero(labels[1:] != labels[:-1]) + 1).tolist()
            used = 0  # of the piece
            for at in changes if labels[0] == current else [0, *changes]:
                if labels[at] in ended:
                    raise DataError(
                        f"{self.shards.name(piece.file)}: episode {labels[at]} goes on at row {piece.first + at} "
                        f"(counted from 0) after another began; to {self.needs_whole_episodes} a stream, sort it by "
                        "episode"
                    )
                if current is not None:
                    ended.add(current)
                current = labels[at]
                complete = count + at - used  # rows of episodes that have ended
                if complete >= self.batch_rows:
                    block = [*waiting, piece.slice(used, at - used)] if at > used else waiting
                    yield Block(start, start + complete, partial(self._loaded, block, start))
                    waiting, count, start, used = [], 0, start + complete, at
            waiting.append(piece.slice(used, len(piece.rows) - used))
            count += len(piece.rows) - used
        if waiting:
            yield Block(start, start + count, partial(self._loaded, waiting, start))

    def _derived(self, pieces: list[Piece], start: int, how: Derivation) -> Samples:
        X = self.shards.numbers(pieces, self.state, "state").T
        labels = self.episodes(pieces)
        codes, begins = _runs(labels)
        stamps = self._stamps(pieces, codes, how)
        demos = Demonstrations(
            np.ascontiguousarray(X),
            np.zeros_like(X),
            codes,
            stamps,
            episode_labels=[str(label) for label in labels[begins]],
            **(self.known.told(self.shards, pieces) if self.known else {}),
        )
        limits = {"gap": how.gap, "max_speed": how.max_speed, "min_duration": how.min_duration}
        try:
            demos = derived(demos, self.shards.name(pieces[0].file), window=how.window, **limits)
        except NothingLeft:  # of this block, which is no more than a part of the recording
            nothing = np.zeros((0, X.shape[1], X.shape[1])) if self.known else None
            return Samples(X[:0], X[:0], labels[:0], nothing)
        # A fragment of a broken episode is an episode of its own; counted from its block's first row, none is twice.
        groups = start + demos.episodes
        return Samples(demos.states, demos.actions, groups, self._projections(demos, pieces))

    def _stamps(self, pieces: list[Piece], codes: NDArray[np.int64], how: Derivation) -> Array:
        columns = [self.shards.table(piece, [how.time]).columns[0].values for piece in pieces]
        whole = pa.chunked_array(
            [c for column in columns for c in (column.chunks if hasattr(column, "chunks") else [column])]
        )
        table = Table(self.shards.shown, [Column(how.time, whole)], self.shards.places(pieces))
        return seconds(table, 0, codes, how.time_unit)[0]


def opened(source: Paths, reading: Reading, batch_rows: int) -> Dataset:
    """The files of `source` with their columns in their roles; see `fit_stream` for what may be given.

    Raises `DataError` for files that cannot be read, and columns that do not exist or are not given.
    """
    state, action, episode, time = reading.state, reading.action, reading.episode, reading.time
    robot = lerobot.opened(source) if isinstance(source, str | os.PathLike) else None
    shards = robot.shards if robot else Shards.find(source)
    table, schema = shards.first_rows()
    restarts = False
    if robot:
        roles = robot.roles(Roles(state, action, time, episode))
        state, action, episode, time = roles.state, roles.action, roles.episode, roles.time
    elif state is None:
        own = saved.roles(schema)
        if own is None:
            raise DataError(f"{shards.shown}: give state=, the columns that are states; {table.listing()}")
        state, action = own["states"], own["actions"] if action is None else action
        episode, time = own["episodes"], own.get("time", time)
        restarts = len(shards.paths) > 1  # each file counts its episodes from 0
    fields = partial(_fields, table)
    differentiated = action is None or action == DIFFERENTIATE
    if differentiated and time is None:
        raise DataError(
            f"{shards.shown}: give action=, or time= so that the states can be differentiated; {table.listing()}"
        )
    states = fields("state", state)
    actions: tuple[Field, ...] | Derivation
    if differentiated:
        n_actions = len(states)
        assert time is not None
        actions = Derivation(
            _whole_column(table, "time", time),
            reading.time_unit,
            reading.window,
            reading.gap,
            reading.max_speed,
            reading.min_duration,
        )
    else:
        actions = fields("action", action)
        n_actions = len(actions)
    return Dataset(
        shards,
        states,
        actions,
        None if episode is None else _whole_column(table, "episode", episode),
        batch_rows,
        restarts,
        Known.asked(reading, fields, schema, n_actions),
    )


def _fields(table: Table, role: str, keys: Any) -> tuple[Field, ...]:
    each = [keys] if isinstance(keys, str | int) else list(keys)
    fields: list[Field] = []
    for key in each:
        for position in table.find(role, key):
            column = table.columns[position]
            fields.append(Field(column.part_of or column.name, column.component))
    if not fields:
        raise DataError(f"no {role} columns were given for {table.path}; {table.listing()}")
    return tuple(fields)


def _runs(labels: NDArray[Any]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Numbers (N,) of the runs of equal labels, from 0, and where they begin, as a mask (N,)."""
    begins = np.concatenate([[True], labels[1:] != labels[:-1]])
    return np.cumsum(begins) - 1, begins


def _whole_column(table: Table, role: str, key: Any) -> str:
    positions = table.find(role, key)
    column = table.columns[positions[0]]
    if len(positions) > 1 or column.part_of:
        raise DataError(f"{table.path}: {role} takes one column, but {key!r} is a column of lists")
    return column.name
