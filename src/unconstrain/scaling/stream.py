"""Learning from data of any size: read a block, add up its moments, forget it.

Moments add, so the policy learnt from a stream is that learnt from all samples at once, given the same centres. Only
where centres lie must be known before; they are placed on a random sample. One pass over the data is enough, unless
contact is inferred: then there are as many as `fitting.inference` asks for. Memory holds a few blocks, the moments,
and, where contact is inferred, states are differentiated or forces filtered, the longest episode.
"""

import os
import time as clock
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from copy import deepcopy
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone
from threadpoolctl import threadpool_info, threadpool_limits

from unconstrain import atomic
from unconstrain.arrays import check_number, check_samples, check_whole
from unconstrain.errors import DataError, PolicyError
from unconstrain.fitting.accumulator import Accumulator
from unconstrain.fitting.inference import Inference
from unconstrain.fitting.solve import ONE_FOLD
from unconstrain.fitting.sums import Sums
from unconstrain.policies.base import Policy
from unconstrain.policies.linear import LinearPolicy
from unconstrain.progress import Report, reporting
from unconstrain.progress import begin as begin_pass
from unconstrain.recordings.blocks import Block, Loaded, Source
from unconstrain.recordings.notes import Note, combine
from unconstrain.recordings.source import BATCH_ROWS, Openable, Recordings, check_batch_rows
from unconstrain.recordings.source import open as open_recordings
from unconstrain.samples import Samples
from unconstrain.scaling import checkpoint as checkpoints
from unconstrain.scaling.checkpoint import Progress

SAMPLE_ROWS = 100_000
ONCE = (
    'risk="adaptive" reads the data several times, and these batches can be read only once: give a list of them or a '
    'function that returns them anew, or choose risk="corrected", "inconsistency" or "direct"'
)

