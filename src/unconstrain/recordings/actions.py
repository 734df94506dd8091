"""What recorded actions are: velocities, commanded states, or steps."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unconstrain.recordings.notes import Note

Array = NDArray[np.float64]

# Actions are what they differ from by less than this share, of the square.
NEAR = 0.3

# What differs by more than this share, of the square, is no velocity, not even a noisy one.
UNLIKE = 0.6

# How many samples at most a commanded state is ahead of the state.
AHEAD = 5

# Fewer samples tell nothing.
LEAST = 20

# Commands that a controller scales lie within -1 and 1, and reach further than this.
REACH = 0.3


@dataclass(frozen=True)
class ActionKind:
    """What the actions of recordings are.

    Parameters
    ----------
    kind : {"velocity", "target", "increment", "scaled"}
    found : bool
        Whether it was found by comparison, rather than given.
    timed : bool
        Whether the time of samples is known.
    """

    kind: str
    found: bool
    timed: bool

    def note(self) -> tuple[Note, ...]:
        """Note what was found and what is done about it."""
        if not self.found or self.kind == "velocity":
            return ()
        if self.kind == "scaled":
            text = (
                "the actions lie within -1 and 1 and are no derivative of the states, as commands that a controller "
                'scales: they are learnt as they are; action="differentiate" learns the velocities of the states'
            )
            return (Note("actions", "", text),)
        is_what = "commanded states" if self.kind == "target" else "the steps to the next state"
        if not self.timed:
            done = "they are no velocities; give time= or rate= too to have these"
        elif self.kind == "target":
            done = "the states are differentiated instead"
        else:
            done = "they are divided by the time that passes"
        text = f"the actions are nearly {is_what}, so {done}; if that is wrong, give action_is="
        return (Note("actions", "", text),)


VELOCITY = ActionKind("velocity", False, False)
"""What actions are unless anything else is found or given."""


def find_kind(X: Array, U: Array, episodes: NDArray[np.int64], time: Array | None) -> str:
    """Find what actions are by comparing them with the states and their derivative.

    Parameters
    ----------
    X, U : ndarray of shape (N, n)
        States and actions.
    episodes : ndarray of shape (N,)
        The samples of an episode follow each other.
    time : ndarray of shape (N,) or None
        Seconds.

    Returns
    -------
    {"velocity", "target", "increment", "scaled"}
        "velocity" where actions are nothing of the sort, or "scaled" where they are within -1 and 1 then.
    """
    if X.shape != U.shape or len(X) < LEAST:
        return "velocity"
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # any numbers may be in a file
        return _find_kind(X, U, episodes, time)


def _find_kind(X: Array, U: Array, episodes: NDArray[np.int64], time: Array | None) -> str:
    within = np.diff(episodes) == 0
    steps = np.diff(X, axis=0)[within]
    given = U[:-1][within]
    if not len(given):
        return "velocity"
    misses = {"target": _miss_of_target(X, U, episodes)}
    if (size := float(np.sum(given**2))) > 0:
        misses["increment"] = float(np.sum((given - steps) ** 2)) / size
        if time is not None:
            passed = np.diff(time)[within]
            going = passed > 0
            speeds = steps[going] / passed[going, None]
            misses["velocity"] = float(np.sum((given[going] - speeds) ** 2)) / size
    misses.setdefault("velocity", np.inf)
    # In this order, so that at one sample a second increments count as the velocities that they are.
    best = min(("velocity", "target", "increment"), key=lambda kind: misses.get(kind, np.inf))
    if misses[best] < NEAR:
        return best
    largest = float(np.max(np.abs(given)))
    is_scaled = REACH < largest <= 1.0 and UNLIKE < misses["velocity"] < np.inf
    return "scaled" if is_scaled else "velocity"


def _miss_of_target(X: Array, U: Array, episodes: NDArray[np.int64]) -> float:
    """Return by what share of its variance a typical state differs from the action some samples before it."""
    varied = X.var(axis=0)
    moving = varied > 1e-12 * max(float(np.max(X**2, initial=0.0)), np.finfo(float).tiny)
    if not moving.any():
        return np.inf
    best = np.inf
    for ahead in range(AHEAD + 1):
        same = episodes[ahead:] == episodes[: len(episodes) - ahead]
        if not same.any():
            break
        apart = (U[: len(U) - ahead] - X[ahead:])[same][:, moving]
        best = min(best, float(np.median(np.mean(apart**2, axis=0) / varied[moving])))
    return best


def per_second(U: Array, time: Array) -> Array:
    """Divide the steps (N, n) of one episode by the time (s) that passes until the next sample.

    The last one is divided by the time that passed before it.
    """
    passed = np.diff(time)
    return U / np.append(passed, passed[-1:])[:, None]
