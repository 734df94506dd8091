"""Learning from data of any size in one pass: read a block, add up its moments, forget it.

Moments add, so the policy learnt from a stream is that learnt from all samples at once, given the same centres. Only
where centres lie must be known before; they are placed on a random sample. Memory holds a few blocks, the moments,
and, where the states are differentiated or forces filtered, the longest episode.
"""

import os
import time as clock
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from copy import deepcopy
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone
from threadpoolctl import threadpool_info, threadpool_limits

from unconstrain import atomic
from unconstrain.arrays import check_number, check_samples, check_whole
from unconstrain.errors import DataError, PolicyError
from unconstrain.fitting.accumulator import Accumulator
from unconstrain.fitting.solve import ONE_FOLD
from unconstrain.fitting.sums import Sums
from unconstrain.policies.base import Policy
from unconstrain.progress import Report, reporting
from unconstrain.recordings.blocks import Block, Loaded, Source
from unconstrain.recordings.notes import Note, combine
from unconstrain.recordings.source import BATCH_ROWS, Openable, Recordings, check_batch_rows
from unconstrain.recordings.source import open as open_recordings
from unconstrain.samples import Samples
from unconstrain.scaling import checkpoint as checkpoints
from unconstrain.scaling.checkpoint import Progress

SAMPLE_ROWS = 100_000

PolicyT = TypeVar("PolicyT", bound=Policy)


def fit_stream(
    policy: PolicyT,
    recordings: Openable,
    *,
    partial: bool = False,
    checkpoint: str | os.PathLike[str] | None = None,
    checkpoint_seconds: float = 30.0,
    progress: bool | Report | None = None,
    batch_rows: int = BATCH_ROWS,
    sample_rows: int = SAMPLE_ROWS,
    random_state: int | None = 0,
) -> PolicyT:
    """Fit a policy to data that need not fit into memory.

    The result is that of `fit` on all samples with the same centres (to rounding), with `alpha="cv"` too, whose folds
    are dealt out to the episodes in the order in which they appear.

    Parameters
    ----------
    policy : ParametricPolicy or LocallyLinearPolicy
        Fitted in place.
    recordings : Recordings
        As `unconstrain.open` returns them, or anything that it takes without options: the path of a LeRobot dataset, or
        an iterable of ``(X, U)``, for example. What is found while reading is in their `notes` afterwards.
    partial : bool
        Go on with a policy that is fitted already, as `partial_fit` does, instead of starting anew.
    checkpoint : path, optional
        Where to write, every `checkpoint_seconds`, how far the stream has come. If the file exists, the stream goes
        on from there, and ends with the same result as if it had not been interrupted.
    checkpoint_seconds : float
        Seconds between two of them.
    progress : bool or function, optional
        True shows a bar with rows, rate and time left; a function is called with rows done and rows in all.
    batch_rows : int
        How many samples, at most, are added up at a time.
    sample_rows : int
        On how many rows centres and other features that depend on the data are placed: a random sample of the files'
        rows (all of them, if there are no more), the first rows of an iterable; of these, those that move, unless
        the risk is "direct".
    random_state : int
        Of that sample.

    Returns
    -------
    policy
        Fitted. Its `recording_` are the columns and the preparation that the recordings were opened with.

    Raises
    ------
    DataError
        Data that cannot be read or used, in a sentence that names the file and the row.
    PolicyError
        A policy with impossible options, or one that needs what the recordings do not tell, such as episodes for
        ``alpha="cv"``.
    UnconstrainError
        A checkpoint that belongs to something else or is damaged.
    """
    opened = open_for(policy, recordings, batch_rows)
    check_number(checkpoint_seconds, "checkpoint_seconds", positive=False)
    check_whole(sample_rows, "sample_rows", least=1)
    source = opened.source
    settings = {"batch_rows": batch_rows, "sample_rows": sample_rows, "random_state": random_state}
    belongs_to: dict[str, str] = {}
    resumed = None
    if checkpoint is not None:
        belongs_to = checkpoints.identity(policy, opened.identity(), settings, partial)
        resumed = checkpoints.load(checkpoint, belongs_to, policy)
        atomic.check_writable(checkpoint)
    if resumed is None:
        check_episodes(policy, source, partial=partial)
        resumed = Progress(begin(policy, source, sample_rows, random_state, partial=partial), Sums(), 0)

    def keep(reached: Progress) -> None:
        if checkpoint is not None:
            checkpoints.save(checkpoint, belongs_to, reached)

    try:
        with reporting(progress) as report:
            reached = _added_up(source, batch_rows, resumed, report, keep, checkpoint_seconds)
            if reached.sums.misjudged:
                reached = _with_scale_known(source, batch_rows, reached, report, keep, checkpoint_seconds)
    except _Interrupted as stop:
        rows = f"{stop.done:,}" + (f" of {source.n_rows:,}" if source.n_rows else "") + " rows"
        how = (
            "nothing was learnt; give a checkpoint to be able to go on"
            if checkpoint is None
            else f"the same call with checkpoint {checkpoint} goes on from there"
        )
        raise KeyboardInterrupt(f"interrupted after {rows}: {how}") from None
    keep(reached)
    accumulator = reached.accumulator
    accumulator.include(reached.sums)
    return finish(policy, accumulator, opened, reached.notes)


