"""Pictures of policies and demonstrations, drawn on matplotlib's `Figure` and `Axes`; no window, no global state.

The colours are those of Okabe and Ito, which stay apart for colour-blind readers and in greyscale.
"""

import os
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from unconstrain import atomic
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import PolicyError, UnconstrainError
from unconstrain.motion import directions

Array = NDArray[np.float64]

TRUE, LEARNT, DIRECT, RECORDED = "#000000", "#0072B2", "#D55E00", "#777777"
SUFFIXES = (".png", ".svg", ".pdf")

SHOWN_COORDINATES = 3
LONGEST_ARROW = 1.5
"""In spacings of the arrows: shorter, and slow regions show no direction; longer, and arrows run together."""
SHOWN_POINTS = 4000
"""A scatter of more points than this is thinned: it would only grow the file."""


def field(
    ax: Axes,
    policy: Any,
    low: ArrayLike = (-1.0, -1.0),
    high: ArrayLike = (1.0, 1.0),
    *,
    n: int = 15,
    near: ArrayLike | None = None,
    color: str = LEARNT,
    label: str | None = None,
    longest: float | None = None,
) -> None:
    """Draw a policy over two states as arrows on a grid, each beginning at its state.

    Parameters
    ----------
    ax : Axes
    policy : object with ``predict(X)``, or callable ``X -> U``
        From states (N, 2) to actions (N, 2).
    low, high : array (2,)
        Corners of the region, in units of the states.
    n : int
        Arrows along each side.
    near : array (N, 2), optional
        Draw an arrow only where one of these states is within a grid spacing: away from the data a policy
        is a guess, and a picture should not pretend otherwise.
    color, label
        Of the arrows, and in the legend.
    longest : float, optional
        Length of action drawn one grid spacing long; give the same to several fields to compare them. By
        default the longest arrow spans one and a half spacings.
    """
    low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    x, y = (np.linspace(a, b, n) for a, b in zip(low, high, strict=True))
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    spacing = np.where(high > low, (high - low) / max(n - 1, 1), 1.0)
    if near is not None:
        distance, _ = cKDTree(np.asarray(near) / spacing).query(points / spacing)
        points = points[distance <= 1.0]
    reach = float(spacing.min()) * (LONGEST_ARROW if longest is None else 1.0)
    _arrows(ax, points, _actions(policy, points), reach, color, label, longest)
    _labelled(ax, ("x1", "x2"))


def trajectories(
    ax: Axes,
    states: ArrayLike,
    episodes: ArrayLike,
    *,
    coordinates: tuple[int, int] = (0, 1),
    color: str = RECORDED,
    style: str = ":",
    label: str | None = None,
) -> None:
    """Draw movements: states (N, n), one line for each value of episodes (N,), over two coordinates."""
    X, episodes = np.asarray(states)[:, list(coordinates)], np.asarray(episodes)
    for i, episode in enumerate(np.unique(episodes)):
        path = X[episodes == episode]
        ax.plot(*path.T, style, color=color, lw=1.1, label=label if i == 0 else None, zorder=1)
        ax.plot(*path[0], "o", color=color, ms=2.6, zorder=1)


