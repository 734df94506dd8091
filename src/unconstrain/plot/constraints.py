"""Learnt constraints: how the motion is shared out among directions, and where the rows point."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from unconstrain.constraints.learnt.base import LearntConstraint
from unconstrain.constraints.learnt.lines import align
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.plot.axes import get_axes, label_plane
from unconstrain.plot.colors import DIRECT, LEARNT, RECORDED

ARROWS = 60
ARROW_LENGTH = 0.12
"""In extents of the recording."""
SHOWN_POINTS = 1000


def shares_of_motion(learnt: LearntConstraint, *, ax: Axes | None = None) -> Axes:
    """Draw how much of the motion there was along each direction, constrained ones marked.

    Parameters
    ----------
    learnt : ConstantConstraint or FeatureConstraint
        A fitted constraint.
    ax : Axes, optional
        Where to draw; new axes by default.

    Returns
    -------
    Axes
        With a bar for each direction, from the one least moved in.
    """
    ax = get_axes(ax)
    shares, k, d = learnt.shares_, learnt.n_constraints_, learnt.n_actions_
    every = len(shares) == d
    bars = shares if every else np.append(shares, 1.0 - shares.sum())
    names = [f"{i + 1}" for i in range(len(shares))] + ([] if every else ["all others"])
    ax.bar(names, 100 * bars, color=[DIRECT] * k + [LEARNT] * (len(bars) - k))
    for i, share in enumerate(bars):
        ax.annotate(f"{share:.2%}", (i, 100 * share), ha="center", va="bottom", fontsize=9)
    ax.set(
        xlabel="direction, from the least moved in", ylabel="share of motion (%)",
        title=f"{k} of {d} directions constrained",
    )  # fmt: skip
    return ax


def constraint(learnt: LearntConstraint, demonstrations: Demonstrations, *, ax: Axes | None = None) -> Axes:
    """Draw the rows of a constraint over the recorded states.

    Parameters
    ----------
    learnt : ConstantConstraint or FeatureConstraint
        A fitted constraint.
    demonstrations : Demonstrations
        What it was learnt from. Where actions are velocities of two or three positions, rows are arrows at the
        recorded points; else their mean squares are a table, a row each and a column for each action.
    ax : Axes, optional
        Where to draw, in three dimensions for three positions; new axes by default.

    Returns
    -------
    Axes
        With the rows.

    Raises
    ------
    DataError
        The demonstrations have other states or actions than the constraint.
    """
    A = learnt.rows(demonstrations.states)
    d = demonstrations.actions.shape[1]
    if A.shape[2] != d:
        raise DataError(f"the constraint is one of {A.shape[2]} actions, and the demonstrations have {d}")
    if demonstrations.states.shape[1] == A.shape[2] == 3:
        return _draw_in_space(ax, A, demonstrations)
    ax = get_axes(ax)
    if demonstrations.states.shape[1] == A.shape[2] == 2:
        _draw_in_plane(ax, A, demonstrations)
    else:
        _draw_table(ax, A, demonstrations.action_names)
    return ax


def constraint_figure(learnt: LearntConstraint, demonstrations: Demonstrations) -> Figure:
    """Draw how the motion is shared out among directions, and the rows of a constraint over the recorded states.

    Parameters
    ----------
    learnt : ConstantConstraint or FeatureConstraint
        A fitted constraint.
    demonstrations : Demonstrations
        What it was learnt from.

    Returns
    -------
    Figure
        With a panel of `shares_of_motion` and one of `constraint`.
    """
    figure = Figure(figsize=(10.0, 4.4), layout="constrained")
    shares_of_motion(learnt, ax=figure.add_subplot(1, 2, 1))
    space = demonstrations.states.shape[1] == demonstrations.actions.shape[1] == 3
    constraint(learnt, demonstrations, ax=figure.add_subplot(1, 2, 2, projection="3d" if space else None))
    return figure


def _draw_in_space(ax: Any, A: np.ndarray, demonstrations: Demonstrations) -> Axes:
    # Axes in space are a class of their own in matplotlib, which gives them no types.
    if ax is None:
        from matplotlib import pyplot

        ax = pyplot.figure(layout="constrained").add_subplot(projection="3d")
    X, names = demonstrations.states, demonstrations.state_names
    ax.scatter(*X[:: max(1, len(X) // SHOWN_POINTS)].T, s=5, color=RECORDED, alpha=0.5, linewidths=0)
    picked = _thin(X)
    for rows in A.swapaxes(0, 1):
        arrows = align(rows)[picked]
        ax.quiver(*X[picked].T, *arrows.T, length=ARROW_LENGTH * _extent(X), color=DIRECT, linewidth=1.0)
    ax.set(xlabel=names[0], ylabel=names[1], zlabel=names[2], title="Rows on the recorded points")
    ax.set_aspect("equal")
    ax.locator_params(nbins=5)
    return ax


def _draw_in_plane(ax: Axes, A: np.ndarray, demonstrations: Demonstrations) -> None:
    X, names = demonstrations.states, demonstrations.state_names
    ax.plot(*X.T, ".", color=RECORDED, ms=2, alpha=0.4)
    picked = _thin(X)
    ax.quiver(
        *X[picked].T, *align(A[:, 0])[picked].T, angles="xy", scale_units="xy",
        scale=1 / (ARROW_LENGTH * _extent(X)), color=DIRECT, width=0.004,
    )  # fmt: skip
    label_plane(ax, (names[0], names[1]))
    ax.set_title("Row on the recorded points")


def _draw_table(ax: Axes, A: np.ndarray, action_names: tuple[str, ...]) -> None:
    image = ax.imshow(np.mean(A**2, axis=0), cmap="Blues", vmin=0, vmax=1, aspect="auto")
    ax.set_xticks(range(A.shape[2]), action_names, rotation=45, ha="right")
    ax.set_yticks(range(A.shape[1]), [f"row {j + 1}" for j in range(A.shape[1])])
    ax.set_title("Mean squares of the rows")
    ax.figure.colorbar(image, ax=ax)


def _extent(X: np.ndarray) -> float:
    return float(np.ptp(X, axis=0).max()) or 1.0


def _thin(X: np.ndarray) -> slice:
    return slice(None, None, max(1, len(X) // ARROWS))
