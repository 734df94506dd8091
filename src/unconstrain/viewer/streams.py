"""Stream lines of a policy."""

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.features.centers import farthest_first
from unconstrain.simulation import simulate
from unconstrain.stopping import MovementStopped, Recorded
from unconstrain.viewer.following import Compiled, choose_steps
from unconstrain.viewer.stage import Stage
from unconstrain.viewer.surroundings import limits

Array = NDArray[np.float64]

CELLS, DENSITY = 30, 1.1
"""Of matplotlib's grid, and how close its lines are."""
LINES, LASTS = 70, 0.12
"""Of rollouts instead: how many, and for which share of the page's rollout."""


def segments(stage: Stage) -> tuple[Array, Array]:
    """Integrate stream lines.

    Over two states they are evenly spaced, by matplotlib. Over others they are short rollouts from recorded states.

    Parameters
    ----------
    stage : Stage
        What is shown.

    Returns
    -------
    pieces : ndarray of shape (M, 2, 3)
        Their ends, in the scene.
    states : ndarray of shape (M, n)
        Where they begin.
    """
    axes = stage.axes
    if axes.space.is_flat and len(axes.names) == 2 and len(stage.coordinates.names) == 2:
        return _in_plane(stage)
    return _by_rollouts(stage)


def _in_plane(stage: Stage) -> tuple[Array, Array]:
    from matplotlib.figure import Figure

    low, high = limits(stage.frame)
    x, y = (np.linspace(a, b, CELLS) for a, b in zip(low, high, strict=True))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    order = np.argsort(getattr(stage.coordinates, "which", [0, 1]))
    U = stage.policy.predict(grid[:, order])[:, np.argsort(order)]
    u, v = U.T.reshape(2, CELLS, CELLS)
    ax = Figure().subplots()
    drawn = ax.streamplot(x, y, u, v, density=DENSITY, arrowstyle="-")
    lines = drawn.lines.get_segments()
    pieces = np.concatenate([np.stack([line[:-1], line[1:]], axis=1) for line in lines])
    scene = stage.frame.to_scene(pieces.reshape(-1, 2)).reshape(-1, 2, 3)
    return scene, pieces[:, 0][:, order]


def _by_rollouts(stage: Stage) -> tuple[Array, Array]:
    policy = stage.policy
    starts = farthest_first(stage.states, n_centers=min(LINES, len(stage.states)))[0]
    step: Any = policy if policy.stability_ is not None else Compiled(policy)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MovementStopped)
        steps, dt = choose_steps(LASTS * stage.seconds, stage.interval)
        movement = simulate(step, starts, steps, dt, guards=[Recorded(policy)])
    P = stage.places(movement.states)
    first = np.flatnonzero(movement.episodes[1:] == movement.episodes[:-1])
    return np.stack([P[first], P[first + 1]], axis=1), movement.states[first]
