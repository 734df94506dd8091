"""Movements: paths over two coordinates, and where a rollout leads."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from unconstrain.arrays import check_finite, check_groups, check_names, check_numbers
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.plot.axes import check_coordinates, get_axes, label_plane
from unconstrain.plot.colors import LEARNT, RECORDED


def trajectory(
    movements: Demonstrations | ArrayLike,
    *,
    episodes: ArrayLike | None = None,
    coordinates: tuple[int, int] = (0, 1),
    color: str = RECORDED,
    style: str = ":",
    label: str | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw movements over two coordinates, each as a line that begins at a dot.

    Parameters
    ----------
    movements : Demonstrations or array_like of shape (N, n)
        Demonstrations, whose names are put on the axes, or states.
    episodes : array_like of shape (N,), optional
        Of states, which samples belong together; by default all of them do. Demonstrations have episodes of their own.
    coordinates : tuple of int
        Which two of the n coordinates are drawn, counted from 0.
    color, style : str
        Of the lines, as matplotlib names them.
    label : str, optional
        In the legend.
    ax : Axes, optional
        Where to draw; new axes by default.

    Returns
    -------
    Axes
        With the movements.

    Raises
    ------
    DataError
        Movements are no finite array, or have no such coordinates or episodes.
    """
    if isinstance(movements, Demonstrations):
        X, episodes = movements.states, movements.episodes
    else:
        X = check_numbers(movements, "movements")
        if X.ndim != 2:
            raise DataError(f"movements must be states (samples, dimensions), got shape {X.shape}")
        check_finite(X, "movements")
    i, j = check_coordinates(coordinates, X.shape[1])
    given = check_groups(episodes, len(X), "episodes")
    ax = get_axes(ax)
    if isinstance(movements, Demonstrations):
        label_plane(ax, (movements.state_names[i], movements.state_names[j]))
    codes = np.zeros(len(X)) if given is None else given
    for k, code in enumerate(np.unique(codes)):
        path = X[codes == code][:, [i, j]]
        ax.plot(*path.T, style, color=color, lw=1.1, label=label if k == 0 else None, zorder=1)
        ax.plot(*path[0], "o", color=color, ms=2.6, zorder=1)
    return ax


def rollout_figure(movement: Demonstrations, state_names: Sequence[str] | None = None) -> Figure:
    """Draw where a rollout leads: its path over the first two states, and every state against time.

    Parameters
    ----------
    movement : Demonstrations
        One movement, with time. Of a single state its velocity is drawn over it.
    state_names : sequence of str, optional
        Names of the states; by default those of the movement.

    Returns
    -------
    Figure
        With two panels.

    Raises
    ------
    DataError
        There are not as many names as states.
    """
    n = movement.states.shape[1]
    names = movement.state_names if state_names is None else check_names(state_names, "state_names", n)
    figure = Figure(figsize=(10.0, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    if len(names) > 1:
        trajectory(movement.states, episodes=movement.episodes, color=LEARNT, style="-", ax=left)
        label_plane(left, (names[0], names[1]))
    else:
        left.plot(movement.states[:, 0], movement.actions[:, 0], color=LEARNT)
        left.set(xlabel=names[0], ylabel=f"{names[0]} velocity")
    time = np.arange(len(movement)) if movement.time is None else movement.time
    for name, values in zip(names, movement.states.T, strict=True):
        right.plot(time, values, label=name)
    right.set(xlabel="step" if movement.time is None else "t (s)")
    right.legend(frameon=False, fontsize=8, ncols=2)
    return figure
