"""Policies as arrows: over the recorded movement, beside each other, and against the recorded actions."""

from collections.abc import Callable, Mapping
from itertools import combinations, cycle
from typing import Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from unconstrain.arrays import (
    check_actions,
    check_finite,
    check_number,
    check_numbers,
    check_whole,
    quote,
)
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, PolicyError
from unconstrain.memory import check_memory
from unconstrain.motion import directions
from unconstrain.plot.axes import add_title, check_coordinates, check_region, get_axes, label_plane
from unconstrain.plot.colors import DIRECT, LEARNT, RECORDED, SERIES, TRUE
from unconstrain.plot.trajectories import trajectory

Array = NDArray[np.float64]


class Predictor(Protocol):
    """Anything with a `predict` method from states to actions: policies of this library, scikit-learn's regressors."""

    def predict(self, X: Array, /) -> ArrayLike:
        """Return actions (N, d) at states X (N, n)."""
        ...


Policy = Predictor | Callable[[Array], ArrayLike]

SHOWN_COORDINATES = 3
LONGEST_ARROW = 1.5
"""In spacings of the arrows: shorter, and slow regions show no direction; longer, and arrows run together."""
ARROWS_ALONG = 17
"""Arrows along each side of a plane of states."""
CELLS_ALONG = 13
"""Cells along each side of a projection of the states; each that holds samples has an arrow."""
SHOWN_POINTS = 4000
"""A scatter of more points than this is thinned: it would only grow the file."""
WIDTH, BEHIND = 0.0042, 0.009
"""Widths of arrows, in widths of the axes: of those in front, and of those that others are drawn over."""


