"""What a row, a sum and a solution cost on this machine, in processor time, and how many passes contact takes."""

import pickle
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from statistics import median

import numpy as np

import unconstrain as uc
from benchmarks.fits import _data, draw_half_free
from benchmarks.stream import ACTION, STATE, _folder
from unconstrain.fitting.inference import Inference
from unconstrain.fitting.moments import Moments
from unconstrain.samples import Samples

DIMENSIONS = 7
ROW_BYTES = 2 * DIMENSIONS * 4
CENTERS = {100: 14, 1000: 143}
"""Of RBFs that make about so many parameters."""

ROWS = {100: 262_144, 1000: 32_768}


@dataclass(frozen=True)
class Model:
    """What a model with about P parameters costs.

    Parameters
    ----------
    P : int
    row : float
        Processor seconds a row, without decoding.
    adding, packing : float
        Seconds for a sum of one fold: to add another, and to pack it, which is as long as to unpack it.
    in_memory, packed : float
        Bytes of a sum of one fold.
    solving : float
        Seconds for an eigendecomposition of H, from which all λ are solved.
    """

    P: int
    row: float
    adding: float
    packing: float
    in_memory: float
    packed: float
    solving: float

    def grown(self, P: int) -> "Model":
        """Return what a larger model would cost: P² for everything but the solution, P³ for that."""
        by = P / self.P
        square = (getattr(self, name) * by**2 for name in ("row", "adding", "packing", "in_memory", "packed"))
        return Model(P, *square, self.solving * by**3)


@dataclass(frozen=True)
class Machine:
    """What was measured.

    Parameters
    ----------
    decoding : float
        Processor seconds for a row of 7 + 7 float32 in Parquet.
    models : dict of int to Model
    passes : int
        Over the data, until contact is inferred.
    adaptive : float
        How many times as long such a pass takes as one of the inconsistency.
    """

    decoding: float
    models: dict[int, Model]
    passes: int
    adaptive: float


@cache
def measure() -> Machine:
    """Measure this machine, in a minute."""
    models = {P: _model(P) for P in CENTERS}
    models[10_000] = models[1000].grown(10_000)
    return Machine(_decoding(), models, *_passes())


def _seconds(call: Callable[[], object], repeats: int = 3) -> float:
    """Median processor seconds of a call, after a warm-up."""
    call()
    times = []
    for _ in range(repeats):
        begun = time.process_time()
        call()
        times.append(time.process_time() - begun)
    return median(times)


def _decoding() -> float:
    source = uc.open(str(_folder(1_000_000)), state=STATE, action=ACTION).source.in_one_thread()
    return _seconds(lambda: [len(block.load().samples.states) for block in source.blocks(65_536)]) / 1_000_000


def _model(P: int) -> Model:
    X, U = _data(ROWS[P], DIMENSIONS)
    policy = uc.ParametricPolicy(
        uc.NormalizedRBF(centers=X[: CENTERS[P]].copy(), width=2.0), alpha=1e-6, risk="inconsistency"
    )
    samples = Samples(X, U)
    accumulator = policy.start(samples)
    accumulator.add(samples)
    (moments,) = accumulator.total.moments
    sent = pickle.dumps(moments)
    packing = median([_seconds(lambda: pickle.dumps(moments)), _seconds(lambda: pickle.loads(sent))])
    return Model(
        P,
        _seconds(lambda: accumulator.sums(samples)) / len(X),
        _seconds(lambda: moments + moments, 9),
        packing,
        moments.nbytes,
        len(sent),
        _seconds(lambda: Moments.decompose(moments)),
    )


def _passes() -> tuple[int, float]:
    """Count the passes of the adaptive risk, and compare a usual one to a pass of the inconsistency."""
    X, U, groups = draw_half_free(10_000, DIMENSIONS)
    samples = Samples(X, U, groups)
    policy = uc.ParametricPolicy(uc.NormalizedRBF(centers=X[:: len(X) // 14][:14].copy(), width=2.0))
    inference = Inference(policy.start(samples))
    times: dict[str, list[float]] = {}
    while (wanted := inference.next_pass()) is not None:
        stage, begun = inference.stage, time.process_time()
        wanted.add(samples)
        times.setdefault(stage, []).append(time.process_time() - begun)
        inference.take(wanted)
    return sum(map(len, times.values())), float(np.mean(times["run"]) / times["inconsistency"][0])
