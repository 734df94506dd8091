"""Passes over a stream on a Dask cluster: workers turn parts of the data into moments, and only these travel.

A part is a run of row groups (of whole episodes, where contact is inferred, states are differentiated or forces
filtered). Its moments are P² + P numbers a fold, whatever its size; pairs of neighbours are added until one is left, on
the workers. Which fold an episode belongs to is decided before, by a pass over the episode column alone, so that it is
the fold `fit_stream` puts it in. Data are divided once, however many passes it takes to infer contact.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from unconstrain.errors import DataError, UnconstrainError
from unconstrain.fitting.accumulator import Accumulator
from unconstrain.fitting.inference import Inference
from unconstrain.fitting.solve import EpisodeFolds
from unconstrain.progress import Report, reporting
from unconstrain.progress import begin as begin_pass
from unconstrain.recordings.notes import Note, combine
from unconstrain.recordings.source import BATCH_ROWS, Openable
from unconstrain.recordings.tables import Tables
from unconstrain.scaling.connection import as_finished, connected
from unconstrain.scaling.dividing import LEAST_ROWS, Part, divide, rows_of_part
from unconstrain.scaling.stream import (
    SAMPLE_ROWS,
    PolicyT,
    begin,
    check_enough,
    check_episodes,
    deal,
    finish,
    open_for,
    source_for,
    to_learn_from,
)
from unconstrain.scaling.tree import plant

__all__ = ["connected", "fit"]

LARGEST_GRAPH = "2 GiB"


@dataclass(frozen=True)
class Added:
    """What consecutive parts add, what was found in them, and how many episodes each of them dealt out."""

    accumulator: Accumulator
    notes: tuple[Note, ...] = ()
    dealt: tuple[int, ...] = ()

    def __sizeof__(self) -> int:
        # Dask adds sums up where they are, if it knows how large they are.
        return self.accumulator.total.nbytes


@dataclass(frozen=True)
class Setup:
    """What all parts have in common: what they are added to, where they are read from, and how many rows at a time."""

    empty: Accumulator
    source: Tables
    batch_rows: int

    def __dask_tokenize__(self) -> int:
        return self.batch_rows


def fit(
    policy: PolicyT,
    recordings: Openable,
    client: Any,
    *,
    partial: bool = False,
    progress: bool | Report | None = None,
    batch_rows: int = BATCH_ROWS,
    sample_rows: int = SAMPLE_ROWS,
    part_rows: int | None = None,
    random_state: int | None = 0,
) -> PolicyT:
    """Fit a policy to files that the workers of a Dask cluster read.

    The result is that of `fit_stream`, to rounding, however the data are divided and whoever computes what. The
    work of a worker that is lost is done again by others.

    Parameters
    ----------
    policy : ParametricPolicy or LocallyLinearPolicy
        Fitted in place.
    recordings : Recordings
        As `unconstrain.open` returns them, or what it takes without options. The files must be visible to the workers
        and to this process, under the same paths.
    client : distributed.Client
        See `connected`.
    partial : bool
        Go on with a policy that is fitted already, instead of starting anew.
    progress : bool or callable, optional
        True shows a bar with rows, rate and time left; a function is called with rows done and rows in all.
    batch_rows : int
        How many samples, at most, are added up at a time.
    sample_rows : int
        On how many rows centres and other features that depend on the data are placed.
    part_rows : int, optional
        How many rows, at least, a task adds up; by default as many as make 4 to 16 tasks a thread.
    random_state : int, optional
        Of the sample of rows.

    Returns
    -------
    policy
        Fitted.

    Raises
    ------
    UnconstrainError
        As `fit_stream` does, and where the cluster fails.
    """
    opened = open_for(policy, recordings, batch_rows)
    if not isinstance(opened.source, Tables):
        raise DataError("a cluster learns from files: give a Parquet file or folder, or use fit_stream")
    source = source_for(policy, opened.source, partial=partial)
    assert isinstance(source, Tables)
    check_episodes(policy, source, partial=partial)
    accumulator = begin(policy, source, sample_rows, random_state, partial=partial)
    threads = max(sum(client.nthreads().values()), 1)
    rows = part_rows or max(min(batch_rows, LEAST_ROWS), rows_of_part(source, threads))
    parts = list(divide(source, rows, accumulator.folds))
    with reporting(progress) as report:

        def add_up(empty: Accumulator, parts: list[Part]) -> Added:
            return _added_up(client, empty, source, batch_rows, parts, report)

        if accumulator.risk == "adaptive" and accumulator.belief is None:
            return finish(policy, *_inferred(accumulator, parts, add_up, report), opened)
        added = add_up(accumulator.empty(), parts)
        if added.accumulator.total.misjudged:
            added = add_up(accumulator.empty(longest=added.accumulator.total.longest), parts)
    accumulator.merge(added.accumulator)
    return finish(policy, accumulator, added.notes, opened)


def _inferred(
    blank: Accumulator, parts: list[Part], add_up: Callable[[Accumulator, list[Part]], Added], report: Report
) -> tuple[Accumulator, tuple[Note, ...]]:
    """Infer contact in as many passes as it takes; `blank` has the folds of the parts' episodes."""
    inference = Inference(blank)
    notes: tuple[Note, ...] = ()
    while (wanted := inference.next_pass()) is not None:
        begin_pass(report, inference.description)
        added = add_up(wanted, parts)
        check_enough(added.accumulator.total)
        wanted.merge(added.accumulator)
        if blank.folds is not None and parts[0].fold_of is None and parts[0].n_before is None:
            # From now on episodes get their true fold on the spot, since beliefs that are compared hang on it.
            before = np.cumsum([0, *added.dealt]).tolist()
            parts = [replace(part, n_before=n) for part, n in zip(parts, before[:-1], strict=True)]
            blank.folds.deal_unnamed(before[-1])
        notes = added.notes
        inference.take(wanted)
    assert inference.result is not None
    inference.result.folds = blank.folds
    return inference.result, notes


