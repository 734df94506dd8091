"""What a pass of the adaptive risk costs, beside one of the inconsistency.

With λ by cross-validation every fifth pass also sums what λ is chosen by. The rows are the mean of five passes; what
each of the two kinds takes is beside it.
"""

from collections.abc import Callable

import numpy as np

import unconstrain as uc
from benchmarks.fits import draw_half_free
from benchmarks.ratio import Ratio, medians
from unconstrain.fitting.accumulator import Accumulator
from unconstrain.fitting.inference import PASSES_PER_CHOICE
from unconstrain.samples import Samples

N_SAMPLES = 10_000


def _measure(name: str, what: str, policy: uc.LocallyLinearPolicy | uc.ParametricPolicy) -> Ratio:
    X, U, groups = draw_half_free(N_SAMPLES, 7)
    fitted = policy.fit(X, U, groups=groups)
    samples, scale = Samples(X, U, groups), float(np.mean(np.sum(U**2, axis=1)))

    def one_pass(risk: str, *, is_judged: bool = False) -> Callable[[], object]:
        def add() -> None:
            belief = fitted.solution_.belief if risk == "adaptive" else None
            accumulator = Accumulator(fitted.model_, risk, "cv", belief=belief, scale=scale)
            accumulator.is_judged = is_judged
            accumulator.add(samples)

        return add

    plain, judged, one = medians(
        one_pass("adaptive"), one_pass("adaptive", is_judged=True), one_pass("inconsistency"), repeats=15
    )
    ours = ((PASSES_PER_CHOICE - 1) * plain + judged) / PASSES_PER_CHOICE
    work = f"{what}, 7 + 7, 10,000 samples: {plain / one:.2f}, with λ {judged / one:.2f}"
    return Ratio(name, work, "a pass of the inconsistency", ours / one, 1.5, ours, one)


def local() -> Ratio:
    """50 local models."""
    return _measure("adaptive-pass-local", "50 local models", uc.LocallyLinearPolicy(n_centers=50))


def rbf() -> Ratio:
    """36 RBFs."""
    return _measure("adaptive-pass-rbf", "36 RBFs", uc.ParametricPolicy(uc.NormalizedRBF(n_centers=36)))


def linear() -> Ratio:
    """The linear policy, whose sums are so cheap that judging the samples shows."""
    return _measure("adaptive-pass-linear", "linear", uc.ParametricPolicy())


BENCHMARKS: dict[str, Callable[[], Ratio]] = {
    "adaptive-pass-local": local,
    "adaptive-pass-rbf": rbf,
    "adaptive-pass-linear": linear,
}
