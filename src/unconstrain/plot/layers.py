"""Policies drawn over each other, as arrows or, of a single state, as lines."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike, NDArray

from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, PolicyError
from unconstrain.plot.arrows import find_full_speed
from unconstrain.plot.axes import add_title, check_coordinates, get_axes, label_axes
from unconstrain.plot.colors import PALE, RECORDED
from unconstrain.plot.columns import find_velocities, name_columns, share_scale, unit_of_speed
from unconstrain.plot.fields import (
    BEHIND,
    WIDTH,
    PolicyLike,
    check_region,
    draw_arrows,
    lay_grid,
    pick_columns,
    predict,
    spread_samples,
    stretch,
)
from unconstrain.plot.movements import demonstrations
from unconstrain.plot.thinning import MOST_POINTS, thin_evenly
from unconstrain.policies.base import Policy

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Layer:
    """One policy of a picture.

    Parameters
    ----------
    policy : object with ``predict(X)``, or callable ``X -> U``
        The policy.
    color : str
        Of its arrows.
    label : str or None
        In the legend.
    width : float
        Of its arrows, in widths of the axes.
    """

    policy: PolicyLike
    color: str
    label: str | None
    width: float = WIDTH


def draw_layers(
    layers: Sequence[Layer],
    demos: Demonstrations | None,
    learnt: PolicyLike,
    coordinates: Sequence[int] | None,
    region: ArrayLike | None,
    full_speed: float | None,
    ax: Any,
) -> Axes:
    """Draw policies over recordings.

    Parameters
    ----------
    layers : sequence of Layer
        The policies, the last one on top.
    demos : Demonstrations, optional
        Recordings; without them a place is found by the region or by the policy.
    learnt : object with ``predict(X)``, or callable ``X -> U``
        The policy that the picture is about.
    coordinates : sequence of int, optional
        Which states are drawn.
    region : array_like of shape (2, n), optional
        All over which they are drawn.
    full_speed : float, optional
        From which on arrows are of full length.
    ax : Axes, optional
        Where to draw.

    Returns
    -------
    Axes
        With the policies. Alone over recordings of more than two states, a policy has the recorded actions below it.

    Raises
    ------
    DataError, PolicyError
        As for `policy` and `comparison`.
    """
    corners = None if region is None else check_region(region)
    is_recorded = demos is not None
    demos = _stand_in(learnt, corners) if demos is None else demos
    n = demos.states.shape[1]
    if corners is not None and (n > 2 or corners.shape[1] != n):
        raise DataError(
            f"region= is for one or two states, a number each in both corners, got {corners.shape[1]} for {n} states"
        )
    shown = check_coordinates(coordinates, n, ax)
    if is_recorded:
        for layer in layers:
            _check_actions(layer.policy, demos)
    ax = get_axes(ax, len(shown))
    quiet = layers[-1].label is None
    if n == 1:
        return _draw_lines(ax, layers, demos, corners, is_recorded)
    if is_recorded:
        demonstrations(demos, coordinates=shown, label=None if quiet else "recorded movement", ax=ax)
    columns = find_velocities(demos.space, demos.actions.shape[1])
    own = [columns[i] for i in shown]
    label_axes(ax, demos, shown)
    if all(each is None for each in own):
        add_title(ax, "Recorded movement; its actions are no velocities of these states")
        return ax
    is_square = share_scale(demos, shown)
    if n == 2:
        near = demos.states if corners is None else None
        extent = (
            np.stack([demos.states.min(axis=0), demos.states.max(axis=0)]) if corners is None else corners
        )
        X, spacing = lay_grid(extent, is_square=is_square, near=near)
        places, spacing = X[:, list(shown)], spacing[list(shown)]
    else:
        rows, spacing = spread_samples(demos.states[:, list(shown)], is_square=is_square)
        X, places = demos.states[rows], demos.states[rows][:, list(shown)]
    vectors = [pick_columns(predict(layer.policy, X), own) for layer in layers]
    recorded = pick_columns(demos.actions[rows], own) if n > 2 and len(layers) == 1 else None
    full = full_speed
    if full is None:
        every = vectors if recorded is None else [*vectors, recorded]
        full = find_full_speed(np.concatenate(every) / stretch(spacing))
    if recorded is not None:
        label = None if quiet else "recorded action"
        draw_arrows(ax, places, recorded, spacing, PALE, label, full, BEHIND)
    for layer, each in zip(layers, vectors, strict=True):
        draw_arrows(ax, places, each, spacing, layer.color, layer.label, full, layer.width)
    if not quiet:
        moves = any(each.any() for each in vectors)
        note = _note(full, demos, shown, spacing) if moves else "at rest everywhere"
        add_title(ax, _title(layers), note)
    return ax


def _title(layers: Sequence[Layer]) -> str:
    title = " and ".join(str(layer.label) for layer in reversed(layers))
    return title[:1].upper() + title[1:]


def _note(full: float, demos: Demonstrations, shown: Sequence[int], spacing: Array) -> str:
    if (stretch(spacing) != 1.0).any():
        return "the fastest arrows are drawn shorter, to one length"
    return f"longest arrows: {full:.3g} {unit_of_speed(demos, shown)}".rstrip() + " or faster"


def _draw_lines(
    ax: Axes, layers: Sequence[Layer], demos: Demonstrations, corners: Array | None, is_recorded: bool
) -> Axes:
    """Draw actions against a single state."""
    X = demos.states[:, 0]
    if is_recorded:
        rows = thin_evenly(len(X), MOST_POINTS)
        ax.plot(X[rows], demos.actions[rows], ".", color=RECORDED, ms=3, label="recorded actions")
    low, high = (X.min(), X.max()) if corners is None else corners[:, 0]
    line = np.linspace(low, high, 400)
    for layer in layers:
        ax.plot(line, predict(layer.policy, line[:, None]), color=layer.color, label=layer.label)
    ax.set(xlabel=name_columns(demos)[0], ylabel=", ".join(demos.action_names))
    if layers[-1].label is not None:
        add_title(ax, _title(layers))
    return ax


def _check_actions(policy: PolicyLike, demos: Demonstrations) -> None:
    d, wanted = predict(policy, demos.states[:1]).shape[1], demos.actions.shape[1]
    if d != wanted:
        raise PolicyError(f"the policy has {d} actions and the recordings {wanted}: draw the ones it learnt")


def _stand_in(learnt: PolicyLike, corners: Array | None) -> Demonstrations:
    """Make states to stand for the recordings of a policy: corners, or the middles of where it was learnt."""
    if corners is not None:
        X = corners
    elif isinstance(learnt, Policy) and learnt.n_features_in_ < 3 and learnt.space_.is_flat:
        X = learnt.region().middles
    else:
        raise DataError(
            "give the recordings beside the policy, uc.plot.policy(policy, demos), or of one or two states a region="
        )
    return Demonstrations(X, predict(learnt, X), state_names=getattr(learnt, "state_names_", None))
