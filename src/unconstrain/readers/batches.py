"""A stream of arrays: any iterable of `(X, U)` or `(X, U, groups)`."""

from collections.abc import Callable, Generator, Iterable, Iterator
from functools import partial
from itertools import chain
from typing import Any

import joblib
import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.readers.blocks import Array, Block, Samples
from unconstrain.validation import check_actions, check_finite, check_groups

Batch = tuple[Array, Array, NDArray[Any] | None]


class Batches:
    """Blocks of `batch_rows` samples from batches of any size.

    given: an iterable of `(X, U)` or `(X, U, groups)`, or a function without arguments that returns one. A function,
        and anything that can be iterated anew such as a list, can be read more than once; an iterator cannot.
    """

    def __init__(self, given: Iterable | Callable[[], Iterable], batch_rows: int):
        self._given, self._batch_rows = given, batch_rows
        self._held: list[Batch] = []  # what was read of an iterator before its time
        self._rest: Iterator[Batch] | None = None
        self.n_rows: int | None = None
        self.repeatable = callable(given) or not isinstance(given, Iterator)
        first = next(self._batches(), None)
        if first is None:
            raise DataError("the source has no samples: give at least one batch (X, U)")
        if not self.repeatable:
            self._held.append(first)
        self._first = first
        self.scalar_actions = self._scalar

    def head(self) -> tuple[Array, Array]:
        return self._first[0], self._first[1]

    def sample(self, n_rows: int, random_state: int | None) -> tuple[Array, Array]:
        """The first `n_rows` rows: no one can say what an iterator will still bring."""
        taken: list[Batch] = []
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
        batches: Iterator[Batch] = (
            self._batches() if self.repeatable else chain(self._drained(), self._remaining())
        )
        waiting: list[Batch] = []
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
        return f"batches that begin with {joblib.hash([np.ascontiguousarray(a) for a in self._first[:2]])}"

    def _remaining(self) -> Iterator[Batch]:
        assert self._rest is not None
        return self._rest

    def _drained(self) -> Iterator[Batch]:
        while self._held:
            yield self._held.pop(0)

    def _batches(self) -> Iterator[Batch]:
        """The batches, checked; of an iterator those to come."""
        given: Any = self._given() if callable(self._given) else self._given
        checked = self._checked(given)
        if not self.repeatable:
            self._rest = checked
        return checked

    def _checked(self, given: Iterable) -> Iterator[Batch]:
        try:
            numbered = enumerate(iter(given))
        except TypeError:
            raise DataError(
                f"source must be a Parquet file or folder, or an iterable of (X, U, groups), got {given!r:.80}"
            ) from None
        shape: tuple[int, int] | None = None
        for i, item in numbered:
            if not isinstance(item, tuple | list) or len(item) not in (2, 3):
                raise DataError(f"batch {i} (counted from 0) must be (X, U) or (X, U, groups)")
            X = np.asarray(item[0], dtype=np.float64)
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
            yield X, U, check_groups(item[2] if len(item) == 3 else None, len(X))


def _rows(batch: Batch, rows: slice) -> Batch:
    X, U, groups = batch
    return X[rows], U[rows], None if groups is None else groups[rows]


def _joined(batches: list[Batch]) -> Samples:
    if len(batches) == 1:
        return Samples(*batches[0])
    groups = [batch[2] for batch in batches]
    labels = [each for each in groups if each is not None]
    if labels and len(labels) < len(groups):
        raise DataError("some batches have groups and some do not: give them for all, or for none")
    return Samples(
        np.concatenate([batch[0] for batch in batches]),
        np.concatenate([batch[1] for batch in batches]),
        np.concatenate(labels) if labels else None,
    )