def field(
    policy: Policy,
    low: ArrayLike = (-1.0, -1.0),
    high: ArrayLike = (1.0, 1.0),
    *,
    n: int = 15,
    near: ArrayLike | None = None,
    color: str = LEARNT,
    label: str | None = None,
    longest: float | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw a policy over two states as arrows on a grid, each beginning at its state.

    Parameters
    ----------
    policy : object with ``predict(X)``, or callable ``X -> U``
        From states (N, 2) to actions (N, 2).
    low, high : array_like of shape (2,)
        Corners of the region, in units of the states.
    n : int
        Arrows along each side.
    near : array_like of shape (N, 2), optional
        Draw an arrow only where one of these states is within a grid spacing: away from the data a policy
        is a guess, and a picture should not pretend otherwise.
    color : str
        Of the arrows.
    label : str, optional
        In the legend.
    longest : float, optional
        Length of action drawn one grid spacing long; give the same to several fields to compare them. By
        default the longest arrow spans one and a half spacings.
    ax : Axes, optional
        Where to draw; new axes by default.

    Returns
    -------
    Axes
        With the arrows.
    """
    points, spacing = _grid(low, high, check_whole(n, "n", least=1), near)
    if longest is not None:
        check_number(longest, "longest", positive=True)
    ax = get_axes(ax)
    reach = spacing * (LONGEST_ARROW if longest is None else 1.0)
    _draw_arrows(ax, points, _predict(policy, points), reach, color, label, longest)
    label_plane(ax, ("x1", "x2"))
    return ax


def policy(
    policy: Policy,
    demonstrations: Demonstrations,
    *,
    coordinates: tuple[int, int] = (0, 1),
    ax: Axes | None = None,
) -> Axes:
    """Draw the recorded movement, and the policy learnt from it as arrows where there are data.

    Parameters
    ----------
    policy : object with ``predict(X)``, or callable ``X -> U``
        From states (N, n) to actions (N, d). Where actions are not velocities of the states, one each, only the
        movement is drawn. Over a single state the actions are drawn against it.
    demonstrations : Demonstrations
        What it was learnt from, or other recordings. Of more than two states, arrows stand at some of the recorded
        ones, over the recorded actions.
    coordinates : tuple of int
        Which two of the states are drawn, counted from 0.
    ax : Axes, optional
        Where to draw; new axes by default.

    Returns
    -------
    Axes
        With the movement and the policy.

    Raises
    ------
    PolicyError
        If the policy's actions do not match those of the demonstrations.
    """
    P = _matching(policy, demonstrations)
    if demonstrations.states.shape[1] > 1:
        check_coordinates(coordinates, demonstrations.states.shape[1])
    ax = get_axes(ax)
    _draw_policy(ax, policy, P, demonstrations, coordinates)
    return ax


def comparison(
    policies: Mapping[str, Policy],
    demonstrations: Demonstrations,
    *,
    coordinates: tuple[int, int] = (0, 1),
    ax: Axes | None = None,
) -> Axes:
    """Draw several policies over the recorded movement, arrows to one scale.

    Parameters
    ----------
    policies : mapping from str to policy
        Policies by name, such as ``{"learnt": policy, "ordinary regression": other}``; the first is drawn on top.
    demonstrations : Demonstrations
        Recordings whose actions are velocities of the states, of at least two states.
    coordinates : tuple of int
        Which two of the states are drawn, counted from 0.
    ax : Axes, optional
        Where to draw; new axes by default.

    Returns
    -------
    Axes
        With the movement, and an arrow of each policy at some of the recorded states.

    Raises
    ------
    PolicyError
        If actions are not velocities of two or more states, or a policy's actions do not match the recorded ones.
    """
    X, U = demonstrations.states, demonstrations.actions
    if X.shape != U.shape or X.shape[1] < 2:
        raise PolicyError(
            f"policies are compared as arrows over two or more states, one action a state, and the demonstrations "
            f"have {X.shape[1]} states and {U.shape[1]} actions"
        )
    i, j = check_coordinates(coordinates, X.shape[1])
    if not isinstance(policies, Mapping) or not policies:
        raise PolicyError(
            f"policies must be a mapping from names to one policy or more, got {quote(policies)}"
        )
    every = [_matching(each, demonstrations) for each in policies.values()]
    ax = get_axes(ax)
    trajectory(demonstrations, coordinates=coordinates, label="recorded movement", ax=ax)
    shown, cell = _spread(X[:, [i, j]])
    vectors = [each[shown][:, [i, j]] for each in every]
    longest = max(float(np.linalg.norm(each, axis=1).max()) for each in vectors)
    points, reach = X[shown][:, [i, j]], LONGEST_ARROW * cell
    # Narrow arrows over wide ones, so that all are seen where they agree.
    layers = zip(policies, vectors, cycle(SERIES), np.linspace(WIDTH, BEHIND, len(vectors)), strict=False)
    for name, each, color, width in reversed(list(layers)):
        _draw_arrows(ax, points, each, reach, color, name, longest, float(width))
    add_title(ax, "Policies over the recorded movement")
    return ax


def agreement(actions: ArrayLike, predictions: ArrayLike, *, ax: Axes | None = None) -> Axes:
    """Draw what the recordings can say of a policy: û·π(x) learnt, against r = ‖u‖ recorded.

    A point on the diagonal is a sample that agrees with the policy in the direction that was free; its
    vertical distance is what the inconsistency squares. Samples that do not move are left out.

    Parameters
    ----------
    actions : array_like of shape (N, d)
        Recorded actions.
    predictions : array_like of shape (N, d)
        Actions of the policy at the same states.
    ax : Axes, optional
        Where to draw; new axes by default.

    Returns
    -------
    Axes
        With a point a sample.

    Raises
    ------
    DataError
        The arrays are not finite, or of different shapes.
    """
    U, P = check_actions(actions), check_actions(predictions, "predictions")
    if U.shape != P.shape:
        raise DataError(f"actions {U.shape} and predictions {P.shape} must have the same shape")
    ax = get_axes(ax)
    unit, length = directions(U)
    along = np.einsum("nd,nd->n", unit, P)
    length, along = length[length > 0], along[length > 0]
    step = max(1, len(length) // SHOWN_POINTS)
    top = float(length.max(initial=0.0)) * 1.05 or 1.0
    ax.plot([0, top], [0, top], color=TRUE, lw=1, ls="--", label="agreement", zorder=1)
    ax.plot(length[::step], along[::step], ".", color=LEARNT, ms=5, alpha=0.35, mec="none", label="samples")
    ax.set_xlim(0, top)
    ax.set(xlabel="recorded speed  r = ‖u‖", ylabel="learnt, same direction  û·π(x)")
    add_title(ax, "Recorded and learnt actions")
    return ax


def policy_figure(learnt: Policy, demonstrations: Demonstrations) -> Figure:
    """Draw the recorded movement and the policy learnt from it, and how well they agree.

    Parameters
    ----------
    learnt : object with ``predict(X)``, or callable ``X -> U``
        From states (N, n) to actions (N, d).
    demonstrations : Demonstrations
        What it was learnt from. Of more than two states, every pair of the first three is drawn.

    Returns
    -------
    Figure
        With a panel of `policy` for each pair of states, and one of `agreement`.

    Raises
    ------
    PolicyError
        If the policy's actions do not match those of the demonstrations.
    """
    P = _matching(learnt, demonstrations)
    n = demonstrations.states.shape[1]
    pairs = list(combinations(range(min(n, SHOWN_COORDINATES)), 2)) or [(0, 0)]
    size, shape = ((9.0, 8.4), (2, 2)) if len(pairs) == 3 else ((9.6, 4.6), (1, 2))
    figure = Figure(figsize=size, layout="constrained")
    panels = figure.subplots(*shape).ravel()
    for ax, pair in zip(panels, pairs, strict=False):
        _draw_policy(ax, learnt, P, demonstrations, pair)
    agreement(demonstrations.actions, P, ax=panels[-1])
    if n > SHOWN_COORDINATES:
        figure.suptitle(f"The first {SHOWN_COORDINATES} of {n} coordinates", fontsize=11)
    return figure


def _draw_policy(
    ax: Axes, policy: Policy, P: Array, demonstrations: Demonstrations, coordinates: tuple[int, int]
) -> None:
    """Draw a policy whose actions at the recorded states are P (N, d); see `policy`."""
    X, U, names = demonstrations.states, demonstrations.actions, demonstrations.state_names
    if X.shape[1] == 1:
        order = np.argsort(X[:, 0])
        ax.plot(X[:, 0], U, ".", color=RECORDED, ms=3, label="recorded actions")
        ax.plot(X[order, 0], P[order], color=LEARNT, label="learnt policy")
        ax.set(xlabel=names[0], ylabel=", ".join(demonstrations.action_names))
        add_title(ax, "Recorded actions, learnt policy")
        return
    i, j = coordinates
    trajectory(demonstrations, coordinates=coordinates, label="recorded movement", ax=ax)
    if X.shape == U.shape and X.shape[1] == 2:
        low, high = X.min(axis=0), X.max(axis=0)
        field(policy, low, high, n=ARROWS_ALONG, near=X, label="learnt policy", ax=ax)
        label_plane(ax, (names[i], names[j]))
    elif X.shape == U.shape:
        shown, cell = _spread(X[:, [i, j]])
        points, recorded, learnt = (values[shown][:, [i, j]] for values in (X, U, P))
        longest = float(np.linalg.norm(recorded, axis=1).max())
        reach = LONGEST_ARROW * cell
        _draw_arrows(ax, points, recorded, reach, DIRECT, "recorded action", longest, BEHIND)
        _draw_arrows(ax, points, learnt, reach, LEARNT, "learnt policy", longest)
    add_title(ax, "Recorded movement, learnt policy" if X.shape[1] == 2 else f"{names[j]} over {names[i]}")


def _predict(policy: Policy, X: Array) -> Array:
    predict = getattr(policy, "predict", policy)
    if not callable(predict):
        raise PolicyError(f"a policy has a method predict, or is a function of states, not {quote(policy)}")
    return check_actions(predict(X), "the policy's actions")


def _matching(policy: Policy, demonstrations: Demonstrations) -> Array:
    """Predict at the recorded states, and check that the actions are of the same dimension."""
    P = _predict(policy, demonstrations.states)
    if P.shape != demonstrations.actions.shape:
        raise PolicyError(
            f"the policy has {P.shape[1]} actions and the demonstrations {demonstrations.actions.shape[1]}: draw the "
            "ones it learnt"
        )
    return P


def _grid(low: ArrayLike, high: ArrayLike, n: int, near: ArrayLike | None) -> tuple[Array, float]:
    """Points of a grid (M, 2), those near some states only, and the shorter of its spacings."""
    low, high = check_region(low, high)
    check_memory(8.0 * 20.0 * n * n, f"a field of {n:,} by {n:,} arrows", "draw fewer with n=")
    x, y = (np.linspace(a, b, n) for a, b in zip(low, high, strict=True))
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    spacing = np.where(high > low, (high - low) / max(n - 1, 1), 1.0)
    if near is not None:
        from scipy.spatial import cKDTree  # slow to import

        states = check_numbers(near, "near")
        if states.ndim != 2 or states.shape[1] != 2:
            raise DataError(f"near must be states (N, 2), got shape {states.shape}")
        check_finite(states, "near")
        distance, _ = cKDTree(states / spacing).query(points / spacing)
        points = points[distance <= 1.0]
    return points, float(spacing.min())


def _draw_arrows(
    ax: Axes,
    points: Array,
    vectors: Array,
    reach: float,
    color: str,
    label: str | None,
    longest: float | None,
    width: float = WIDTH,
) -> None:
    """Draw a vector of length `longest`, or else the longest there is, as an arrow of length `reach`."""
    lengths = np.linalg.norm(vectors, axis=1)
    scale = (longest or float(lengths.max(initial=0.0)) or 1.0) / reach
    ax.quiver(
        *points.T, *vectors.T, angles="xy", scale_units="xy", scale=scale, color=color, label=label,
        width=width, headwidth=3.2, headlength=3.6, headaxislength=3.3, minlength=0.5, zorder=2,
    )  # fmt: skip


def _spread(points: Array) -> tuple[NDArray[np.intp], float]:
    """One sample per occupied cell of a grid over the points (N, 2), and the cell's shorter side."""
    low, span = points.min(axis=0), np.ptp(points, axis=0)
    side = np.where(span > 0, span, 1.0) / CELLS_ALONG
    place = np.minimum((points - low) // side, CELLS_ALONG - 1)
    off_centre = np.linalg.norm((points - low) / side - place - 0.5, axis=1)
    order = np.argsort(off_centre, kind="stable")
    _, first = np.unique(place[order], axis=0, return_index=True)
    return order[first], float(side.min())