def open_for(
    policy: Policy,
    recordings: Openable,
    batch_rows: int,
) -> Recordings:
    """Open recordings to fit a policy to.

    Raises
    ------
    PolicyError
        The policy cannot be learnt from them.
    """
    if not isinstance(policy, Policy):
        raise PolicyError(f"policy must be one of unconstrain's, got {policy!r:.80}")
    policy.check_options()
    check_batch_rows(batch_rows)
    opened = open_recordings(recordings)
    if opened.source.knows_projections and policy.risk == "direct":
        raise PolicyError('projections are for risk="inconsistency", and this policy has risk="direct"')
    return opened


def check_episodes(policy: Policy, source: Source, *, partial: bool) -> None:
    """Find out before a long pass that there is one episode, where λ is to be chosen on held-out ones.

    Nothing but the episode column is read, and no further than to the second episode.

    Raises
    ------
    DataError
        All rows of the files are one episode. Of what is split on the way, or is no file, that is not known yet.
    """
    goes_on = partial and hasattr(policy, "model_")
    if policy.alpha != "cv" or goes_on or source.row_groups is None or source.relabels or not source.n_rows:
        return
    first: Any = None
    for labels, start in source.labels(0, source.n_rows):
        first = labels[0] if start == 0 else first
        if np.any(labels != first):
            return
    raise DataError(ONE_FOLD)


def begin(
    policy: Policy, source: Source, sample_rows: int, random_state: int | None, *, partial: bool
) -> Accumulator:
    """Make an accumulator, its model placed on a sample of the source, or going on from the policy's own sums."""
    goes_on = partial and hasattr(policy, "model_")
    X, U = source.head() if goes_on else source.sample(max(int(sample_rows), 2), random_state)
    derived = U is None
    probe = clone(policy) if not goes_on else deepcopy(policy)
    X, U = check_samples(probe, X, X if U is None else U, reset=not goes_on)
    U = np.ones_like(X) if derived else U.reshape(len(U), -1)
    longest = 0.0 if derived else float(np.linalg.norm(U, axis=1).max(initial=0.0))
    if goes_on:
        if U.shape[1] != policy.n_actions_:
            raise DataError(
                f"actions have {U.shape[1]} dimensions, but this policy has learnt {policy.n_actions_}"
            )
        accumulator = policy.resume()
        longest = max(longest, accumulator.total.longest)
    else:
        # Where a sample does not move at all, places are needed all the same.
        accumulator = policy.start(Samples(X, U if U.any() else np.ones_like(U)))
    accumulator.longest = max(accumulator.longest, longest)
    return accumulator