def _added_up(
    client: Any, empty: Accumulator, source: Tables, batch_rows: int, parts: list[Part], report: Report
) -> Added:
    import dask
    import distributed

    setup = Setup(empty, source.in_one_thread(), batch_rows)
    tree = plant((_same, setup), parts, _sum_of_part, _sum_of_two)
    # Of many episodes the folds are megabytes, which Dask would warn of.
    with dask.config.set({"distributed.admin.large-graph-warning-threshold": LARGEST_GRAPH}):
        *left, total = client.get(tree.tasks, [*tree.parts, tree.total], sync=False)
    rows = {future.key: part.stop - part.start for future, part in zip(left, parts, strict=True)}
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


def _same(setup: Setup) -> Setup:
    return setup


def _sum_of_part(setup: Setup, part: Part) -> Added:
    accumulator = setup.empty.empty(part.fold_of)
    if accumulator.folds is not None and part.n_before is not None:
        accumulator.folds.deal_unnamed(part.n_before)
    notes: tuple[Note, ...] = ()
    with threadpool_limits(1, user_api="blas"):
        for block in setup.source.blocks(setup.batch_rows, part.start, part.stop):
            loaded = block.load()
            samples = to_learn_from(accumulator, loaded)
            accumulator.include(accumulator.sums(samples, deal(accumulator, samples)))
            notes = combine((*notes, *loaded.notes))
    done = accumulator.without_labels()
    if done.folds is None:
        return Added(done, notes)
    dealt = done.folds.n_dealt - (part.n_before or 0)
    if part.n_before is not None:
        done.folds = EpisodeFolds(done.folds.n_folds)  # whoever adds this to others need not rename folds
    return Added(done, notes, (dealt,))


def _sum_of_two(a: Added, b: Added) -> Added:
    total = a.accumulator.copy()  # what a task returned may be needed again
    total.merge(b.accumulator)
    return Added(total, combine((*a.notes, *b.notes)), a.dealt + b.dealt)
