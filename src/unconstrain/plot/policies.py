"""Policies as arrows: over recorded movements, and beside ordinary regression."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike, NDArray

from unconstrain.arrays import check_number
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, PolicyError
from unconstrain.motion import root_mean_square
from unconstrain.plot.arrows import find_full_speed
from unconstrain.plot.axes import add_title, check_coordinates, get_axes, label_axes
from unconstrain.plot.colors import DIRECT, LEARNT, RECORDED
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
from unconstrain.policies.inputs import as_demonstrations

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Layer:
    """One policy of a picture."""

    policy: PolicyLike
    color: str
    label: str | None
    width: float = WIDTH


def policy(
    policy: PolicyLike,
    demos: Demonstrations | ArrayLike | None = None,
    U: ArrayLike | None = None,
    *,
    groups: ArrayLike | None = None,
    coordinates: Sequence[int] | None = None,
    direct: bool = False,
    region: ArrayLike | None = None,
    full_speed: float | None = None,
    color: str = LEARNT,
    label: str | None = "learnt policy",
    ax: Axes | None = None,
) -> Axes:
    """Draw a policy as arrows, over the movements that were recorded.

    Of two states arrows stand on a grid, where there are recordings within about a spacing. Of more states they stand
    at recorded ones, spread evenly over the coordinates that are drawn. Of a single state actions are drawn against it,
    as a line. Arrows are as long as the action is fast, up to the 0.9 quantile of the speeds or three times their
    median, whichever is less; faster ones are drawn at that length, which the legend says.

    Parameters
    ----------
    policy : object with ``predict(X)``, or callable ``X -> U``
        From states (N, n) to actions (N, d).
    demos : Demonstrations, or array_like of shape (N, n), optional
        What it was learnt from, or other recordings; or their states. Without them, a fitted policy of one or two
        states is drawn where it was learnt.
    U : array_like of shape (N, d), optional
        Actions, beside states.
    groups : array_like of shape (N,), optional
        Episodes, beside states.
    coordinates : sequence of int, optional
        Which two states are drawn, or which three in space, as for `demonstrations`.
    direct : bool
        Draw what ordinary regression has learnt from the same samples below it.
    region : array_like of shape (2, n), optional
        Of one or two states: corners of a region all over which the policy is drawn, also far from what was recorded,
        where it is a guess.
    full_speed : float, optional
        The speed from which on arrows are of full length, in units of the action: give several pictures the same to
        compare them.
    color, label : str
        Of the arrows, as matplotlib names colours, and in the legend; without a label there is no legend and no title,
        as for one of many panels.
    ax : Axes, optional
        Where to draw; new axes by default.

    Returns
    -------
    Axes
        With the movements and the policy. Where actions are not velocities of the states drawn, as of a quaternion,
        there are no arrows, and the title says so.

    Raises
    ------
    DataError
        The recordings cannot be used, have no such coordinates, or are needed.
    PolicyError
        The policy's actions are not those of the recordings, or it does not know ordinary regression.
    """
    layers = [_Layer(policy, color, label)]
    if direct:
        layers.insert(0, _Layer(find_regression(policy), DIRECT, "ordinary regression", BEHIND))
    if full_speed is not None:
        check_number(full_speed, "full_speed", positive=True)
    recorded = None if demos is None else as_demonstrations(demos, U, groups)
    return _draw(layers, recorded, policy, coordinates, region, full_speed, ax)


def comparison(
    policy: PolicyLike,
    demos: Demonstrations | ArrayLike,
    U: ArrayLike | None = None,
    *,
    groups: ArrayLike | None = None,
    other: PolicyLike | None = None,
    labels: tuple[str, str] = ("learnt policy", "ordinary regression"),
    coordinates: Sequence[int] | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw a policy over ordinary regression of the same samples, and say how far apart they are.

    Parameters
    ----------
    policy : Policy, or object with ``predict(X)``, or callable ``X -> U``
        From states (N, n) to actions (N, d).
    demos : Demonstrations, or array_like of shape (N, n)
        Recordings, or their states.
    U : array_like of shape (N, d), optional
        Actions, beside states.
    groups : array_like of shape (N,), optional
        Episodes, beside states.
    other : object with ``predict(X)``, or callable ``X -> U``, optional
        What to draw in place of ordinary regression, which a fitted policy of this library knows.
    labels : tuple of str
        Of the policy and of the other one, in the legend.
    coordinates : sequence of int, optional
        Which two states are drawn, or which three in space, as for `demonstrations`.
    ax : Axes, optional
        Where to draw; new axes by default.

    Returns
    -------
    Axes
        As `policy` draws it, with the other one's arrows, broad, below those of the policy. The title has the root mean
        square of their difference over the recorded states, as a share of that of the policy.

    Raises
    ------
    DataError
        The recordings cannot be used, or have no such coordinates.
    PolicyError
        A policy's actions are not those of the recordings, or ordinary regression is not known.
    """
    recorded = as_demonstrations(demos, U, groups)
    rival = find_regression(policy) if other is None else other
    layers = [_Layer(rival, DIRECT, labels[1], BEHIND), _Layer(policy, LEARNT, labels[0])]
    ax = _draw(layers, recorded, policy, coordinates, None, None, ax)
    X = recorded.states[thin_evenly(len(recorded), MOST_POINTS)]
    P, Q = predict(policy, X), predict(rival, X)
    size = root_mean_square(P)
    if size > 0:
        apart = root_mean_square(P - Q)
        ax.set_title(f"{ax.get_title()}: {apart / size:.0%} apart", fontsize=10.5)
    return ax


def find_regression(policy: Any) -> Policy:
    """Return ordinary regression of what a policy was learnt from.

    Parameters
    ----------
    policy : Policy
        Fitted.

    Returns
    -------
    Policy
        That predicts.

    Raises
    ------
    PolicyError
        It is no policy of this library, or does not know it.
    """
    found = policy.ordinary_regression() if isinstance(policy, Policy) else None
    if found is None:
        raise PolicyError(
            "this policy does not know ordinary regression of what it was learnt from: fit one with risk='direct', and "
            "give it as uc.plot.comparison(policy, demos, other=...)"
        )
    return found


def _draw(
    layers: Sequence[_Layer],
    demos: Demonstrations | None,
    learnt: PolicyLike,
    coordinates: Sequence[int] | None,
    region: ArrayLike | None,
    full_speed: float | None,
    ax: Any,
) -> Axes:
    """Draw policies over recordings, the last layer on top."""
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
    full = full_speed
    if full is None:
        full = find_full_speed(np.concatenate(vectors) / stretch(spacing))
    for layer, each in zip(layers, vectors, strict=True):
        draw_arrows(ax, places, each, spacing, layer.color, layer.label, full, layer.width)
    if not quiet:
        moves = any(each.any() for each in vectors)
        note = _note(full, demos, shown, spacing) if moves else "at rest everywhere"
        add_title(ax, _title(layers), note)
    return ax


def _title(layers: Sequence[_Layer]) -> str:
    title = " and ".join(str(layer.label) for layer in reversed(layers))
    return title[:1].upper() + title[1:]


def _note(full: float, demos: Demonstrations, shown: Sequence[int], spacing: Array) -> str:
    if (stretch(spacing) != 1.0).any():
        return "the fastest arrows are drawn shorter, to one length"
    return f"longest arrows: {full:.3g} {unit_of_speed(demos, shown)}".rstrip() + " or faster"


def _draw_lines(
    ax: Axes, layers: Sequence[_Layer], demos: Demonstrations, corners: Array | None, is_recorded: bool
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