PolicyT = TypeVar("PolicyT", bound=LinearPolicy)


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

    With the adaptive risk the data are read as often as it takes to infer which samples were free: dozens of times,
    and a hundred and more where that is slow to settle. Contact is inferred along episodes, which are samples with
    the same label that follow each other, over the ends of batches and files too. So a block holds whole ones:
    where one is longer than `batch_rows` it has more rows. Samples of batches without labels are taken one by one,
    and a single file without episodes as the five into which it is cut for ``alpha="cv"``.

    Parameters
    ----------
    policy : ParametricPolicy or LocallyLinearPolicy
        Fitted in place.
    recordings : Recordings
        As `unconstrain.open` returns them, or anything that it takes without options: the path of a LeRobot dataset, or
        an iterable of ``(X, U)``, for example. What is found while reading is in their `notes` afterwards. For the
        adaptive risk batches must be a list, or a function that returns them anew.
    partial : bool
        Go on with a policy that is fitted already, as `partial_fit` does, instead of starting anew. With the adaptive
        risk too that is one pass: contact is inferred by the policy as it is before.
    checkpoint : path, optional
        Where to write, every `checkpoint_seconds`, how far the stream has come. If the file exists, the stream goes
        on from there, and ends with the same result as if it had not been interrupted.
    checkpoint_seconds : float
        Seconds between two of them.
    progress : bool or function, optional
        True shows a bar with rows, rate and time left; a function is called with rows done and rows in all, anew in
        each pass. If it has a method `begin`, that is called before each pass of the adaptive risk, with what it is
        for.
    batch_rows : int
        How many samples are added up at a time: at most as many, or, where blocks hold whole episodes, at least.
    sample_rows : int
        On how many rows centres and other features that depend on the data are placed: a random sample of the files'
        rows (all of them, if there are no more; of 16 or more row groups at most the first 131,072 of each), the first
        rows of an iterable; of these, those that move, unless the risk is "direct" or "corrected".
    random_state : int
        Of that sample.

    Returns
    -------
    policy
        Fitted. Its `recording_` are the columns and the preparation that the recordings were opened with.

    Raises
    ------
    DataError
        Data that cannot be read or used, in a sentence that names the file and the row; or that can be read only once,
        where that is not enough.
    PolicyError
        A policy with impossible options, or one that needs what the recordings do not tell, such as episodes for
        ``alpha="cv"``.
    UnconstrainError
        A checkpoint that belongs to something else or is damaged.
    """
    opened = open_for(policy, recordings, batch_rows)
    check_number(checkpoint_seconds, "checkpoint_seconds", positive=False)
    check_whole(sample_rows, "sample_rows", least=1)
    source = source_for(policy, opened.source, partial=partial)
    settings = {"batch_rows": batch_rows, "sample_rows": sample_rows, "random_state": random_state}
    belongs_to: dict[str, str] = {}
    resumed = None
    if checkpoint is not None:
        belongs_to = checkpoints.identity(policy, opened.identity(), settings, partial)
        resumed = checkpoints.load(checkpoint, belongs_to, policy)
        atomic.check_writable(checkpoint)
    if resumed is None:
        check_episodes(policy, source, partial=partial)
        accumulator = begin(policy, source, sample_rows, random_state, partial=partial)
        resumed = Progress(accumulator, Sums(), 0)
        if accumulator.risk == "adaptive" and accumulator.belief is None:
            resumed = to_infer(accumulator)

    def keep(reached: Progress) -> None:
        if checkpoint is not None:
            checkpoints.save(checkpoint, belongs_to, reached)

    with reporting(progress) as report:
        reading = _Reading(source, batch_rows, resumed, report, keep, checkpoint_seconds)
        interrupted = False
        try:
            accumulator = reading.run()
        except KeyboardInterrupt:
            interrupted = True
    reached = reading.reached
    if interrupted:
        keep(reached)
        which = "" if reached.inference is None else f" ({reached.inference.description})"
        rows = f"{reached.done:,}" + (f" of {source.n_rows:,}" if source.n_rows else "") + " rows"
        how = (
            "nothing was learnt; give a checkpoint to be able to go on"
            if checkpoint is None
            else f"the same call with checkpoint {checkpoint} goes on from there"
        )
        raise KeyboardInterrupt(f"interrupted{which} after {rows}: {how}")
    return finish(policy, accumulator, reached.notes, opened)


def open_for(
    policy: LinearPolicy,
    recordings: Openable,
    batch_rows: int,
) -> Recordings:
    """Open recordings to fit a policy to.

    Raises
    ------
    PolicyError
        The policy cannot be learnt from them.
    """
    if not isinstance(policy, LinearPolicy):
        if isinstance(policy, Policy):
            raise PolicyError(
                f"a {type(policy).__name__} {policy.why_no_stream}: a ParametricPolicy and a LocallyLinearPolicy learn "
                "from it, with any risk but the adaptive one in one pass"
            )
        raise PolicyError(f"policy must be one of unconstrain's, got {policy!r:.80}")
    policy.check_options()
    check_batch_rows(batch_rows)
    opened = open_recordings(recordings)
    if opened.source.knows_projections and policy.risk == "direct":
        raise PolicyError('projections are for risk="inconsistency", and this policy has risk="direct"')
    return opened


def check_episodes(policy: LinearPolicy, source: Source, *, partial: bool) -> None:
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
    policy: LinearPolicy, source: Source, sample_rows: int, random_state: int | None, *, partial: bool
) -> Accumulator:
    """Make an accumulator, its model placed on a sample of the source, or going on from the policy's own sums."""
    goes_on = partial and hasattr(policy, "model_")
    X, U = source.head() if goes_on else source.sample(max(int(sample_rows), 2), random_state)
    derived = U is None
    probe = clone(policy) if not goes_on else deepcopy(policy)
    X, U = check_samples(probe, X, X if U is None else U, reset=not goes_on)
    space = source.space
    U = np.ones((len(X), space.n_actions if space else X.shape[1])) if derived else U.reshape(len(U), -1)
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
        accumulator = policy.start(Samples(X, U if U.any() else np.ones_like(U)), space, source.noise)
    accumulator.longest = max(accumulator.longest, longest)
    return accumulator


def finish(
    policy: PolicyT, accumulator: Accumulator, notes: tuple[Note, ...], recordings: Recordings
) -> PolicyT:
    """Solve; only here does the policy change."""
    check_enough(accumulator.total)
    policy.finish(accumulator, scalar_actions=recordings.source.scalar_actions)
    policy.recording_ = (recordings.given[0], recordings.guessed)
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


def to_infer(blank: Accumulator) -> Progress:
    """Return the beginning of the passes by which contact is inferred."""
    inference = Inference(blank)
    wanted = inference.next_pass()
    assert wanted is not None
    return Progress(wanted, Sums(), 0, (), inference)


