"""Over how long states are smoothed when they are differentiated, found from their noise.

At a window of w seconds the slope of a polynomial of degree 2 has the squared error `B(w) + V(w)`: a bias that grows as
w⁴ where the motion is smooth, and what noise is left, which falls as w⁻³. Neither is known, but polynomials of degree 4
over the same window have far less bias, and slopes that differ by

    D(w) = B(w) + κ V(w),        κ = 21/4 for long windows.

So D falls with w as long as it is noise, and rises once the motion is blunted. Noise is read off where it is about to
rise, at the time scale of the window itself. Thus it need not be white: that of quantised positions, which stand still
and jump, or of filtered ones hardly shows between neighbouring samples. The least of `B + V` remains to be found.

References
----------
Lepski, On a problem of adaptive estimation in Gaussian white noise, Theory of Probability and its Applications, 1990.
"""

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from functools import cache
from math import comb

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.recordings.derivative import Array, even_grid, window_samples
from unconstrain.recordings.notes import Note
from unconstrain.recordings.steps import LONG_STEPS, comes_in_bursts, runs
from unconstrain.waiting import each, stage

FALLING = 0.7
"""Over twice the window, D falls to less than this share where it is noise; that of a random walk falls to half."""

STEP = 2**0.25
"""From one window tried to the next."""

LARGEST_SHARE = 0.75
"""Of the samples, at most, are nearer to an end of their episode than half a window."""

ORDERS = (4, 6, 8)
"""Of the differences between neighbouring samples by which noise is told where the motion is blunted at once."""

KEPT, OF_NORMAL = 0.75, 0.3684
"""Share of these that count, the smallest, since contacts and jumps are in others; and the mean square of that share of
normal numbers of variance 1."""

SLACK, SHORTEST = 1.2, 0.6
"""Instead of the window with the least error the shortest is taken whose error is at most so many times larger, if it
is at least this share as long: a policy learnt from velocities averages their noise, but what is blunted stays so."""

ROUGH, AS_ROUGH, TWICE, WHITE = 3.0, 1.1, 2.0, 0.3
"""Where D rises at once, but at most to `TWICE` of what it was, and is back before `ROUGH` times the window, it is a
roughness that the samples do not resolve, such as that of a tracker or of a trembling hand, and counts as noise; if no
more than the share `WHITE` of it is white noise."""

ROUNDING = 1e-6
"""An error of velocities that is a smaller share of them does not count."""

JUMP, ALONE = 4.0, 5.0
"""A step is no motion that is so many times longer than all but 1 % of them, and than those a little before and after.
"""

BURSTS = 2.5
"""Of the steps between bursts of stamps, at least, a window has to hold: within a burst stamps tell no speed."""


@dataclass(frozen=True)
class Smoothing:
    """A window, and the noise before and after it.

    Parameters
    ----------
    window : float
        Seconds from its first to its last sample.
    state_noise : float
        Standard deviation of the states' noise, root mean square over the states, in their unit. Where noise is not
        white, that of white noise which disturbs slopes over this window as much.
    velocity_noise : float
        What is left of it in each velocity, in [units of the states] / s. It is correlated over the window, and several
        times larger next to the ends of an episode.
    error : float
        The same with what smoothing blunts.
    is_exact : bool
        Whether that noise is but rounding.
    """

    window: float
    state_noise: float
    velocity_noise: float
    error: float
    is_exact: bool


def describe_smoothing(found: Smoothing | None, given: float | None) -> tuple[Note, ...]:
    """Note over how long states are smoothed, and how sure velocities are then.

    Parameters
    ----------
    found : Smoothing or None
    given : float or None
        The window, where it was not found but given.

    Returns
    -------
    tuple of Note
        None where the window was given and nothing was found.
    """
    if found is None or found.is_exact:
        what = "the states show no noise" if found else "the episodes are too short to find the states' noise"
        text = f"{what}, so velocities are those of the fewest samples; window= smooths states over as many seconds"
        return () if given is not None else (Note("smoothing", "", text),)
    noise = f"the states' noise is about {found.state_noise:.2g}"
    unsure = f"velocities are uncertain by about {found.error:.2g} (noise alone: {found.velocity_noise:.2g})"
    if given is not None:
        return (Note("smoothing", "", f"{noise}, so over window={given:g} s {unsure}"),)
    text = f"{noise}, so they are smoothed over {found.window:.3g} s and {unsure}; window= overrules that"
    return (Note("smoothing", "", text),)


@dataclass(frozen=True)
class _Stretch:
    """States (N, n) at even steps (s)."""

    states: Array
    step: float

    def half(self, window: float) -> int:
        return window_samples(self.step, window) // 2


