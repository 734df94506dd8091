"""States relative to something: the episode's start, its goal, other columns, or a centre that moves slowly.

Many movements do not hang on where they are in the room but on where they are relative to something. A reach goes to
its goal, wherever that is; a wiping circle is drawn about a centre that wanders. With a reference r the state becomes
`x - r`, and the action, a velocity, `u - ṙ`.
"""

import numpy as np
from numpy.typing import NDArray

from unconstrain.recordings.columns import GOAL, START

Array = NDArray[np.float64]


def moving_centre(values: Array, time: Array, seconds: float) -> Array:
    """Compute a centre that moves slowly, of one episode.

    It is the mean of the values, weighted by a Gaussian of time: `c(t) = Σ w_i v_i / Σ w_i`, `w_i = exp(-(t - t_i)² /
    2s²)`, on an even grid of the episode's mean step. Near the ends only the samples that there are count.

    Parameters
    ----------
    values : ndarray of shape (N, n)
        States, or actions.
    time : ndarray of shape (N,)
        Seconds, increasing.
    seconds : float
        Standard deviation s.

    Returns
    -------
    ndarray of shape (N, n)
        In the unit of the values.
    """
    from scipy.ndimage import gaussian_filter1d

    if len(values) < 2:
        return values.copy()
    grid = np.linspace(time[0], time[-1], len(time))
    deviation = seconds / (grid[1] - grid[0])
    there = gaussian_filter1d(np.ones(len(grid)), deviation, mode="constant")
    centre = np.empty_like(values)
    for column, result in zip(values.T, centre.T, strict=True):
        even = gaussian_filter1d(np.interp(grid, time, column), deviation, mode="constant") / there
        result[:] = np.interp(time, grid, even)
    return centre


def describe(to: object, seconds: float | None, *, in_frame: bool = False) -> str:
    """Say what states were taken relative to, and what that means for who uses the policy.

    Parameters
    ----------
    to : "start", "goal", list of columns, or None
        As given.
    seconds : float, optional
        Of the moving centre.
    in_frame : bool
        Whether states are expressed in the frame of that too.

    Returns
    -------
    str
        For a note.
    """
    parts = []
    if to == START:
        parts.append("where each episode starts")
    elif to == GOAL:
        parts.append("where each episode ends, which is taken for its goal")
    elif to is not None:
        parts.append(f"the columns {to if isinstance(to, str | int) else ', '.join(map(str, to))}")  # type: ignore[call-overload]
    if seconds is not None:
        parts.append(f"their mean over some {seconds:g} s")
    frame = ", in its frame" if in_frame and to is not None else ""
    return f"states are relative to {', then to '.join(parts)}{frame}"


def end_of(values: Array, which: str) -> Array:
    """Return where one episode starts or ends.

    Parameters
    ----------
    values : ndarray of shape (N, n)
        States.
    which : {"start", "goal"}
        Its first sample, or its last.

    Returns
    -------
    ndarray of shape (n,)
        That state.
    """
    return values[0 if which == START else -1]