def source_for(policy: LinearPolicy, source: Source, *, partial: bool) -> Source:
    """Return the source as it is to be read: with whole episodes in blocks where contact is inferred along them.

    Raises
    ------
    DataError
        The source has to be read several times and cannot be.
    """
    goes_on = partial and hasattr(policy, "model_")
    if policy.risk != "adaptive":
        return source
    if not goes_on and not source.repeatable:
        raise DataError(ONCE)
    return source.along_episodes()


def check_enough(total: Sums) -> None:
    """Raise `DataError` where there are too few samples for a policy."""
    if total.n_samples == 0:
        raise DataError(
            "no episode has a fragment long enough to be differentiated: raise gap= or max_speed=, or lower window= or "
            "min_duration="
        )
    if total.n_samples < 2:
        raise DataError("one sample (n_samples = 1) is not enough: a policy needs 2 or more")


class _Reading:
    """Passes over a source, and where they stand at any moment."""

    def __init__(
        self,
        source: Source,
        batch_rows: int,
        start: Progress,
        report: Report,
        keep: Callable[[Progress], None],
        every: float,
    ) -> None:
        self.reached = start
        self._source, self._batch_rows, self._report = source, batch_rows, report
        self._keep, self._every, self._kept = keep, every, clock.monotonic()

    def run(self) -> Accumulator:
        """Add everything up, in as many passes as it takes."""
        if self.reached.inference is not None:
            return self._infer()
        self._add_up()
        if self.reached.sums.misjudged:
            self._begin_again_with_scale_known()
            self._add_up()
        self._keep(self.reached)
        return self._added()

    def _infer(self) -> Accumulator:
        while True:
            inference = self.reached.inference
            assert inference is not None
            begin_pass(self._report, inference.description)
            self._add_up()
            check_enough(self.reached.sums)
            # What is kept, should this be interrupted, is what stood before.
            after = inference.copy()
            after.take(self._added())
            wanted = after.next_pass()
            if wanted is None:
                self._keep(self.reached)
                assert after.result is not None
                return after.result
            self.reached = Progress(wanted, Sums(), 0, (), after)

    def _added(self) -> Accumulator:
        done = self.reached.accumulator.copy()
        done.include(self.reached.sums)
        return done

    def _begin_again_with_scale_known(self) -> None:
        """Read a second time, for the rare stream in which what counts as motion shows only at its end."""
        sums = self.reached.sums
        if not self._source.repeatable:
            raise DataError(
                f"an action of length {sums.shortest:.3g} was taken for motion before one of length "
                f"{sums.longest:.3g} came, beside which it is rounding: leave one of them out, or give a function "
                "that returns the batches anew"
            )
        again = self.reached.accumulator
        again.longest = sums.longest
        self.reached = Progress(again, Sums(), 0)

    def _add_up(self) -> None:
        """Make a pass, or the rest of it.

        Blocks are read one after the other and dealt out to folds in that order; turning them into arrays and into
        moments is spread over threads, of which BLAS then gets one each. The moments are added in the order of the
        blocks, so the result does not depend on who was faster.
        """
        source, accumulator, start = self._source, self.reached.accumulator, self.reached.done
        blas = [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]
        threads = min(blas, default=1)
        loading: deque[tuple[Block, Future[Loaded]]] = deque()
        adding: deque[tuple[Block, tuple[Note, ...], Future[Sums]]] = deque()

        def deal_out() -> None:
            block, loaded = loading.popleft()
            read = loaded.result()
            samples = to_learn_from(accumulator, read)
            work = pool.submit(accumulator.sums, samples, deal(accumulator, samples))
            adding.append((block, read.notes, work))

        def add() -> None:
            block, found, work = adding.popleft()
            before = self.reached
            notes = combine((*before.notes, *found)) if found else before.notes
            # One assignment, so that an interruption finds either all of a block in it or nothing.
            self.reached = replace(before, sums=before.sums + work.result(), done=block.stop, notes=notes)
            if clock.monotonic() - self._kept >= self._every:
                self._keep(self.reached)
                self._kept = clock.monotonic()
            self._report(self.reached.done, source.n_rows)

        self._report(start, source.n_rows)
        blocks = source.blocks(self._batch_rows, start)
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
        finally:
            pool.shutdown(cancel_futures=True)
