"""Movements as lines: recorded ones, and where a policy leads."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike, NDArray

from unconstrain.arrays import check_whole, quote
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.plot.axes import add_title, check_coordinates, get_axes, label_axes
from unconstrain.plot.colors import DIRECT, LEARNT, RECORDED
from unconstrain.plot.columns import name_columns
from unconstrain.plot.thinning import MOST_EPISODES, split_episodes
from unconstrain.policies.inputs import as_demonstrations

Array = NDArray[np.float64]


def demonstrations(
    demos: Demonstrations | ArrayLike,
    U: ArrayLike | None = None,
    *,
    groups: ArrayLike | None = None,
    coordinates: Sequence[int] | None = None,
    color: str = RECORDED,
    style: str = ":",
    label: str | None = "recorded movement",
    ax: Axes | None = None,
) -> Axes:
    """Draw movements, each as a line that begins at a dot.

    Of more than 1,000 episodes so many are drawn, evenly spread over them, which the legend says; lines are thinned to
    about 20,000 samples in all.

    Parameters
    ----------
    demos : Demonstrations, or array_like of shape (N, n)
        Recordings, or their states.
    U : array_like of shape (N, d), optional
        Actions beside states, which are not drawn.
    groups : array_like of shape (N,), optional
        Episodes, beside states.
    coordinates : sequence of int, optional
        Which two states are drawn over each other, or which three in space, counted from 0. By default the first two,
        of three states too, as a plane is easier to read than a picture of space; or the first three if `ax` is in
        three dimensions. A single state is drawn against time, or against the number of the sample.
    color, style : str
        Of the lines, as matplotlib names them.
    label : str, optional
        In the legend, which `matplotlib.axes.Axes.legend` adds.
    ax : Axes, optional
        Where to draw; new axes by default.

    Returns
    -------
    Axes
        With the movements. Axes of one unit have one scale, unless one extent is over twenty times the other.

    Raises
    ------
    DataError
        The recordings cannot be used, or have no such coordinates.
    """
    demos = as_demonstrations(demos, U, groups, actions_needed=False)
    shown = check_coordinates(coordinates, demos.states.shape[1], ax)
    ax = get_axes(ax, len(shown))
    if demos.n_episodes > MOST_EPISODES and label is not None:
        label = f"{label} ({MOST_EPISODES:,} of {demos.n_episodes:,})"
    if len(shown) == 1:
        _draw_over_time(ax, demos, 0, color, style, label)
        ax.set(ylabel=name_columns(demos)[0])
        return ax
    draw_lines(ax, demos.states[:, list(shown)], split_episodes(demos.episodes), color, style, label)
    label_axes(ax, demos, shown)
    return ax


def rollout(
    movement: Demonstrations | ArrayLike,
    demos: Demonstrations | ArrayLike | None = None,
    *,
    coordinates: Sequence[int] | None = None,
    against_time: bool = False,
    label: str = "rollout",
    ax: Axes | None = None,
) -> Axes:
    """Draw where a rollout leads: from a dot to a square, or to a cross where it had to stop.

    Parameters
    ----------
    movement : Demonstrations, or array_like of shape (N, n)
        As `policy.rollout` returns it, or states.
    demos : Demonstrations, or array_like of shape (N, n), optional
        Recordings to draw behind it, whose names go on the axes; of a single state only those that have time.
    coordinates : sequence of int, optional
        Which states are drawn, as for `demonstrations`; against time any number of them, by default all.
    against_time : bool
        Draw states against time, a line each, as for a single state. Recordings are then not drawn.
    label : str
        In the legend.
    ax : Axes, optional
        Where to draw; new axes by default.

    Returns
    -------
    Axes
        With the rollout.

    Raises
    ------
    DataError
        The movement or the recordings cannot be used, or have no such coordinates.
    """
    movement = as_demonstrations(movement, None, None, actions_needed=False)
    n = movement.states.shape[1]
    if isinstance(demos, Demonstrations) and demos.states.shape[1] == n:
        movement = replace(movement, state_names=demos.state_names)  # which say more than x1, x2
    if against_time:
        chosen = list(range(n)) if coordinates is None else coordinates
        if not isinstance(chosen, tuple | list) or not chosen:
            raise DataError(f"coordinates must be numbers counted from 0, got {quote(coordinates)}")
        chosen = [check_whole(i, "coordinates", least=0, most=n - 1) for i in chosen]
        return _draw_all_over_time(movement, chosen, get_axes(ax))
    shown = check_coordinates(coordinates, n, ax)
    ax = get_axes(ax, len(shown))
    recorded = None if demos is None else as_demonstrations(demos, None, None, actions_needed=False)
    in_time = len(shown) == 1
    if recorded is not None and not (in_time and recorded.time is None):
        demonstrations(recorded, coordinates=coordinates, ax=ax)
    demonstrations(movement, coordinates=coordinates, color=LEARNT, style="-", label=label, ax=ax)
    if not in_time:
        _mark_ends(ax, movement, shown)
    add_title(ax, "Rollout of the policy")
    return ax


def draw_lines(
    ax: Any,
    places: Array,
    episodes: Sequence[NDArray[np.intp]],
    color: str,
    style: str,
    label: str | None,
) -> None:
    """Draw a line for each episode, all in one: thousands of lines would take minutes.

    Parameters
    ----------
    ax : Axes
        In k dimensions.
    places : ndarray of shape (N, k)
        Where the samples are.
    episodes : sequence of ndarray of int
        Rows of each episode.
    color, style, label : str
        Of the lines.
    """
    gap = np.full((1, places.shape[1]), np.nan)
    line = np.concatenate([part for rows in episodes for part in (places[rows], gap)])
    ax.plot(*line.T, style, color=color, lw=1.1, label=label, zorder=1)
    starts = places[[rows[0] for rows in episodes]]
    ax.plot(*starts.T, "o", color=color, ms=2.6, zorder=1)


def _mark_ends(ax: Any, movement: Demonstrations, shown: Sequence[int]) -> None:
    stopped = {stop.episode: stop for stop in getattr(movement, "stopped", ())}
    for code in range(min(movement.n_episodes, MOST_EPISODES)):
        end = movement.states[movement.episodes == code][-1, list(shown)]
        look = {"marker": "X", "color": DIRECT} if code in stopped else {"marker": "s", "color": LEARNT}
        label = f"stopped after {stopped[code].time:.3g} s" if code in stopped else None
        ax.plot(*end[:, None], ls="", ms=6, mec="white", label=label, zorder=4, **look)


def _draw_all_over_time(movement: Demonstrations, coordinates: Sequence[int], ax: Axes) -> Axes:
    names = name_columns(movement)
    for k, i in enumerate(coordinates):
        _draw_over_time(ax, movement, i, f"C{k}", "-", names[i])
    if len(names) == 1:
        ax.set(ylabel=names[0])
    add_title(ax, "States over time")
    return ax


def _draw_over_time(
    ax: Axes, demos: Demonstrations, i: int, color: str, style: str, label: str | None
) -> None:
    time = demos.time
    if time is None:
        order = np.argsort(demos.episodes, kind="stable")
        sizes = np.bincount(demos.episodes)
        time = np.empty(len(demos))
        time[order] = np.arange(len(demos)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    places = np.column_stack([time, demos.states[:, i]])
    draw_lines(ax, places, split_episodes(demos.episodes), color, style, label)
    ax.set(xlabel="sample" if demos.time is None else "time (s)")
