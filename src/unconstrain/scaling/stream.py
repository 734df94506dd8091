"""Learning from data of any size in one pass: read a block, add up its moments, forget it.

Moments add, so the policy learnt from a stream is that learnt from all samples at once, given the same centres. Only
where centres lie must be known before; they are placed on a random sample. Memory holds a few blocks, the moments,
and, where the states are differentiated or forces filtered, the longest episode.
"""

import os
import time as clock
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from copy import deepcopy
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone
from threadpoolctl import threadpool_info, threadpool_limits

from unconstrain import atomic
from unconstrain.arrays import check_samples
from unconstrain.errors import DataError, PolicyError
from unconstrain.fitting.accumulator import Accumulator
from unconstrain.fitting.sums import Sums
from unconstrain.policies.base import Policy
from unconstrain.progress import Report, reporting
from unconstrain.recordings import dataset
from unconstrain.recordings.batches import Batches
from unconstrain.recordings.blocks import Block, Source
from unconstrain.recordings.reading import Reading
from unconstrain.recordings.roles import Keys
from unconstrain.recordings.table import Key
from unconstrain.samples import Samples
from unconstrain.scaling import checkpoint as checkpoints
from unconstrain.scaling.checkpoint import Progress

BATCH_ROWS = 2**16
SAMPLE_ROWS = 100_000


def fit_stream(
    policy: Policy,
    source: str | os.PathLike[str] | Iterable | Callable[[], Iterable],
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
    checkpoint: str | os.PathLike[str] | None = None,
    checkpoint_seconds: float = 30.0,
    progress: bool | Report | None = None,
    batch_rows: int = BATCH_ROWS,
    sample_rows: int = SAMPLE_ROWS,
    random_state: int | None = 0,
):
    """Fit a policy to data that need not fit into memory. Returns the policy, fitted.

    The result is that of `fit` on all samples with the same centres (to rounding), with `alpha="cv"` too, whose folds
    are dealt out to the episodes in the order in which they appear.

    Parameters
    ----------
    policy : ParametricPolicy, LocallyLinearPolicy
    source
        - a Parquet file, a folder of them, a pattern, or several files; on disk, or a URI such as
          ``s3://bucket/folder`` that `pyarrow.fs.FileSystem.from_uri` opens. Files come in the order of their names.
        - the folder of a LeRobot dataset, of version 2.0, 2.1 or 3.0. Its columns have known names, which are the
          defaults below.
        - any iterable of `(X, U)`, `(X, U, groups)` or `(X, U, groups, projections)`: states (N, n), actions (N, d),
          episode labels (N,) or None, and what is known of the constraints, (N, d, d), NaN where nothing is; or a
          function that returns such an iterable, which can then be read more than once.
    state, action : column, or list of columns
        Of files, by name. A column of lists stands for all its components, of which `name[3]` is one; those of a
        LeRobot dataset may also go by the names that the dataset gives them. Without `action`, or with
        ``action="differentiate"``, the actions are the derivative of the states, as in `load`.
    episode : column
        Its values tell episodes apart, across files. Without it every file is an episode; for ``alpha="cv"`` a single
        file without it is cut into contiguous blocks, as `fit` does without groups.
    time, time_unit, window, gap, max_speed, min_duration
        For the derivative; see `load`. An episode may straddle files, but its rows must follow each other.
    projections : column, or list of columns, optional
        What is known of the constraints, for the risks "auto" and "constrained": a column of lists of d² numbers, the
        projection row by row, as `save` writes it, or d² columns. Empty or NaN where it is not known.
    force, force_threshold, free : columns, number, column, optional
        What projections are made of instead, as by `load` and `constraints.from_recording`: contact forces, one column
        for each action; above which a force is a contact, in their unit; and 1 where nothing constrained the motion,
        else 0. Forces are filtered within whole episodes, so their rows must follow each other; without `episode`
        those of a file are one.
    partial : bool
        Go on with a policy that is fitted already, as `partial_fit` does, instead of starting anew.
    checkpoint : path, optional
        Where to write, every `checkpoint_seconds`, how far the stream has come. If the file exists, the stream goes
        on from there, and ends with the same result as if it had not been interrupted.
    progress : bool or function, optional
        True shows a bar with rows, rate and time left; a function is called with rows done and rows in all.
    batch_rows : int
        How many samples, at most, are added up at a time.
    sample_rows : int
        On how many rows centres and other features that depend on the data are placed: a random sample of the files'
        rows (all of them, if there are no more), the first rows of an iterable; of these, those that move, unless
        the risk is "direct" or "constrained".
    random_state : int
        Of that sample.

    Raises
    ------
    DataError
        Data that cannot be read or used, in a sentence that names the file and the row.
    PolicyError
        A policy with impossible options, or one that needs what the source does not tell: episodes for
        ``alpha="cv"``, projections for ``risk="constrained"``.
    UnconstrainError
        A checkpoint that belongs to something else or is damaged.
    """
    reading = Reading(
        state=state, action=action, episode=episode, time=time, projections=projections, force=force,
        force_threshold=force_threshold, free=free, time_unit=time_unit, window=window, gap=gap, max_speed=max_speed,
        min_duration=min_duration,
    )  # fmt: skip
    opened = open_source(policy, source, reading, batch_rows)
    settings = {"batch_rows": batch_rows, "sample_rows": sample_rows, "random_state": random_state}
    belongs_to: dict[str, str] = {}
    resumed = None
    if checkpoint is not None:
        belongs_to = checkpoints.identity(policy, opened.identity(), settings, partial)
        resumed = checkpoints.load(checkpoint, belongs_to, policy)
        atomic.check_writable(checkpoint)
    if resumed is None:
        resumed = Progress(begin(policy, opened, sample_rows, random_state, partial=partial), Sums(), 0)

    def keep(reached: Progress) -> None:
        if checkpoint is not None:
            checkpoints.save(checkpoint, belongs_to, reached)

    try:
        with reporting(progress) as report:
            reached = _added_up(opened, resumed, report, keep, checkpoint_seconds)
            if reached.sums.misjudged:
                reached = _with_scale_known(opened, reached, report, keep, checkpoint_seconds)
    except _Interrupted as stop:
        rows = f"{stop.done:,}" + (f" of {opened.n_rows:,}" if opened.n_rows else "") + " rows"
        how = (
            "nothing was learnt; give a checkpoint to be able to go on"
            if checkpoint is None
            else f"the same call with checkpoint {checkpoint} goes on from there"
        )
        raise KeyboardInterrupt(f"interrupted after {rows}: {how}") from None
    keep(reached)
    accumulator = reached.accumulator
    accumulator.include(reached.sums)
    return finish(policy, accumulator, opened)


