"""How far a movement has come: its phase, from 0 where an episode starts to 1 where it ends.

Movements that dwell, or that come back the way they went, have several velocities at a place, but one at a place and a
phase. Of an episode from `t_0` to `t_1` it is `s = (t - t_0) / (t_1 - t_0)`; a rollout, which does not know when it
will end, takes the mean duration of episodes instead.
"""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.recordings.steps import runs
from unconstrain.spaces import Phased

Array = NDArray[np.float64]
Codes = NDArray[np.int64]

SHORTEST = 1e-150
"""Durations (s) that are shorter, or longer than the inverse, over- or underflow."""


def add_phase(demos: Demonstrations) -> Demonstrations:
    """Add to states how far their episode has come, as `load(..., phase=True)` does.

    Fragments of an episode that was split, as `load` calls them (``wipe/1``, ``wipe/2``), go on counting in it.

    Parameters
    ----------
    demos : Demonstrations
        With time.

    Returns
    -------
    Demonstrations
        Whose states have one number more, their phase, and whose `space` is `spaces.Phased`.

    Raises
    ------
    DataError
        They have no time, or a phase already; or no episode lasts any time.

    Examples
    --------
    >>> import unconstrain as uc
    >>> demos = uc.Demonstrations([[0.0], [1.0], [1.0]], [[1.0], [0.0], [0.0]], time=[0.0, 1.0, 2.0])
    >>> add_phase(demos).states.tolist()
    [[0.0, 0.0], [1.0, 0.5], [1.0, 1.0]]
    """
    if demos.time is None:
        raise DataError("a phase needs to know the time of each sample: give demonstrations with time")
    if isinstance(demos.space, Phased):
        raise DataError("these demonstrations have a phase already")
    whole = _whole_episodes(demos)[demos.episodes]
    with np.errstate(over="ignore"):  # what is infinite is told in a sentence
        durations = [float(np.ptp(demos.time[own])) for own in runs(whole)]
    space = Phased(demos.space, mean_duration(durations, "these demonstrations"))
    return replace(
        demos,
        states=np.column_stack([demos.states, phase_of(demos.time, whole)]),
        space=space,
        state_names=space.state_names(demos.state_names),
        notes=(*demos.notes, describe(durations)),
    )


def phase_of(time: Array, episodes: Codes) -> Array:
    """Compute how far the episode of each sample has come.

    Parameters
    ----------
    time : ndarray of shape (N,)
        Seconds.
    episodes : ndarray of shape (N,)
        Numbers from 0; episodes may be interleaved.

    Returns
    -------
    ndarray of shape (N,)
        From 0 to 1; 0 in an episode that lasts no time.
    """
    phase = np.zeros(len(time))
    for own in runs(episodes):
        since = time[own] - time[own].min()
        if since.max() > 0:
            phase[own] = since / since.max()
    return phase


def mean_duration(durations: Sequence[float], shown: str) -> float:
    """Return how long (s) a movement takes, the mean of episodes that last any time; `shown` is where these are.

    Raises
    ------
    DataError
        There is none, or it cannot be computed with.
    """
    lasting = [each for each in durations if each > 0]
    if not lasting:
        raise DataError(f"no episode of {shown} lasts any time, so none has a phase: leave out phase=")
    found = float(np.mean(lasting))
    if not SHORTEST < found < 1 / SHORTEST:
        raise DataError(
            f"the episodes of {shown} last {found:.3g} s, which is no duration to compute with: correct the stamps"
        )
    return found


def describe(durations: Sequence[float]) -> str:
    """Say what a phase is, and what it means for who rolls the policy out.

    Parameters
    ----------
    durations : sequence of float
        Of the episodes, in seconds.

    Returns
    -------
    str
        For a note.
    """
    lasting = [each for each in durations if each > 0]
    least, most = f"{min(lasting):.3g}", f"{max(lasting):.3g}"
    between = f", between {least} and {most} s" if least != most else ""
    return (
        "states have a phase, 0 where an episode starts and 1 where it ends; rollouts take the mean duration for it, "
        f"{np.mean(lasting):.3g} s{between}, stay at 1 after that, and do not wait for a robot that is held up"
    )


def _whole_episodes(demos: Demonstrations) -> Codes:
    """Return the number of the recorded episode, (n_episodes,), that each episode is a fragment of, or is."""
    assert demos.time is not None
    time = demos.time
    spans = [(float(time[own].min()), float(time[own].max())) for own in runs(demos.episodes)]
    starts: list[bool] = []
    for code, label in enumerate(demos.episode_labels):
        before = code - 1
        goes_on = (
            before >= 0
            and _is_next(demos.episode_labels[before], label)
            and spans[code][0] > spans[before][1]
        )
        starts.append(not goes_on)
    return np.cumsum(starts) - 1


def _is_next(label: str, other: str) -> bool:
    """Whether labels are those of two fragments of an episode that follow each other."""
    one, two = (re.fullmatch(r"(.*)/([0-9]{1,9})", each, re.DOTALL) for each in (label, other))
    return bool(one and two and one[1] == two[1] and int(two[2]) == int(one[2]) + 1)
