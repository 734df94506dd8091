"""Velocities of a recording that has only positions."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.errors import DataError
from unconstrain.recordings.resampling import spread
from unconstrain.recordings.steps import comes_in_bursts, typical_step

Array = NDArray[np.float64]

# Stamps this close to an even grid, as a share of the step, are taken to be on it: rounding, not jitter.
EVEN = 1e-9


def differentiate(states: ArrayLike, time: ArrayLike, *, window: float = 0.2, polyorder: int = 2) -> Array:
    """Differentiate one episode by Savitzky–Golay: take the slope of a polynomial fitted to each moving window.

    At every stamp a polynomial of degree `polyorder` is fitted by least squares to the samples of the
    window around it, and its slope taken; near the ends, to the first or last window.

    Recorded stamps jitter, while the filter wants an even grid: the states are then carried to a grid of
    the episode's median step, and the slopes back, by cubic splines. A polynomial of degree ≤ `polyorder`
    is differentiated exactly (up to rounding) either way. Where stamps come in bursts a spline would swing between
    them, so the polynomials are fitted to the recorded stamps themselves.

    Parameters
    ----------
    states : array_like of shape (N, n)
        The states of one episode.
    time : array_like of shape (N,)
        Seconds, strictly increasing.
    window : float
        Seconds from a window's first to its last sample, rounded to an odd number of samples and never
        fewer than the polynomial needs. Longer is smoother and blunter.
    polyorder : int
        1, 2 or 3; the splines are cubic, so more would be lost on uneven stamps.

    Returns
    -------
    ndarray of shape (N, n)
        dx/dt, in [units of the states] / s.

    Raises
    ------
    DataError
        The window is longer than the episode, or time does not increase strictly.
    """
    from scipy.interpolate import CubicSpline
    from scipy.signal import savgol_filter

    X, t = np.asarray(states, dtype=np.float64), np.asarray(time, dtype=np.float64)
    if X.ndim != 2 or t.shape != (len(X),):
        raise DataError(f"states (N, n) and time (N,) are needed, got shapes {X.shape} and {t.shape}")
    if polyorder not in (1, 2, 3):
        raise DataError(f"polyorder must be 1, 2 or 3, got {polyorder!r}")
    if not (np.isfinite(window) and window > 0):
        raise DataError(f"window must be a positive number of seconds, got {window!r}")
    late = np.flatnonzero(~(np.diff(t) > 0))
    if len(late):
        raise DataError(f"time does not increase at row {late[0] + 1} (counted from 0)")
    if not spans_window(t, window, polyorder):
        raise DataError(
            f"{len(t)} samples over {t[-1] - t[0] if len(t) else 0:.4g} s are too few for "
            f"a window of {window:g} s and a polynomial of degree {polyorder}"
        )
    t = t - t[0]
    X = X - X[0]  # so that what rests has a slope of exactly zero
    if comes_in_bursts(np.diff(t)):
        return _slopes_of_bursts(X, t, window, polyorder)
    on_grid, step = even_grid(X, t)
    length = window_samples(_step(t), window, polyorder)
    slopes = savgol_filter(on_grid, length, polyorder, deriv=1, delta=step, axis=0, mode="interp")
    return slopes if on_grid is X else CubicSpline(np.linspace(0.0, t[-1], len(slopes)), slopes)(t)


def even_grid(states: Array, time: Array) -> tuple[Array, float]:
    """Bring the states of one episode to even steps, by cubic splines; stamps in bursts are spread before.

    Parameters
    ----------
    states : ndarray of shape (N, n)
    time : ndarray of shape (N,)
        Seconds, strictly increasing.

    Returns
    -------
    ndarray of shape (M, n)
        The very states where the steps are even already.
    float
        The step (s).
    """
    from scipy.interpolate import CubicSpline

    stamps = spread(time)
    t = stamps - stamps[0]
    size = _grid_size(t)
    step = t[-1] / (size - 1)
    grid = np.linspace(0.0, t[-1], size)
    if size == len(t) and np.all(np.abs(t - grid) <= EVEN * step):
        return states, step
    return CubicSpline(t, states)(grid), step


def _slopes_of_bursts(X: Array, t: Array, window: float, polyorder: int) -> Array:
    """Return the slope (N, n) at each stamp of a polynomial fitted to the samples within the window around it."""
    slopes = np.empty_like(X)
    width = min(window, t[-1])
    least = min(polyorder + 2, len(t))
    for i, now in enumerate(t):
        begin = min(max(now - width / 2, 0.0), t[-1] - width)
        first, last = np.searchsorted(t, begin, "left"), np.searchsorted(t, begin + width, "right")
        # One burst alone tells no slope.
        while (last - first < least or t[last - 1] - t[first] < width / 2) and (first > 0 or last < len(t)):
            first, last = max(first - 1, 0), min(last + 1, len(t))
        own = slice(first, last)
        powers = np.vander((t[own] - now) / width, min(polyorder, last - first - 1) + 1, increasing=True)
        slopes[i] = np.linalg.lstsq(powers, X[own], rcond=None)[0][1] / width
    return slopes


def window_samples(step: float, window: float, polyorder: int = 2) -> int:
    """Return the odd number of samples that spans `window` seconds best, at least `polyorder` + 1."""
    half = max(round(window / (2 * step)), (polyorder + 1) // 2)
    return 2 * half + 1


def longest_window(time: Array) -> float:
    """Return the longest window (s) of which an episode with these stamps (seconds, increasing) has all samples."""
    return 2 * ((_grid_size(time) - 1) // 2) * _step(time)


def spans_window(time: Array, window: float, polyorder: int = 2) -> bool:
    """Whether an episode with these stamps (seconds, increasing) has a full window of samples."""
    if len(time) <= polyorder:
        return False
    return _grid_size(time) >= window_samples(_step(time), window, polyorder)


def _step(time: Array) -> float:
    # Not the mean, which gaps stretch; and what is left of bursts must not make an endless grid.
    return max(typical_step(np.diff(time)), float(time[-1] - time[0]) / (10 * (len(time) - 1)))


def _grid_size(time: Array) -> int:
    return round(float(time[-1] - time[0]) / _step(time)) + 1
