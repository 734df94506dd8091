"""A stream of arrays: any iterable of `(X, U)`, `(X, U, groups)` or `(X, U, groups, projections)`."""

from collections.abc import Callable, Generator, Iterable, Iterator
from functools import partial
from itertools import chain
from typing import Any

import joblib
import numpy as np

from unconstrain.arrays import check_actions, check_finite, check_groups, check_numbers, check_projections
from unconstrain.errors import DataError
from unconstrain.recordings.blocks import Array, Block
from unconstrain.samples import Samples

FORMS = "(X, U), (X, U, groups) or (X, U, groups, projections)"


class Batches:
    """Blocks of `batch_rows` samples from batches of any size.

    given: an iterable of `(X, U)`, `(X, U, groups)` or `(X, U, groups, projections)`, or a function without arguments
        that returns one. A function, and anything that can be iterated anew such as a list, can be read more than
        once; an iterator cannot.
    """

    def __init__(self, given: Iterable | Callable[[], Iterable], batch_rows: int):
        self._given, self._batch_rows = given, batch_rows
        self._held: list[Samples] = []  # what was read of an iterator before its time
        self._rest: Iterator[Samples] | None = None
        self.n_rows: int | None = None
        self.repeatable = callable(given) or not isinstance(given, Iterator)
        first = next(self._batches(), None)
        if first is None:
            raise DataError("the source has no samples: give at least one batch (X, U)")
        if not self.repeatable:
            self._held.append(first)
        self._first = first
        self.scalar_actions = self._scalar
        self.tells_constraints = first.projections is not None

    def head(self) -> tuple[Array, Array]:
        return self._first[0], self._first[1]

    def sample(self, n_rows: int, random_state: int | None) -> tuple[Array, Array]:
        """The first `n_rows` rows: no one can say what an iterator will still bring."""
        taken: list[Samples] = []
        count = 0
        for batch in self._batches() if self.repeatable else chain(list(self._held), self._remaining()):
            if not self.repeatable and len(taken) >= len(self._held):
                self._held.append(batch)
            taken.append(batch)
            count += len(batch[0])
            if count >= n_rows:
                break
        X, U = (np.concatenate([batch[i] for batch in taken])[:n_rows] for i in (0, 1))
        return X, U

    def blocks(self, start: int = 0, stop: int | None = None) -> Generator[Block, None, None]:
        batches: Iterator[Samples] = (
            self._batches() if self.repeatable else chain(self._drained(), self._remaining())
        )
        waiting: list[Samples] = []
        count, position = 0, 0
        for batch in batches:
            if position < start:  # read before
                skipped = min(len(batch[0]), start - position)
                position += skipped
                batch = _rows(batch, slice(skipped, None))
            while len(batch[0]):
                taken = _rows(batch, slice(self._batch_rows - count))
                batch = _rows(batch, slice(self._batch_rows - count, None))
                waiting.append(taken)
                count += len(taken[0])
                if count == self._batch_rows:
                    yield Block(position, position + count, partial(_joined, waiting))
                    waiting, position, count = [], position + count, 0
        if position < start:
            raise DataError(
                f"the source has {position} rows now, but {start} were read of it before: start anew, without the "
                "checkpoint"
            )
        if count:
            yield Block(position, position + count, partial(_joined, waiting))

    def identity(self) -> str:
        first = (self._first.states, self._first.actions, self._first.projections)
        return f"batches that begin with {joblib.hash([np.ascontiguousarray(a) for a in first if a is not None])}"

    def _remaining(self) -> Iterator[Samples]:
        assert self._rest is not None
        return self._rest

    def _drained(self) -> Iterator[Samples]:
        while self._held:
            yield self._held.pop(0)

    def _batches(self) -> Iterator[Samples]:
        """The batches, checked; of an iterator those to come."""
        given: Any = self._given() if callable(self._given) else self._given
        checked = self._checked(given)
        if not self.repeatable:
            self._rest = checked
        return checked

    def _checked(self, given: Iterable) -> Iterator[Samples]:
        try:
            numbered = enumerate(iter(given))
        except TypeError:
            raise DataError(
                f"source must be a Parquet file or folder, or an iterable of {FORMS}, got {given!r:.80}"
            ) from None
        shape: tuple[int, int] | None = None
        known: bool | None = None  # whether the first batch has projections
        for i, item in numbered:
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
            yield Samples(
                X,
                U,
                check_groups(item[2] if len(item) > 2 else None, len(X)),
                None if N is None else self._projections(N, U, i),
            )

    def _projections(self, given: Any, U: Array, i: int) -> Array:
        try:
            return check_projections(given, *U.shape, unknown=True)
        except DataError as error:
            raise DataError(f"batch {i} (counted from 0): {error}") from None


def _rows(batch: Samples, rows: slice) -> Samples:
    X, U, *others = batch
    return Samples(X[rows], U[rows], *(None if array is None else array[rows] for array in others))


def _joined(batches: list[Samples]) -> Samples:
    if len(batches) == 1:
        return batches[0]
    labels = [batch.groups for batch in batches if batch.groups is not None]
    if labels and len(labels) < len(batches):
        raise DataError("some batches have groups and some do not: give them for all, or for none")
    known = [batch.projections for batch in batches if batch.projections is not None]
    return Samples(
        np.concatenate([batch.states for batch in batches]),
        np.concatenate([batch.actions for batch in batches]),
        np.concatenate(labels) if labels else None,
        np.concatenate(known) if known else None,
    )
