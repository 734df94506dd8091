"""The pass over a stream on a Dask cluster: workers turn parts of the data into moments, and only these travel.

A part is a run of row groups (of whole episodes, where states are differentiated or forces filtered). Its moments are
P² + P numbers a fold, whatever its size; pairs of neighbours are added until one is left, on the workers. Which fold an
episode belongs to is decided before, by a pass over the episode column alone, so that it is the fold `fit_stream` puts
it in.
"""

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from unconstrain.errors import DataError, UnconstrainError
from unconstrain.fitting.accumulator import Accumulator
from unconstrain.fitting.solve import EpisodeFolds
from unconstrain.policies.base import Policy
from unconstrain.progress import Report, reporting
from unconstrain.recordings.dataset import Dataset
from unconstrain.recordings.reading import Reading
from unconstrain.recordings.roles import Keys
from unconstrain.recordings.table import Key
from unconstrain.scaling.connection import as_finished, connected
from unconstrain.scaling.stream import BATCH_ROWS, SAMPLE_ROWS, begin, deal, finish, open_source

__all__ = ["connected", "fit"]

PARTS_PER_THREAD = 4  # so that a slow worker, or one that is lost, holds up little


@dataclass(frozen=True)
class Part:
    """Rows `start` to `stop`, and the folds of the episodes in them; None where episodes are dealt out on the spot."""

    start: int
    stop: int
    fold_of: dict[Any, int] | None


