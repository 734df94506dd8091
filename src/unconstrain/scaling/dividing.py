"""Dividing recordings into parts, each of which a task of a cluster adds up."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from unconstrain.errors import DataError
from unconstrain.fitting.solve import EpisodeFolds
from unconstrain.recordings.tables import Tables

PARTS_PER_THREAD, MOST_PARTS_PER_THREAD = 4, 16
"""So that a slow worker, or one that is lost, holds up little: the more, the less all wait for the last one to end."""

ENOUGH_ROWS = 1_000_000
"""Of a part, beyond the fewest parts a thread: smaller ones would keep the scheduler busy and no worker."""

MOST_PARTS = 10_000
"""Beyond the fewest parts a thread: so many keep the scheduler busy for a few seconds."""

LEAST_ROWS = 8192
"""Of a part by itself, which takes some milliseconds to begin with."""

GROUPS_PER_THREAD = 3
"""Where there are as many row groups, parts are whole ones: what lies before a part in its row group is decoded too.
Up to two tasks a thread Dask sends to the worker that holds what they need, until others steal them."""


@dataclass(frozen=True)
class Part:
    """Rows `start` to `stop`, and the folds of the episodes in them; None where episodes are dealt out on the spot.

    Those are dealt out after `n_before` of other parts, once it is known how many there are.
    """

    start: int
    stop: int
    fold_of: dict[Any, int] | None
    n_before: int | None = None

    def __dask_tokenize__(self) -> tuple[int, int]:
        # Dask tells graphs apart by a digest of all they hold. Their keys do that already.
        return self.start, self.stop


def rows_of_part(source: Tables, threads: int) -> int:
    """Decide how many rows a task should add up, at least, to keep so many threads busy."""
    fewest = PARTS_PER_THREAD * threads
    most = min(MOST_PARTS_PER_THREAD * threads, max(MOST_PARTS, fewest))
    wanted = min(-(-source.n_rows // fewest), max(-(-source.n_rows // most), ENOUGH_ROWS))
    groups = source.row_groups
    return wanted if len(groups) < GROUPS_PER_THREAD * threads else max(wanted, max(groups) // 2 + 1)


def divide(source: Tables, rows: int, folds: EpisodeFolds | None) -> Iterator[Part]:
    """Divide a source into parts, with the folds of their episodes, which are dealt out here.

    Parameters
    ----------
    source : Tables
        What is to be read.
    rows : int
        Rows in a part, at least.
    folds : EpisodeFolds or None
        Folds that deal episodes out; None where λ is a number.

    Yields
    ------
    Part
        In the order of the rows.
    """
    if source.whole_episodes_for or source.relabels:
        bounds = list(_episode_starts(source, rows))
        for start, stop in zip(bounds, [*bounds[1:], source.n_rows], strict=True):
            # Fragments of episodes are known, and dealt out, only once samples are prepared.
            dealt = None if folds is None or source.relabels else _folds_of(source, start, stop, folds)
            yield Part(start, stop, dealt)
        return
    if source.is_along_episodes:
        bounds = list(_run_starts(source, rows))
        for start, stop in zip(bounds, [*bounds[1:], source.n_rows], strict=True):
            yield Part(start, stop, None if folds is None else _folds_of(source, start, stop, folds))
        return
    ends = np.cumsum(source.row_groups)
    start = 0
    for end in (int(end) for end in ends):
        # Row groups are decoded as a whole, so parts end with one, unless one alone is many parts long.
        cuts = [start + rows * i for i in range(1, (end - start) // rows)] if end - start >= 2 * rows else []
        if end - start >= rows or end == source.n_rows:
            for stop in (*cuts, end):
                if stop > start:
                    yield Part(start, stop, None if folds is None else _folds_of(source, start, stop, folds))
                    start = stop


def _folds_of(source: Tables, start: int, stop: int, folds: EpisodeFolds) -> dict[Any, int]:
    own: dict[Any, int] = {}
    for labels, _ in source.labels(start, stop):
        fold = folds.assign(labels, len(labels))
        firsts = np.concatenate([[True], labels[1:] != labels[:-1]])
        own.update(zip(labels[firsts].tolist(), fold[firsts].tolist(), strict=True))
    return own


def _run_starts(source: Tables, rows: int) -> Iterator[int]:
    """Where parts begin that have `rows` rows or more, and end with samples of an episode that follow each other."""
    yield 0
    before: Any = None
    last = 0
    for labels, start in source.labels(0, source.n_rows):
        firsts = start + np.flatnonzero(np.concatenate([[labels[0] != before], labels[1:] != labels[:-1]]))
        before = labels[-1]
        while len(firsts := firsts[firsts >= last + rows]):
            last = int(firsts[0])
            yield last


def _episode_starts(source: Tables, rows: int) -> Iterator[int]:
    """Where parts of whole episodes begin; the episodes in between have `rows` rows or more."""
    yield 0
    current: Any = None
    here: set[Any] = set()  # episodes of the part at hand
    gone: set[Any] = set()  # those of earlier parts
    last = 0
    for labels, start in source.labels(0, source.n_rows, whole=True):
        firsts = np.flatnonzero(np.concatenate([[labels[0] != current], labels[1:] != labels[:-1]]))
        for at in firsts.tolist():
            current = labels[at]
            if start + at - last >= rows and current not in here:
                last = start + at
                gone |= here
                here = set()
                yield last
            if current in gone:
                raise DataError(
                    f"episode {current} goes on at row {start + at} (counted from 0 over all files) after others were "
                    f"read; to {source.whole_episodes_for or 'divide'} the data, sort them by episode"
                )
            here.add(current)
