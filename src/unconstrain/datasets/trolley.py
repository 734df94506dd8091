"""A trolley that is pushed to its dock, now and then along a wall: simulated, and shipped as ``trolley.csv``.

Its state is a place and a heading. Each recording is cut in three; each third is free, or a wall lets the trolley slide
along one direction only, or a castor is jammed and it cannot turn.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.arrays import check_numbers
from unconstrain.datasets.files import path
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.recordings import load

Array = NDArray[np.float64]

COLUMNS = ("run", "t", "x", "y", "yaw")
FORMAT = ("%d", "%.2f", "%.3f", "%.3f", "%.4f")

EPISODES, DURATION, RATE = 18, 4.0, 25
"""Recordings, s, and samples a second."""
FINE = 10
"""Steps of the simulation in one of the recording."""

APPROACH, SWING, TURN = 0.6, 0.5, 1.2
"""How fast it comes, how far a wrong heading lets it swing to the side, and how fast it turns, 1/s."""
FREE, WALL = 0.4, 0.4
"""How probable it is that a third is free, and that it is along a wall; in the rest it cannot turn."""
TRACKER, COMPASS = 0.001, 0.004
"""Standard deviations of the recorded places, m, and headings, rad."""


def trolley_policy(states: ArrayLike) -> Array:
    """Return what the person behind the trolley of ``trolley.csv`` wants: to bring it to the dock, facing backwards.

    The dock is the origin, the heading there is π. While the heading is another the trolley swings about the dock.

    Parameters
    ----------
    states : array_like of shape (N, 3)
        Place in m, and heading in rad.

    Returns
    -------
    ndarray of shape (N, 3)
        Velocity in m/s, and angular velocity in rad/s.

    Raises
    ------
    DataError
        If the states have another shape.
    """
    X = check_numbers(states, "states")
    if X.ndim != 2 or X.shape[1] != 3:
        raise DataError(f"the trolley has a place and a heading: give states of shape (N, 3), not {X.shape}")
    x, y, yaw = X.T
    swing = SWING * np.sin(yaw)
    return np.stack([-APPROACH * x - swing * y, -APPROACH * y + swing * x, TURN * np.sin(yaw)], axis=1)


def load_trolley() -> Demonstrations:
    """Load 18 recordings of a trolley that is pushed to its dock; they are simulated.

    Place in m and heading in rad, at 25 Hz for 4 s each, with 1 mm and 0.004 rad of noise, from which velocities
    are differentiated. Headings jump from π to -π, as recorded ones do. Each third of a recording is free (40 %), along
    a wall of another direction each time (40 %), or without turning (20 %). The policy behind them is `trolley_policy`.

    Returns
    -------
    Demonstrations
        1,800 samples, whose space says that the third state is an angle. `policy` holds the true unconstrained velocity
        at each recorded state.

    Examples
    --------
    >>> import unconstrain as uc
    >>> uc.datasets.load_trolley().n_episodes
    18
    """
    demos = load(path("trolley.csv"), state=["x", "y", "yaw"], angle="yaw", time="t", episode="run")
    return replace(demos, policy=trolley_policy(demos.states))


def simulate_trolley(random_state: int = 0) -> Array:
    """Simulate the recordings of ``trolley.csv``.

    Parameters
    ----------
    random_state : int
        The file holds those of 0.

    Returns
    -------
    ndarray of shape (1800, 5)
        Columns as in `COLUMNS`.
    """
    rng = np.random.default_rng(random_state)
    x = np.column_stack([rng.uniform(-1.5, 1.5, (EPISODES, 2)), rng.uniform(-np.pi, np.pi, EPISODES)])
    kind, wall = rng.random((EPISODES, 3)), rng.uniform(0, np.pi, (EPISODES, 3))
    across = np.where(
        (kind < FREE + WALL)[..., None],
        np.stack([np.cos(wall), np.sin(wall), np.zeros_like(wall)], axis=-1),
        [0.0, 0.0, 1.0],
    )
    across[kind < FREE] = 0.0  # nothing is taken away
    steps, dt = round(DURATION * RATE), 1 / (RATE * FINE)
    states = np.empty((steps, EPISODES, 3))
    for k in range(steps * FINE):
        if k % FINE == 0:
            states[k // FINE] = x
        a = across[:, 3 * k // (steps * FINE)]
        wanted = trolley_policy(x)
        x = x + dt * (wanted - np.sum(a * wanted, axis=1, keepdims=True) * a)
    states += [TRACKER, TRACKER, COMPASS] * rng.normal(size=states.shape)
    states[..., 2] = (states[..., 2] + np.pi) % (2 * np.pi) - np.pi
    return np.column_stack(
        [
            np.repeat(np.arange(EPISODES), steps),
            np.tile(np.arange(steps) / RATE, EPISODES),
            states.swapaxes(0, 1).reshape(-1, 3),
        ]
    )
