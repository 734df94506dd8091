"""Whether a movement repeats itself, and how long a turn takes."""

import numpy as np

from unconstrain.demonstrations import Demonstrations

LEAST_TURNS = 3
"""An episode has to hold so many turns, or else it is not taken for a movement that repeats itself."""


def find_turn(demos: Demonstrations) -> float | None:
    """Find how long a turn takes of a movement that repeats itself.

    The period at which the power of the actions' spectrum is largest, the middle of all episodes'.

    Parameters
    ----------
    demos : Demonstrations
        With time.

    Returns
    -------
    float or None
        Seconds; None where episodes hold less than three turns.
    """
    turns = []
    for k in range(demos.n_episodes):
        episode = demos.select(demos.episodes == k)
        assert episode.time is not None
        if len(episode) < 8:
            continue
        duration = float(episode.time[-1] - episode.time[0])
        even = np.linspace(episode.time[0], episode.time[-1], len(episode))
        U = np.stack([np.interp(even, episode.time, u) for u in episode.actions.T], axis=1)
        power = np.sum(np.abs(np.fft.rfft(U - U.mean(axis=0), axis=0)) ** 2, axis=1)
        turns.append((duration / np.argmax(power) if power.any() else np.inf, duration))
    if not turns:
        return None
    periods, durations = np.array(turns).T
    period = float(np.median(periods))
    return period if np.median(durations) >= LEAST_TURNS * period and period > 0 else None