def fit(
    policy: Policy,
    source: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    client: Any,
    *,
    state: Keys | None = None,
    action: Keys | None = None,
    episode: Key | None = None,
    time: Key | None = None,
    projections: Keys | None = None,
    force: Keys | None = None,
    force_threshold: float | None = None,
    free: Key | None = None,
    time_unit: str | None = None,
    window: float = 0.2,
    gap: float | None = None,
    max_speed: float | None = None,
    min_duration: float | None = None,
    partial: bool = False,
    progress: bool | Report | None = None,
    batch_rows: int = BATCH_ROWS,
    sample_rows: int = SAMPLE_ROWS,
    part_rows: int | None = None,
    random_state: int | None = 0,
):
    """Fit a policy to files that the workers of a Dask cluster read. Returns the policy, fitted.

    The result is that of `fit_stream`, to rounding, however the data are divided and whoever computes what. The
    work of a worker that is lost is done again by others.

    client: a `distributed.Client`; see `connected`. The files must be visible to the workers and to this process,
        under the same paths.
    part_rows: how many rows, at least, a task adds up; by default as many as make four tasks a thread.

    All else as for `fit_stream`. Raises what it raises, and `UnconstrainError` where the cluster fails.
    """
    reading = Reading(
        state=state, action=action, episode=episode, time=time, projections=projections, force=force,
        force_threshold=force_threshold, free=free, time_unit=time_unit, window=window, gap=gap, max_speed=max_speed,
        min_duration=min_duration,
    )  # fmt: skip
    opened = open_source(policy, source, reading, batch_rows)
    if not isinstance(opened, Dataset):
        raise DataError("a cluster learns from files: give a Parquet file or folder, or use fit_stream")
    accumulator = begin(policy, opened, sample_rows, random_state, partial=partial)
    threads = max(sum(client.nthreads().values()), 1)
    rows = part_rows or max(batch_rows, -(-opened.n_rows // (PARTS_PER_THREAD * threads)))
    parts = list(divided(opened, rows, accumulator.folds))
    with reporting(progress) as report:
        added = _added_up(client, accumulator.empty(), opened, parts, report)
        if added.total.misjudged:
            again = accumulator.empty(longest=added.total.longest)
            added = _added_up(client, again, opened, parts, report)
    accumulator.merge(added)
    return finish(policy, accumulator, opened)


def divided(source: Dataset, rows: int, folds: EpisodeFolds | None) -> Iterator[Part]:
    """The parts of a source, of `rows` rows or more, with the folds of their episodes, which are dealt out here."""
    if source.needs_whole_episodes:
        bounds = list(_episode_starts(source, rows))
        for start, stop in zip(bounds, [*bounds[1:], source.n_rows], strict=True):
            # Fragments of episodes that are differentiated are known, and dealt out, only once they are.
            dealt = None if folds is None or source.differentiates else _folds_of(source, start, stop, folds)
            yield Part(start, stop, dealt)
        return
    ends = np.cumsum([size for file in source.shards.row_groups for size in file])
    start = 0
    for end in (int(end) for end in ends):
        # Row groups are decoded as a whole, so parts end with one, unless one alone is many parts long.
        cuts = [start + rows * i for i in range(1, (end - start) // rows)] if end - start >= 2 * rows else []
        if end - start >= rows or end == source.n_rows:
            for stop in (*cuts, end):
                if stop > start:
                    yield Part(start, stop, None if folds is None else _folds_of(source, start, stop, folds))
                    start = stop


def _folds_of(source: Dataset, start: int, stop: int, folds: EpisodeFolds) -> dict[Any, int]:
    own: dict[Any, int] = {}
    for labels, _ in source.labels(start, stop):
        fold = folds.assign(labels, len(labels))
        firsts = np.concatenate([[True], labels[1:] != labels[:-1]])
        own.update(zip(labels[firsts].tolist(), fold[firsts].tolist(), strict=True))
    return own


def _episode_starts(source: Dataset, rows: int) -> Iterator[int]:
    """Where parts of whole episodes begin; the episodes in between have `rows` rows or more."""
    yield 0
    current: Any = None
    ended: set[Any] = set()
    last = 0
    for labels, start in source.labels(0, source.n_rows, whole=True):
        firsts = np.flatnonzero(np.concatenate([[labels[0] != current], labels[1:] != labels[:-1]]))
        for at in firsts.tolist():
            if labels[at] in ended:
                raise DataError(
                    f"{source.shards.shown}: episode {labels[at]} goes on at row {start + at} (counted from 0 over all "
                    f"files) after another began; to {source.needs_whole_episodes} the data, sort them by episode"
                )
            if current is not None:
                ended.add(current)
            current = labels[at]
            if start + at - last >= rows:
                last = start + at
                yield last


def _added_up(
    client: Any, empty: Accumulator, source: Dataset, parts: list[Part], report: Report
) -> Accumulator:
    import distributed

    shards = replace(source.shards, threads=False)  # the cluster's tasks are its threads
    # A task, not scattered data: what a lost worker held of it can then be made again.
    setup = client.submit(_setup, empty, replace(source, shards=shards), pure=False)
    level = [client.submit(_sum_of_part, setup, part, pure=False) for part in parts]
    rows = {future.key: part.stop - part.start for future, part in zip(level, parts, strict=True)}
    left = list(level)
    while len(level) > 1:
        pairs = [
            client.submit(_sum_of_two, a, b, pure=False)
            for a, b in zip(level[::2], level[1::2], strict=False)
        ]
        level = pairs + level[len(level) - len(level) % 2 :]
    (total,) = level
    done = 0
    report(0, source.n_rows)
    try:
        for future in as_finished(client, list(left)):
            if future.status == "error":
                break
            left.remove(future)
            done += rows[future.key]
            if future is not total:
                future.release()
            report(done, source.n_rows)
        for _ in as_finished(client, [total]):
            pass
        return total.result()
    except distributed.KilledWorker as error:
        raise UnconstrainError(
            "the cluster gave up on a part after several workers died on it, mostly for want of memory: give the "
            "workers more, or learn with fewer features or smaller batch_rows"
        ) from error
    finally:
        if client.status == "running":  # else there is nobody to tell
            client.cancel([total, *left])


def _setup(empty: Accumulator, source: Dataset) -> tuple[Accumulator, Dataset]:
    return empty, source


def _sum_of_part(setup: tuple[Accumulator, Dataset], part: Part) -> Accumulator:
    empty, source = setup
    accumulator = empty.empty(part.fold_of)
    with threadpool_limits(1, user_api="blas"):
        for block in source.blocks(part.start, part.stop):
            samples = block.load()
            accumulator.include(accumulator.sums(samples, deal(accumulator, samples)))
    return accumulator.without_labels()


def _sum_of_two(a: Accumulator, b: Accumulator) -> Accumulator:
    total = a.copy()  # what a task returned may be needed again
    total.merge(b)
    return total
