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
from unconstrain.readers import lerobot, saved
from unconstrain.readers.blocks import Array, Block, Samples
from unconstrain.readers.loading import NothingLeft, derived
from unconstrain.readers.roles import Keys
from unconstrain.readers.shards import Field, Paths, Piece, Shards
from unconstrain.readers.stamps import seconds
from unconstrain.readers.table import Column, Key, Table
from unconstrain.selection import EpisodeFolds

DIFFERENTIATE = "differentiate"
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
    and contiguous blocks of it are what cross-validation leaves out.
    """

    shards: Shards
    state: tuple[Field, ...]
    action: tuple[Field, ...] | Derivation
    episode: str | None
    batch_rows: int
    restarts: bool = False

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
    def columns(self) -> list[str]:
        """The columns that are read, and no others are."""
        if isinstance(self.action, Derivation):
            used = [*(field.column for field in self.state), self.action.time]
        else:
            used = [field.column for field in (*self.state, *self.action)]
        return list(dict.fromkeys(used + ([self.episode] if self.episode else [])))

    def head(self) -> tuple[Array, Array | None]:
        return self._plain(list(self.shards.pieces(self.columns, 0, HEAD_ROWS)))

    def sample(self, n_rows: int, random_state: int | None) -> tuple[Array, Array | None]:
        return self._plain(self.shards.sample(self.columns, n_rows, random_state))

    def blocks(self, start: int = 0, stop: int | None = None) -> Generator[Block, None, None]:
        pieces = self.shards.pieces(self.columns, start, stop)
        if isinstance(self.action, Derivation):
            return self._whole_episodes(pieces, start, self.action)
        return self._even(pieces, start)

    def identity(self) -> str:
        files = list(zip(map(os.path.basename, self.shards.paths), self.shards.row_groups, strict=True))
        return repr((files, self.state, self.action, self.episode, self.restarts))

    def groups(self, pieces: list[Piece], start: int) -> NDArray[Any]:
        """Episode labels (N,) of pieces, the first of which begins at row `start`."""
        if self.episode is not None:
            labels = self.shards.labels(pieces, self.episode)
            if not self.restarts:
                return labels
            if labels.dtype.kind not in "iu":
                raise DataError(f"{self.shards.shown}: the column {self.episode!r} must hold whole numbers")
            return labels + (self._files(pieces) << 32)
        if len(self.shards.paths) == 1 and not isinstance(self.action, Derivation):
            rows = start + np.arange(sum(len(piece.rows) for piece in pieces))
            return rows * EpisodeFolds().n_folds // self.n_rows
        return self._files(pieces)

    def labels(self, start: int, stop: int) -> Iterator[tuple[NDArray[Any], int]]:
        """The episode labels of rows `start` to `stop`, some at a time, each with the row where they begin.

        Nothing but the episode column is read.
        """
        column = self.episode or self.state[0].column
        for piece in self.shards.pieces([column], start, stop):
            yield self.groups([piece], start), start
            start += len(piece.rows)

    def _files(self, pieces: list[Piece]) -> NDArray[np.int64]:
        return np.repeat([piece.file for piece in pieces], [len(piece.rows) for piece in pieces])

    def _plain(self, pieces: list[Piece]) -> tuple[Array, Array | None]:
        if isinstance(self.action, Derivation):
            return self.shards.numbers(pieces, self.state, "state").T, None
        both = self.shards.numbers(pieces, (*self.state, *self.action), "state and action")
        n = len(self.state)
        return both[:n].T, both[n:].T

    def _even(self, pieces: Iterator[Piece], start: int) -> Generator[Block, None, None]:
        """Blocks of `batch_rows` rows, counted from `start`, whatever the files' own division."""
        waiting: list[Piece] = []
        count = 0
        for piece in pieces:
            while count + len(piece.rows) >= self.batch_rows:
                missing = self.batch_rows - count
                waiting.append(piece.slice(0, missing))
                piece = piece.slice(missing, len(piece.rows) - missing)
                yield Block(start, start + self.batch_rows, partial(self._loaded, waiting, start))
                waiting, count, start = [], 0, start + self.batch_rows
            if len(piece.rows):
                waiting.append(piece)
                count += len(piece.rows)
        if waiting:
            yield Block(start, start + count, partial(self._loaded, waiting, start))

    def _loaded(self, pieces: list[Piece], start: int) -> Samples:
        X, U = self._plain(pieces)
        assert U is not None
        return Samples(X, U, self.groups(pieces, start))

    def _whole_episodes(
        self, pieces: Iterator[Piece], start: int, how: Derivation
    ) -> Generator[Block, None, None]:
        """Blocks of whole episodes, of `batch_rows` rows or more: a derivative needs its neighbours."""
        waiting: list[Piece] = []
        count = 0  # rows waiting
        current: Any = None
        ended: set[Any] = set()
        for piece in pieces:
            labels = self.groups([piece], start)
            changes = (np.flatnonzero(labels[1:] != labels[:-1]) + 1).tolist()
            used = 0  # of the piece
            for at in changes if labels[0] == current else [0, *changes]:
                if labels[at] in ended:
                    raise DataError(
                        f"{self.shards.name(piece.file)}: episode {labels[at]} goes on at row {piece.first + at} "
                        "(counted from 0) after another began; to differentiate a stream, sort it by episode"
                    )
                if current is not None:
                    ended.add(current)
                current = labels[at]
                complete = count + at - used  # rows of episodes that have ended
                if complete >= self.batch_rows:
                    block = [*waiting, piece.slice(used, at - used)] if at > used else waiting
                    yield Block(start, start + complete, partial(self._derived, block, start, how))
                    waiting, count, start, used = [], 0, start + complete, at
            waiting.append(piece.slice(used, len(piece.rows) - used))
            count += len(piece.rows) - used
        if waiting:
            yield Block(start, start + count, partial(self._derived, waiting, start, how))

    def _derived(self, pieces: list[Piece], start: int, how: Derivation) -> Samples:
        X = self.shards.numbers(pieces, self.state, "state").T
        labels = self.groups(pieces, start)
        begins = np.concatenate([[True], labels[1:] != labels[:-1]])
        codes = np.cumsum(begins) - 1
        stamps = self._stamps(pieces, codes, how)
        demos = Demonstrations(
            np.ascontiguousarray(X),
            np.zeros_like(X),
            codes,
            stamps,
            episode_labels=[str(label) for label in labels[begins]],
        )
        limits = {"gap": how.gap, "max_speed": how.max_speed, "min_duration": how.min_duration}
        try:
            demos = derived(demos, self.shards.name(pieces[0].file), window=how.window, **limits)
        except NothingLeft:  # of this block, which is no more than a part of the recording
            return Samples(X[:0], X[:0], labels[:0])
        # A fragment of a broken episode is an episode of its own; counted from its block's first row, none is twice.
        return Samples(demos.states, demos.actions, start + demos.episodes)

    def _stamps(self, pieces: list[Piece], codes: NDArray[np.int64], how: Derivation) -> Array:
        columns = [self.shards.table(piece, [how.time]).columns[0].values for piece in pieces]
        whole = pa.chunked_array(
            [c for column in columns for c in (column.chunks if hasattr(column, "chunks") else [column])]
        )
        bounds = np.cumsum([0, *(len(piece.rows) for piece in pieces)])

        def place(index: int) -> str:
            which = int(np.searchsorted(bounds, index, side="right")) - 1
            piece = pieces[which]
            return f"row {piece.first + index - bounds[which]} of {self.shards.name(piece.file)} (counted from 0)"

        table = Table(self.shards.shown, [Column(how.time, whole)], place)
        return seconds(table, 0, codes, how.time_unit)[0]