def agreement(ax: Axes, actions: ArrayLike, predictions: ArrayLike) -> None:
    """Draw what the recordings can say of a policy: û·π(x) learnt, against r = ‖u‖ recorded.

    A point on the diagonal is a sample that agrees with the policy in the direction that was free; its
    vertical distance is what the inconsistency squares. Samples that do not move are left out.
    """
    unit, length = directions(np.asarray(actions, dtype=np.float64))
    along = np.einsum("nd,nd->n", unit, np.asarray(predictions, dtype=np.float64))
    length, along = length[length > 0], along[length > 0]
    step = max(1, len(length) // SHOWN_POINTS)
    top = float(length.max(initial=0.0)) * 1.05 or 1.0
    ax.plot([0, top], [0, top], color=TRUE, lw=1, ls="--", label="agreement", zorder=1)
    ax.plot(length[::step], along[::step], ".", color=LEARNT, ms=5, alpha=0.35, mec="none", label="samples")
    ax.set_xlim(0, top)
    ax.set(xlabel="recorded speed  r = ‖u‖", ylabel="learnt, same direction  û·π(x)")
    _titled(ax, "Recorded and learnt actions")


def learned_field(
    demonstrations: Demonstrations, policy: Any, names: tuple[str, ...] | None = None
) -> Figure:
    """The recorded movement and the policy learnt from it.

    Over two states: the movement dotted, the policy as arrows on a grid wherever there are data. Over more:
    every pair of the first three coordinates, with arrows at some of the recorded states. Over one: the
    action against the state. And always the recorded actions against the learnt ones (`agreement`).

    Parameters
    ----------
    demonstrations : Demonstrations
    policy : object with ``predict(X)``, or callable ``X -> U``
        Where the actions are not velocities of the states, one each, only the movement is drawn, no arrows.
    names : of the states, optional
        By default those of the demonstrations.

    Raises
    ------
    PolicyError
        If the policy's actions do not match those of the demonstrations.
    """
    X, U = demonstrations.states, demonstrations.actions
    names = tuple(names or demonstrations.state_names)
    P = _actions(policy, X)
    if P.shape != U.shape:
        raise PolicyError(
            f"the policy has {P.shape[1]} actions and the demonstrations {U.shape[1]}: draw the ones it learnt"
        )
    arrows = X.shape[1] == U.shape[1]
    pairs = list(combinations(range(min(X.shape[1], SHOWN_COORDINATES)), 2))
    if len(pairs) == 3:
        figure = Figure(figsize=(9.0, 8.4), layout="constrained")
        panels = figure.subplots(2, 2).ravel()
    else:
        figure = Figure(figsize=(9.6, 4.6), layout="constrained")
        panels = figure.subplots(1, 2)

    for ax, (i, j) in zip(panels, pairs, strict=False):
        trajectories(ax, X, demonstrations.episodes, coordinates=(i, j), label="recorded movement")
        if X.shape[1] == 2 and arrows:
            low, high = X.min(axis=0), X.max(axis=0)
            field(ax, policy, low, high, n=17, near=X, label="learnt policy")
        elif arrows:
            picked, cell = _spread(X[:, [i, j]])
            reach = LONGEST_ARROW * cell
            _arrows(
                ax, X[picked][:, [i, j]], U[picked][:, [i, j]], reach, DIRECT, "recorded action", None, 0.009
            )
            longest = float(np.linalg.norm(U[picked][:, [i, j]], axis=1).max())
            _arrows(ax, X[picked][:, [i, j]], P[picked][:, [i, j]], reach, LEARNT, "learnt policy", longest)
        _labelled(ax, (names[i], names[j]))
        _titled(ax, "Recorded movement, learnt policy" if len(pairs) == 1 else f"{names[j]} over {names[i]}")
    if not pairs:
        order = np.argsort(X[:, 0])
        panels[0].plot(X[:, 0], U, ".", color=RECORDED, ms=3, label="recorded actions")
        panels[0].plot(X[order, 0], P[order], color=LEARNT, label="learnt policy")
        panels[0].set(xlabel=names[0], ylabel=", ".join(demonstrations.action_names))
        _titled(panels[0], "Recorded actions, learnt policy")
    agreement(panels[-1], U, P)
    if X.shape[1] > SHOWN_COORDINATES:
        figure.suptitle(f"The first {SHOWN_COORDINATES} of {X.shape[1]} coordinates", fontsize=11)
    return figure


def check_suffix(path: str | os.PathLike[str] | None) -> None:
    """Raise `UnconstrainError` for a figure's name that does not end in one of `SUFFIXES`; None is no figure."""
    if path is not None and Path(path).suffix.lower() not in SUFFIXES:
        raise UnconstrainError(
            f"a figure cannot be written to {Path(path).name!r}: end the name in {', '.join(SUFFIXES[:-1])} or "
            f"{SUFFIXES[-1]}"
        )


def save(figure: Figure, path: str | os.PathLike[str]) -> Path:
    """Write a figure as PNG, SVG or PDF, whichever the name ends in; whole or not at all.

    Raises
    ------
    UnconstrainError
        If the name ends in anything else, or cannot be written to.
    """
    check_suffix(path)
    path = Path(path)
    suffix = path.suffix.lower()
    # Without the date the same figure is the same file.
    metadata: dict[str, Any] = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(suffix, {})
    with atomic.replacing(path) as temporary:
        figure.savefig(temporary, format=suffix[1:], dpi=200, metadata=metadata)
    return path


def _actions(policy: Any, X: Array) -> Array:
    P = np.asarray(policy.predict(X) if hasattr(policy, "predict") else policy(X), dtype=np.float64)
    return P[:, None] if P.ndim == 1 else P


def _arrows(
    ax: Axes,
    points: Array,
    vectors: Array,
    reach: float,
    color: str,
    label: str | None,
    longest: float | None,
    width: float = 0.0042,
) -> None:
    lengths = np.linalg.norm(vectors, axis=1)
    scale = (longest or float(lengths.max(initial=0.0)) or 1.0) / reach
    ax.quiver(
        *points.T, *vectors.T, angles="xy", scale_units="xy", scale=scale, color=color, label=label,
        width=width, headwidth=3.2, headlength=3.6, headaxislength=3.3, minlength=0.5, zorder=2,
    )  # fmt: skip


def _spread(points: Array, cells: int = 13) -> tuple[NDArray[np.intp], float]:
    """One sample per occupied cell of a grid over the points (N, 2), and the cell's shorter side."""
    low, span = points.min(axis=0), np.ptp(points, axis=0)
    side = np.where(span > 0, span, 1.0) / cells
    place = np.minimum((points - low) // side, cells - 1)
    off_centre = np.linalg.norm((points - low) / side - place - 0.5, axis=1)
    order = np.argsort(off_centre, kind="stable")
    _, first = np.unique(place[order], axis=0, return_index=True)
    return order[first], float(side.min())


def _labelled(ax: Axes, names: tuple[str, str]) -> None:
    ax.set(xlabel=names[0], ylabel=names[1])
    ax.set_aspect("equal", adjustable="datalim")


def _titled(ax: Axes, title: str) -> None:
    """A title, and between it and the axes the legend, where it hides no data."""
    handles, labels = ax.get_legend_handles_labels()
    shown = dict(zip(labels, handles, strict=True))
    if shown:
        ax.legend(
            list(shown.values()), list(shown), loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=len(shown),
            frameon=False, fontsize=8, columnspacing=1.4, handlelength=1.8, borderaxespad=0.2,
        )  # fmt: skip
    ax.set_title(title, fontsize=10.5, pad=20 if shown else 6)