@stage("finding how long to smooth")
def find_smoothing(
    states: ArrayLike,
    time: ArrayLike,
    episodes: ArrayLike | None = None,
    *,
    window: float | None = None,
) -> Smoothing | None:
    """Find the window over which slopes of the states have the least squared error, and the noise.

    Parameters
    ----------
    states : array_like of shape (N, n)
        All in one unit, or in units in which they are compared.
    time : array_like of shape (N,)
        Seconds, increasing within an episode.
    episodes : array_like of shape (N,), optional
        A number from 0 for each sample, each used. They share one window.
    window : float, optional
        Seconds. Where it is given, only the noise is found.

    Returns
    -------
    Smoothing or None
        None where no episode has the samples to tell.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # any numbers may be in a file
        found = _find(
            np.asarray(states, dtype=np.float64), np.asarray(time, dtype=np.float64), episodes, window
        )
    return found if found is not None and np.isfinite([*astuple(found)]).all() else None


def _find(X: Array, t: Array, episodes: ArrayLike | None, window: float | None) -> Smoothing | None:
    codes = np.zeros(len(X), dtype=np.int64) if episodes is None else np.asarray(episodes, dtype=np.int64)
    stretches = [part for own in runs(codes) for part in _stretches(X[own], t[own])]
    if not stretches:
        return None
    finest = min(part.step for part in stretches)
    windows, D, K, rises = _differ_ever_longer(stretches, finest)
    reference = windows[-1] / 2 if rises else windows[-1]
    variance = _at(reference, windows, D / K)
    # Where D rises at once, or with a few samples more might have, noise does not show in it.
    hidden = windows[-1] < (12 if rises else 8) * finest * (1 - 1e-9)
    if hidden:
        variance = min(variance, _between_neighbours(stretches))
    bias = np.maximum(D - variance * K, 0.0)
    if not hidden:  # up to there D is noise, and a bias is not to be told from it
        bias[windows <= reference * (1 + 1e-9)] = 0.0
    left = variance * np.array([_gain(stretches, w) for w in windows])
    exact = ROUNDING**2 * _mean_square(stretches, windows[0])
    if window is None:
        errors = bias + left
        near = (errors <= SLACK**2 * errors.min()) & (windows >= SHORTEST * windows[np.argmin(errors)])
        least = max(_between_bursts(np.diff(t[own])) for own in runs(codes))
        window = max(float(windows[np.argmax(near | (errors <= exact))]), least)
    n = X.shape[1]
    noise = variance * _gain(stretches, window)
    return Smoothing(
        window,
        state_noise=float(np.sqrt(variance / n)),
        velocity_noise=float(np.sqrt(noise / n)),
        error=float(np.sqrt((noise + _at(window, windows, bias)) / n)),
        is_exact=bool(left[0] <= exact),
    )


def _differ_ever_longer(stretches: Sequence[_Stretch], finest: float) -> tuple[Array, Array, Array, bool]:
    """Try ever longer windows until their slopes differ by more than noise.

    Returns
    -------
    windows : ndarray of shape (M,)
        Seconds.
    D, K : ndarray of shape (M,)
        How much slopes differ there, and what white noise of variance 1 makes it.
    rises : bool
        Whether D rises at the last one; otherwise the episodes are not long enough for it to.
    """
    tried = [2 * finest * half for half in _halves(stretches, finest)]
    differing: list[float] = []
    gains: list[float] = []
    rises, rough = False, 0.0
    for w in each(tried, "finding how long to smooth", unit="windows at most"):
        difference, gain = _differ(stretches, w)
        differing.append(difference)
        gains.append(gain)
        if w < 8 * finest * (1 - 1e-9) or w <= rough:
            continue
        rises = difference > FALLING * _at(w / 2, tried, differing)
        if rises and not rough and w < 12 * finest * (1 - 1e-9):
            rough = _end_of_roughness(stretches, [each for each in tried[1:] if each <= ROUGH * w])
            rises = not rough
        if rises:
            break
    return np.array(tried[: len(differing)]), np.array(differing), np.array(gains), rises


def _end_of_roughness(stretches: Sequence[_Stretch], tried: Sequence[float]) -> float:
    """Return the longest window whose slopes differ no more than those of the first, and in between but a little more.

    It is 0 where there is none. Of a motion that is sampled finely enough they differ ever more, and white noise shows
    between neighbours.
    """
    first, gain = _differ(stretches, tried[0])
    if gain * _between_neighbours(stretches) > WHITE * first:
        return 0.0
    differing = [_differ(stretches, w)[0] for w in tried[1:]]
    back = [w for w, difference in zip(tried[1:], differing, strict=True) if difference <= AS_ROUGH * first]
    return back[-1] if back and max(differing) <= TWICE * first else 0.0


def _stretches(X: Array, t: Array) -> list[_Stretch]:
    """Bring one episode to even steps, and cut it where it jumps as no motion does."""
    if len(t) < 5:
        return []
    X, step = even_grid(X - X[0], t)
    return [_Stretch(part, step) for part in np.split(X, _jumps(X) + 1) if len(part) >= 5]


def _jumps(X: Array) -> NDArray[np.int64]:
    """Return the samples after which states (N, n) jump."""
    lengths = np.linalg.norm(np.diff(X, axis=0), axis=1)
    usual = np.percentile(lengths, 99)
    if usual == 0:
        return np.zeros(0, dtype=np.int64)
    far = np.pad(lengths, 3)
    n = len(lengths)
    around = np.max([far[3 + shift : 3 + shift + n] for shift in (-3, -2, 2, 3)], axis=0)
    return np.flatnonzero((lengths > JUMP * usual) & (lengths > ALONE * around))


def _halves(stretches: Sequence[_Stretch], step: float) -> list[int]:
    """Return half the samples of the windows that are tried, for the finest step."""
    lengths = np.array([len(part.states) * part.step / step for part in stretches])
    halves, wanted = [1, 2], 2.0 * STEP
    while np.sum(np.maximum(lengths - 2 * wanted, 0.0)) >= (1 - LARGEST_SHARE) * np.sum(lengths):
        if round(wanted) > halves[-1]:
            halves.append(round(wanted))
        wanted *= STEP
    return halves


def _differ(stretches: Sequence[_Stretch], window: float) -> tuple[float, float]:
    """Return the mean squared difference of slopes by degree 2 and 4, and what white noise of variance 1 makes it."""
    from scipy.signal import oaconvolve

    total = gain = count = 0.0
    for part in stretches:
        weights = _difference(part.half(window))
        if len(weights) > len(part.states):
            continue
        differences = oaconvolve(part.states, weights[::-1, None], mode="valid", axes=0)
        total += float(np.sum(differences**2)) / part.step**2
        gain += len(differences) * float(np.sum(weights**2)) / part.step**2
        count += len(differences)
    return total / max(count, 1.0), gain / max(count, 1.0)


def _gain(stretches: Sequence[_Stretch], window: float) -> float:
    """Return the mean variance of slopes by degree 2 that white noise of variance 1 leaves in the middle of windows."""
    total = count = 0.0
    for part in stretches:
        n = len(part.states)
        half = min(part.half(window), (n - 1) // 2)
        total += n * 3.0 / (half * (half + 1) * (2 * half + 1)) / part.step**2
        count += n
    return total / count


def _mean_square(stretches: Sequence[_Stretch], window: float) -> float:
    """Return the mean squared speed over windows."""
    moved = [
        (part.states[2 * half :] - part.states[: -2 * half]) / (2 * half * part.step)
        for part in stretches
        if 0 < (half := part.half(window)) <= (len(part.states) - 1) // 2
    ]
    squares = np.concatenate([np.sum(each**2, axis=1) for each in moved]) if moved else np.zeros(1)
    return float(np.mean(squares))


def _between_neighbours(stretches: Sequence[_Stretch]) -> float:
    """Return the variance of white noise, summed over the states, by high differences of neighbouring samples."""
    found = []
    for order in ORDERS:
        every = np.concatenate([np.diff(part.states, order, axis=0) for part in stretches])
        if len(every):
            found.append(sum(_variance(column) for column in every.T) / comb(2 * order, order))
    return min(found, default=0.0)


def _variance(values: Array) -> float:
    """Return the variance of most values (N,); quantised states that rest have none, and do not count."""
    squares = np.sort(values[values != 0] ** 2)
    kept = squares[: int(np.ceil(KEPT * len(squares)))]
    return float(np.mean(kept)) / OF_NORMAL if len(kept) else 0.0


def _between_bursts(steps: Array) -> float:
    """Return what a window has to hold (s) where stamps come in bursts."""
    if not comes_in_bursts(steps):
        return 0.0
    return BURSTS * float(np.median(steps[steps > LONG_STEPS * np.median(steps)]))


@cache
def _difference(half: int) -> Array:
    """Return the weights of the slope by degree 4 less those by degree 2; five samples are the least."""
    from scipy.signal import savgol_coeffs

    fine = savgol_coeffs(max(2 * half + 1, 5), 4, deriv=1, use="dot")
    plain = savgol_coeffs(2 * half + 1, 2, deriv=1, use="dot")
    return fine - np.pad(plain, (len(fine) - len(plain)) // 2)


def _at(
    window: float, windows: Sequence[float] | NDArray[np.float64], values: Sequence[float] | Array
) -> float:
    """Interpolate positive values between windows, both by their logarithms."""
    tiny = np.finfo(np.float64).tiny
    known = np.log(np.maximum(np.asarray(values), tiny))
    found = float(np.exp(np.interp(np.log(window), np.log(np.asarray(windows)[: len(known)]), known)))
    return found if found > 2 * tiny else 0.0