def opened(
    source: Paths,
    state: Keys | None,
    action: Keys | None,
    episode: Key | None,
    time: Key | None,
    batch_rows: int,
    **derivation: Any,
) -> Dataset:
    """The files of `source` with their columns in their roles; see `fit_stream` for what may be given.

    Raises `DataError` for files that cannot be read, and columns that do not exist or are not given.
    """
    robot = lerobot.opened(source) if isinstance(source, str | os.PathLike) else None
    shards = robot.shards if robot else Shards.find(source)
    table, schema = shards.first_rows()
    restarts = False
    if robot:
        state = lerobot.STATE if state is None else state
        action = lerobot.ACTION if action is None else action
        episode = lerobot.EPISODE if episode is None else episode
        time = lerobot.TIME if time is None else time
    elif state is None:
        roles = saved.roles(schema)
        if roles is None:
            raise DataError(f"{shards.shown}: give state=, the columns that are states; {table.listing()}")
        state, action = roles["states"], roles["actions"] if action is None else action
        episode, time = roles["episodes"], roles.get("time", time)
        restarts = len(shards.paths) > 1  # each file counts its episodes from 0
    fields = partial(_fields, table, robot)
    differentiated = action is None or action == DIFFERENTIATE
    if differentiated and time is None:
        raise DataError(
            f"{shards.shown}: give action=, or time= so that the states can be differentiated; {table.listing()}"
        )
    found = Dataset(
        shards,
        fields("state", state),
        () if differentiated else fields("action", action),
        None if episode is None else _whole_column(table, "episode", episode),
        batch_rows,
        restarts,
    )
    if not differentiated:
        return found
    assert time is not None
    return replace(found, action=Derivation(_whole_column(table, "time", time), **derivation))


def _fields(table: Table, robot: lerobot.LeRobot | None, role: str, keys: Any) -> tuple[Field, ...]:
    each = [keys] if isinstance(keys, str | int) else list(keys)
    own = {"state": lerobot.STATE, "action": lerobot.ACTION}[role]
    names = robot.component_names(own) if robot else []
    known = {column.name for column in table.columns} | {column.part_of for column in table.columns}
    fields: list[Field] = []
    for key in each:
        if isinstance(key, str) and key not in known and key in names:
            key = f"{own}[{names.index(key)}]"
        for position in table.find(role, key):
            column = table.columns[position]
            component = int(column.name[len(column.part_of) + 1 : -1]) if column.part_of else None
            fields.append(Field(column.part_of or column.name, component))
    if not fields:
        raise DataError(f"no {role} columns were given for {table.path}; {table.listing()}")
    return tuple(fields)


def _whole_column(table: Table, role: str, key: Any) -> str:
    positions = table.find(role, key)
    column = table.columns[positions[0]]
    if len(positions) > 1 or column.part_of:
        raise DataError(f"{table.path}: {role} takes one column, but {key!r} is a column of lists")
    return column.name
