"""A hand that wipes boards, with a force sensor: simulated, and shipped as ``wiping.csv``.

The hand comes down in spirals and presses on whatever is below. In every recording a board lies there, at another
height and with another tilt, and takes away the motion into it. So what is recorded is free while the hand
approaches, and bent while it wipes.
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

COLUMNS = ("episode", "t", "x", "y", "z", "fx", "fy", "fz")
FORMAT = ("%d", "%.2f", "%.4f", "%.4f", "%.4f", "%.2f", "%.2f", "%.2f")

EPISODES, DURATION, RATE = 16, 3.4, 50
"""Recordings, s, and samples a second."""
FINE = 10
"""Steps of the simulation in one of the recording, so that the hand stops at the board and not in it."""

RADIUS, TURN, ATTRACTION = 0.12, 2.5, 1.5
"""Of the circle that is wiped: m, rad/s, 1/s."""
DEPTH, DESCENT = -0.12, 0.8
"""The height at which the hand would rest if nothing were there, m, and how fast it gets there, 1/s."""

WANDERING, WANDERS_FOR = 0.008, 0.3
"""No hand does twice the same: standard deviation of its velocity in each direction, m/s, and how long it lasts, s."""
TRACKER = 0.0003
"""Standard deviation of the recorded positions, m."""
STIFFNESS, FRICTION, SENSOR = 80.0, 0.2, 0.25
"""N for each m/s of motion that the board takes away; N of friction for each N of pressing; N of noise."""


def wiping_policy(states: ArrayLike) -> Array:
    """Return what the hand of ``wiping.csv`` wants: to go round a circle, and down.

    In the plane it is drawn to a circle of 0.12 m about the origin and goes round it at 2.5 rad/s; along z it goes to
    -0.12 m, which lies below all boards.

    Parameters
    ----------
    states : array_like of shape (N, 3)
        Positions in m.

    Returns
    -------
    ndarray of shape (N, 3)
        Velocities in m/s.

    Raises
    ------
    DataError
        If the states have another shape.
    """
    X = check_numbers(states, "states")
    if X.ndim != 2 or X.shape[1] != 3:
        raise DataError(f"the hand moves in space: give states of shape (N, 3), not {X.shape}")
    x, y, z = X.T
    outwards = ATTRACTION * (1 - (x**2 + y**2) / RADIUS**2)
    return np.stack([outwards * x + TURN * y, outwards * y - TURN * x, -DESCENT * (z - DEPTH)], axis=1)


def load_wiping(*, force_threshold: float | None = None) -> Demonstrations:
    """Load 16 recordings of a hand that wipes boards; they are simulated.

    Positions in m, at 50 Hz for 3.4 s each, with 0.3 mm of noise, from which velocities are differentiated; forces in
    N, with 0.25 N of noise. A board lies at another height and tilted another way, by 5° to 30°, in each recording.
    It takes away the motion into it and pushes back with 80 N for each m/s of that, and with friction of 0.2. The hand
    wanders by 0.008 m/s from its policy, which is `wiping_policy`.

    Parameters
    ----------
    force_threshold : float, optional
        N. If given, the force sensor is used: contact is where the force exceeds it, and the constraint is known there
        (see `constraints.from_forces`). 2 suits. Without it nothing is known of contact.

    Returns
    -------
    Demonstrations
        2,720 samples. `policy` holds the true unconstrained velocity at each recorded position.

    Raises
    ------
    DataError, PolicyError
        If the threshold is not a positive number.

    Examples
    --------
    >>> import unconstrain as uc
    >>> demos = uc.datasets.load_wiping()
    >>> len(demos)
    2720
    """
    demos = load(
        path("wiping.csv"),
        state=["x", "y", "z"],
        time="t",
        episode="episode",
        force=None if force_threshold is None else ["fx", "fy", "fz"],
        force_threshold=force_threshold,
    )
    return replace(demos, policy=wiping_policy(demos.states))


def simulate_wiping(random_state: int = 0) -> Array:
    """Simulate the recordings of ``wiping.csv``.

    Parameters
    ----------
    random_state : int
        The file holds those of 0.

    Returns
    -------
    ndarray of shape (2720, 8)
        Columns as in `COLUMNS`.
    """
    rng = np.random.default_rng(random_state)
    tilt, azimuth = np.radians(rng.uniform(5, 30, EPISODES)), rng.uniform(0, 2 * np.pi, EPISODES)
    normal = np.stack([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)], axis=1)
    height = rng.uniform(0.0, 0.08, EPISODES)
    x = np.column_stack([rng.uniform(-0.14, 0.14, (EPISODES, 2)), height + rng.uniform(0.25, 0.4, EPISODES)])
    steps, dt = round(DURATION * RATE), 1 / (RATE * FINE)
    wanders = np.zeros((EPISODES, 3))
    positions, forces = np.empty((2, steps, EPISODES, 3))
    for k in range(steps * FINE):
        wanders += -dt / WANDERS_FOR * wanders + WANDERING * np.sqrt(2 * dt / WANDERS_FOR) * rng.normal(
            size=wanders.shape
        )
        wanted = wiping_policy(x) + wanders
        into = np.minimum(np.sum(normal * wanted, axis=1), 0.0)  # m/s
        above = np.sum(normal * x, axis=1) - normal[:, 2] * height
        into[above > 0] = 0.0
        u = wanted - into[:, None] * normal
        if k % FINE == 0:
            pressing = -STIFFNESS * into[:, None]
            along = u / np.linalg.norm(u, axis=1, keepdims=True)
            positions[k // FINE] = x
            forces[k // FINE] = pressing * (normal - FRICTION * along)
        x = x + dt * u
    positions += TRACKER * rng.normal(size=positions.shape)
    forces += SENSOR * rng.normal(size=forces.shape)
    return np.column_stack(
        [
            np.repeat(np.arange(EPISODES), steps),
            np.tile(np.arange(steps) / RATE, EPISODES),
            positions.swapaxes(0, 1).reshape(-1, 3),
            forces.swapaxes(0, 1).reshape(-1, 3),
        ]
    )