def finish(
    policy: PolicyT, accumulator: Accumulator, recordings: Recordings, notes: tuple[Note, ...]
) -> PolicyT:
    """Solve; only here does the policy change."""
    total = accumulator.total
    if total.n_samples == 0:
        raise DataError(
            "no episode has a fragment long enough to be differentiated: raise gap= or max_speed=, or lower window= or "
            "min_duration="
        )
    if total.n_samples < 2:
        raise DataError("one sample (n_samples = 1) is not enough: a policy needs 2 or more")
    policy.finish(accumulator, scalar_actions=recordings.source.scalar_actions)
    policy.recording_ = recordings.given
    recordings.notes = recordings.findings(notes)
    return policy


def to_learn_from(accumulator: Accumulator, loaded: Loaded) -> Samples:
    """Return the samples of a block, without projections that a file has where the risk does not look at them."""
    samples = loaded.samples
    return samples._replace(projections=None) if accumulator.risk == "direct" else samples


def deal(accumulator: Accumulator, samples: Samples) -> NDArray[Any] | None:
    """Return the fold of each sample, (N,), or None where there are none; new episodes are dealt out."""
    if accumulator.folds is not None and samples.groups is None:
        raise PolicyError('alpha="cv" over a stream needs episodes: give batches (X, U, groups)')
    return accumulator.deal(samples)


class _Interrupted(Exception):
    """Ctrl-C, after so many rows."""

    def __init__(self, done: int):
        self.done = done


def _with_scale_known(
    source: Source,
    batch_rows: int,
    reached: Progress,
    report: Report,
    keep: Callable[[Progress], None],
    every: float,
) -> Progress:
    """Read a second time, for the rare stream in which what counts as motion shows only at its end."""
    if not source.repeatable:
        raise DataError(
            f"an action of length {reached.sums.shortest:.3g} was taken for motion before one of length "
            f"{reached.sums.longest:.3g} came, beside which it is rounding: leave one of them out, or give a function "
            "that returns the batches anew"
        )
    again = reached.accumulator
    again.longest = reached.sums.longest
    return _added_up(source, batch_rows, Progress(again, Sums(), 0), report, keep, every)


def _added_up(
    source: Source,
    batch_rows: int,
    start: Progress,
    report: Report,
    keep: Callable[[Progress], None],
    every: float,
) -> Progress:
    """Where the stream stands once all of it is added up.

    Blocks are read one after the other and dealt out to folds in that order; turning them into arrays and into moments
    is spread over threads, of which BLAS then gets one each. The moments are added in the order of the blocks, so
    the result does not depend on who was faster.
    """
    reached = start
    kept = clock.monotonic()
    blas = [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]
    threads = min(blas, default=1)
    loading: deque[tuple[Block, Future[Loaded]]] = deque()
    adding: deque[tuple[Block, tuple[Note, ...], Future[Sums]]] = deque()
    accumulator = start.accumulator

    def deal_out() -> None:
        block, loaded = loading.popleft()
        read = loaded.result()
        samples = to_learn_from(accumulator, read)
        work = pool.submit(accumulator.sums, samples, deal(accumulator, samples))
        adding.append((block, read.notes, work))

    def add() -> None:
        nonlocal reached, kept
        block, found, work = adding.popleft()
        notes = combine((*reached.notes, *found)) if found else reached.notes
        # One assignment, so that an interruption finds either all of a block in it or nothing.
        reached = Progress(accumulator, reached.sums + work.result(), block.stop, notes)
        if clock.monotonic() - kept >= every:
            keep(reached)
            kept = clock.monotonic()
        report(reached.done, source.n_rows)

    report(start.done, source.n_rows)
    blocks = source.blocks(batch_rows, start.done)
    pool = ThreadPoolExecutor(threads)
    try:
        with threadpool_limits(1, user_api="blas"), closing(blocks):
            for block in blocks:
                loading.append((block, pool.submit(block.load)))
                if len(loading) > threads:
                    deal_out()
                if len(adding) > threads:
                    add()
            while loading:
                deal_out()
            while adding:
                add()
    except KeyboardInterrupt:
        pool.shutdown(cancel_futures=True)
        keep(reached)
        raise _Interrupted(reached.done) from None
    finally:
        pool.shutdown(cancel_futures=True)
    return reached
