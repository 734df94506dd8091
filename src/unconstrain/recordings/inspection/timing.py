"""What the stamps of a recording say: rate, duration, gaps, and what is odd about them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unconstrain.recordings.gaps import GAP_STEPS

Array = NDArray[np.float64]
Codes = NDArray[np.int64]

BURST = 0.2
"""Where the median step is a smaller share of the mean, stamps come in bursts."""

UNEVEN = 0.1
"""Steps that scatter by more than this share of the typical one are no even rate."""


@dataclass(frozen=True)
class Timing:
    """What stamps say.

    Parameters
    ----------
    rate_hz : float or None
        Samples a second, where a recording goes on.
    duration_s : float
        Of all episodes together, gaps among them.
    gaps : int
        Steps of more than five typical ones.
    longest_gap : float
        Seconds; 0 where there is none.
    repeated, backwards : int
        Steps that do not go on, and that go back.
    bursts : bool
        Whether many stamps follow each other closely, and then none.
    even : bool
        Whether all steps are alike.
    step : float
        The typical step, in seconds.
    """

    rate_hz: float | None
    duration_s: float
    gaps: int
    longest_gap: float
    repeated: int
    backwards: int
    bursts: bool
    even: bool
    step: float


def judge_stamps(seconds: Array, episodes: Codes) -> Timing:
    """Judge the stamps of a recording.

    Parameters
    ----------
    seconds : ndarray of shape (N,)
    episodes : ndarray of shape (N,)
        The episode of each stamp.

    Returns
    -------
    Timing
    """
    order = np.argsort(episodes, kind="stable")
    steps = np.diff(seconds[order])[np.diff(episodes[order]) == 0]
    steps = steps[np.isfinite(steps)]
    forward = steps[steps > 0]
    if not len(forward):
        return Timing(None, 0.0, 0, 0.0, int(np.sum(steps == 0)), int(np.sum(steps < 0)), False, False, 0.0)
    median, mean = float(np.median(forward)), float(np.mean(forward))
    # A few long gaps lengthen the mean as well, so bursts must be many.
    long = forward > GAP_STEPS * median
    bursts = median < BURST * mean and float(np.mean(long)) > 0.02
    typical = mean if bursts else median
    gaps = forward[forward > GAP_STEPS * typical]
    usual = forward[forward <= GAP_STEPS * typical]
    return Timing(
        rate_hz=1.0 / typical,
        duration_s=float(forward.sum()),
        gaps=len(gaps),
        longest_gap=float(gaps.max()) if len(gaps) else 0.0,
        repeated=int(np.sum(steps == 0)),
        backwards=int(np.sum(steps < 0)),
        bursts=bursts,
        even=bool(np.all(np.abs(usual - typical) < UNEVEN * typical)),
        step=typical,
    )


def explained_by(
    positions: Array, velocities: Array, seconds: Array, episodes: Codes, over: int = 10
) -> float:
    """Return the share of the squared motion that velocities explain.

    Displacements over some samples are compared with the velocities' integral, which noise troubles less than it does
    a derivative.

    Parameters
    ----------
    positions, velocities : ndarray of shape (N, n)
    seconds : ndarray of shape (N,)
    episodes : ndarray of shape (N,)
    over : int
        How many samples a displacement spans.

    Returns
    -------
    float
        1 where velocities are the derivative; 0 or less where they have nothing to do with it.
    """
    order = np.argsort(episodes, kind="stable")
    X, V, t, e = positions[order], velocities[order], seconds[order], episodes[order]
    over = max(1, min(over, len(X) - 1))
    dt = np.diff(t)
    integral = np.concatenate(
        [np.zeros((1, X.shape[1])), np.cumsum((V[1:] + V[:-1]) / 2 * dt[:, None], axis=0)]
    )
    moved, told = X[over:] - X[:-over], integral[over:] - integral[:-over]
    within = (e[over:] == e[:-over]) & np.isfinite(moved).all(axis=1) & np.isfinite(told).all(axis=1)
    if not within.any():
        return 0.0
    moved, told = moved[within], told[within]
    total = float(np.sum(moved**2))
    return 1.0 - float(np.sum((moved - told) ** 2)) / total if total > 0 else 0.0
