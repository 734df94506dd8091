"""A stream of arrays: any iterable of `(X, U)`, `(X, U, groups)` or `(X, U, groups, projections)`."""

import hashlib
from collections.abc import Callable, Generator, Iterable, Iterator
from copy import copy
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.arrays import check_actions, check_finite, check_groups, check_numbers, check_projections
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
from unconstrain.samples import Samples

FORMS = "(X, U), (X, U, groups) or (X, U, groups, projections)"


class Batches:
    """Samples from batches of any size.

    Parameters
    ----------
    given : iterable, or function without arguments that returns one
        Of batches. A function, and anything that can be iterated anew such as a list, can be read more than once; an
        iterator cannot.
    min_speed : float, optional
        Samples with an action shorter than this are left out.
    """

    relabels = False
    whole_episodes_for = None
    row_groups = None
    n_rows = None
    noise = None

    def __init__(self, given: Iterable | Callable[[], Iterable], *, min_speed: float | None = None) -> None:
        self._given, self._min_speed = given, min_speed
        self.is_along_episodes = False
        self._held: list[Samples] = []  # what was read of an iterator before its time
        self._rest: Iterator[Samples] | None = None
        self.repeatable = callable(given) or not isinstance(given, Iterator)
        first = next(self._batches(), None)
        if first is None:
            raise DataError("the source has no samples: give at least one batch (X, U)")
        if not self.repeatable:
            self._held.append(first)
        self._first = first
        self.scalar_actions = self._scalar
        self.knows_projections = first.projections is not None

    @property
    def shape(self) -> tuple[int, int]:
        """The numbers of state and action dimensions."""
        return self._first.states.shape[1], self._first.actions.shape[1]

    @property
    def space(self) -> None:
        """None: arrays do not say what states are."""
        return

    def along_episodes(self) -> "Batches":
        """Return the same source, in whose blocks no samples of an episode that follow each other are torn apart.

        An episode goes on in the next batch where that begins with the label that the one before ended with.
        """
        other = copy(self)
        other.is_along_episodes = True
        return other

    def head(self) -> tuple[Array, Array]:
        """Return states (N, n) and actions (N, d) of the first batch."""
        return self._first.states, self._first.actions

    def sample(self, n_rows: int, random_state: int | None) -> tuple[Array, Array]:
        """Return the first `n_rows` rows: no one can say what an iterator will still bring."""
        taken: list[Samples] = []
        count = 0
        for batch in self._batches() if self.repeatable else chain(list(self._held), self._remaining()):
            if not self.repeatable and len(taken) >= len(self._held):
                self._held.append(batch)
            taken.append(batch)
            count += len(batch.states)
            if count >= n_rows:
                break
        X = np.concatenate([batch.states for batch in taken])[:n_rows]
        U = np.concatenate([batch.actions for batch in taken])[:n_rows]
        return X, U

    def blocks(
        self, batch_rows: int, start: int = 0, stop: int | None = None
    ) -> Generator[Block, None, None]:
        """Read blocks from row `start`, where an earlier block ended.

        They have `batch_rows` samples, or along episodes at least as many.
        """
        waiting: list[Samples] = []
        count, position = 0, 0
        last: Any = None  # label of the sample before
        for batch in self._from_the_beginning():
            if position < start:  # read before
                skipped = min(len(batch.states), start - position)
                position += skipped
                batch = _rows(batch, slice(skipped, None))
            while len(batch.states):
                cut = max(batch_rows - count, 0)
                if self.is_along_episodes and batch.groups is not None:
                    begins = np.concatenate(
                        [[batch.groups[0] != last], batch.groups[1:] != batch.groups[:-1]]
                    )
                    later = np.flatnonzero(begins[cut:])
                    cut = cut + int(later[0]) if len(later) else len(batch.states) + 1
                taken, ends = _rows(batch, slice(cut)), cut <= len(batch.states)
                if len(taken.states):
                    waiting.append(taken)
                    count += len(taken.states)
                    last = None if taken.groups is None else taken.groups[-1]
                batch = _rows(batch, slice(cut, None))
                if ends and count:
                    yield Block(position, position + count, partial(self._load, waiting))
                    waiting, position, count = [], position + count, 0
        if position < start:
            raise DataError(
                f"the source has {position} rows now, but {start} were read of it before: start anew, without the "
                "checkpoint"
            )
        if count:
            yield Block(position, position + count, partial(self._load, waiting))

    def labels(self, start: int, stop: int, *, whole: bool = False) -> Iterator[tuple[NDArray[Any], int]]:
        """Refuse: rows of batches are read once, all of them."""
        raise DataError("batches of arrays cannot be divided: give files")

    def read_all(self, batch_rows: int | None) -> Iterator[Loaded]:
        """Read everything there is, in blocks, or with None a batch at a time."""
        blocks = (
            (Block(0, 0, partial(self._load, [batch])) for batch in self._from_the_beginning())
            if batch_rows is None
            else self.blocks(batch_rows)
        )
        for block in blocks:
            loaded = block.load()
            samples, U = loaded.samples, loaded.samples.actions
            groups, names = np.zeros(len(U), dtype=np.int64), [0]
            if samples.groups is not None:
                groups, names = number_values(samples.groups)
            yield replace(
                loaded,
                samples=samples._replace(groups=groups),
                episodes=tuple(Episode((name,), str(name)) for name in names),
                motion=loaded.motion or Motion.of(U),
            )

    def identity(self) -> str:
        """Say what tells this source from another: a digest of the first batch."""
        digest = hashlib.blake2b(digest_size=16)
        for array in (self._first.states, self._first.actions, self._first.projections):
            if array is not None:
                digest.update(f"{array.dtype} {array.shape}".encode())
                digest.update(np.ascontiguousarray(array).data)
        return f"batches that begin with {digest.hexdigest()}, {self._min_speed}"

    def _from_the_beginning(self) -> Iterator[Samples]:
        return self._batches() if self.repeatable else chain(self._drained(), self._remaining())

    def _remaining(self) -> Iterator[Samples]:
        assert self._rest is not None
        return self._rest

    def _drained(self) -> Iterator[Samples]:
        while self._held:
            yield self._held.pop(0)

    def _batches(self) -> Iterator[Samples]:
        """Return the batches, checked; of an iterator those to come."""
        given: Any = self._given() if callable(self._given) else self._given
        checked = self._checked(given)
        if not self.repeatable:
            self._rest = checked
        return checked

    def _checked(self, given: Iterable) -> Iterator[Samples]:
        shape: tuple[int, int] | None = None
        known: bool | None = None  # whether the first batch has projections
        labelled: bool | None = None  # whether it has groups
        for i, item in enumerate(given):
            if not isinstance(item, tuple | list) or len(item) not in (2, 3, 4):
                raise DataError(f"batch {i} (counted from 0) must be {FORMS}")
            X = check_numbers(item[0], f"X of batch {i}")
            U = check_actions(item[1], f"U of batch {i}")
            if X.ndim != 2 or len(X) != len(U):
                raise DataError(
                    f"batch {i} (counted from 0) must hold X (N, n) and U (N, d), got shapes {X.shape} and {U.shape}"
                )
            check_finite(X, f"X of batch {i}")
            if not len(X):
                continue
            if shape is None:
                shape, self._scalar = (X.shape[1], U.shape[1]), np.ndim(item[1]) == 1
            if (X.shape[1], U.shape[1]) != shape:
                raise DataError(
                    f"batch {i} (counted from 0) has {X.shape[1]} state and {U.shape[1]} action dimensions, where "
                    f"the first has {shape[0]} and {shape[1]}"
                )
            N = item[3] if len(item) == 4 else None
            if known is None:
                known = N is not None
            if (N is not None) != known:
                has, first = ("no projections", "has some") if known else ("projections", "has none")
                raise DataError(
                    f"batch {i} (counted from 0) has {has} but the first {first}: give them for all, NaN where they "
                    "are not known, or for none"
                )
            groups = check_groups(item[2] if len(item) > 2 else None, len(X))
            labelled = groups is not None if labelled is None else labelled
            if labelled != (groups is not None):
                raise DataError("some batches have groups and some do not: give them for all, or for none")
            yield Samples(
                X,
                U,
                groups,
                None if N is None else self._projections(N, U, i),
            )

    def _projections(self, given: Any, U: Array, i: int) -> Array:
        try:
            return check_projections(given, *U.shape, unknown=True)
        except DataError as error:
            raise DataError(f"batch {i} (counted from 0): {error}") from None

    def _load(self, batches: list[Samples]) -> Loaded:
        loaded = Loaded(_joined(batches))
        return loaded if self._min_speed is None else leave_out_slow(loaded, self._min_speed)


def _rows(batch: Samples, rows: slice) -> Samples:
    X, U, groups, N = batch[:4]
    return Samples(X[rows], U[rows], *(None if array is None else array[rows] for array in (groups, N)))


def _joined(batches: list[Samples]) -> Samples:
    if len(batches) == 1:
        return batches[0]
    labels = [batch.groups for batch in batches if batch.groups is not None]
    known = [batch.projections for batch in batches if batch.projections is not None]
    return Samples(
        np.concatenate([batch.states for batch in batches]),
        np.concatenate([batch.actions for batch in batches]),
        np.concatenate(labels) if labels else None,
        np.concatenate(known) if known else None,
    )