def open_source(policy: Policy, source: Any, reading: Reading, batch_rows: int) -> Source:
    """The source of a stream, opened. Raises `PolicyError` for a policy that cannot be learnt from it."""
    if not isinstance(policy, Policy):
        raise PolicyError(f"policy must be one of unconstrain's, got {policy!r:.80}")
    policy.check_options()
    opened = _opened(source, reading, batch_rows)
    if opened.tells_constraints and policy.risk == "direct":
        raise PolicyError('projections are for risk="inconsistency", and this policy has risk="direct"')
    return opened


def _opened(source: Any, reading: Reading, batch_rows: int) -> Source:
    if isinstance(batch_rows, bool) or not isinstance(batch_rows, int | np.integer) or batch_rows < 1:
        raise PolicyError(f"batch_rows must be a whole number of at least 1, got {batch_rows!r}")
    several = (
        isinstance(source, list | tuple) and source and all(isinstance(s, str | os.PathLike) for s in source)
    )
    if isinstance(source, str | os.PathLike) or several:
        return dataset.opened(source, reading, batch_rows)
    if reading.columns:
        raise DataError(f"{reading.columns[0]}= chooses a column of files, but the source is not a path")
    return Batches(source, batch_rows)


def begin(
    policy: Policy, source: Source, sample_rows: int, random_state: int | None, *, partial: bool
) -> Accumulator:
    """An accumulator whose model is placed on a sample of the source, or that goes on from the policy's own sums."""
    goes_on = partial and hasattr(policy, "model_")
    placed_by_data = not goes_on and policy.placed_by_data
    X, U = source.sample(max(int(sample_rows), 2), random_state) if placed_by_data else source.head()
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


def finish(policy: Policy, accumulator: Accumulator, source: Source) -> Policy:
    """Solve; only here does the policy change."""
    total = accumulator.total
    if total.n_samples == 0:
        raise DataError(
            "no episode has a fragment long enough to be differentiated: raise gap or max_speed, or lower window or "
            "min_duration"
        )
    if total.n_samples < 2:
        raise DataError("one sample (n_samples = 1) is not enough: a policy needs 2 or more")
    return policy.finish(accumulator, scalar_actions=source.scalar_actions)


def deal(accumulator: Accumulator, samples: Samples) -> NDArray[Any] | None:
    """The fold of each sample, (N,), or None where there are none; new episodes are dealt out."""
    if accumulator.folds is not None and samples.groups is None:
        raise PolicyError('alpha="cv" over a stream needs episodes: give batches (X, U, groups)')
    return accumulator.deal(samples)


class _Interrupted(Exception):
    """Ctrl-C, after so many rows."""

    def __init__(self, done: int):
        self.done = done


def _with_scale_known(source: Source, reached: Progress, report: Report, keep, every: float) -> Progress:
    """A second pass, for the rare stream in which what counts as motion shows only at its end."""
    if not source.repeatable:
        raise DataError(
            f"an action of length {reached.sums.shortest:.3g} was taken for motion before one of length "
            f"{reached.sums.longest:.3g} came, beside which it is rounding: leave one of them out, or give a function "
            "that returns the batches anew"
        )
    again = reached.accumulator
    again.longest = reached.sums.longest
    return _added_up(source, Progress(again, Sums(), 0), report, keep, every)


def _added_up(
    source: Source, start: Progress, report: Report, keep: Callable[[Progress], None], every: float
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
    loading: deque[tuple[Block, Future[Samples]]] = deque()
    adding: deque[tuple[Block, Future[Sums]]] = deque()
    accumulator = start.accumulator

    def deal_out() -> None:
        block, loaded = loading.popleft()
        samples = loaded.result()
        adding.append((block, pool.submit(accumulator.sums, samples, deal(accumulator, samples))))

    def add() -> None:
        nonlocal reached, kept
        block, work = adding.popleft()
        # One assignment, so that an interruption finds either all of a block in it or nothing.
        reached = Progress(accumulator, reached.sums + work.result(), block.stop)
        if clock.monotonic() - kept >= every:
            keep(reached)
            kept = clock.monotonic()
        report(reached.done, source.n_rows)

    report(start.done, source.n_rows)
    blocks = source.blocks(start.done)
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
