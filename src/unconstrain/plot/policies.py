"""Policies as arrows: over recorded movements, and beside ordinary regression."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike, NDArray

from unconstrain.arrays import check_number
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import PolicyError
from unconstrain.motion import root_mean_square
from unconstrain.plot.colors import DIRECT, LEARNT
from unconstrain.plot.fields import BEHIND, PolicyLike, predict
from unconstrain.plot.layers import Layer, draw_layers
from unconstrain.plot.thinning import MOST_POINTS, thin_evenly
from unconstrain.policies.base import Policy
from unconstrain.policies.inputs import as_demonstrations

Array = NDArray[np.float64]


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
    at recorded ones, spread evenly over the coordinates that are drawn, with the recorded actions below. Of a single
    state actions are drawn against it, as a line. Arrows are as long as the action is fast, up to the 0.9 quantile of
    the speeds or three times their median, whichever is less; faster ones are drawn at that length, which the legend
    says.

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
    layers = [Layer(policy, color, label)]
    if direct:
        layers.insert(0, Layer(find_regression(policy), DIRECT, "ordinary regression", BEHIND))
    if full_speed is not None:
        check_number(full_speed, "full_speed", positive=True)
    recorded = None if demos is None else as_demonstrations(demos, U, groups)
    return draw_layers(layers, recorded, policy, coordinates, region, full_speed, ax)


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
        square of their difference over the recorded states, as a share of that of the policy, both in units of the
        policy's `scale_`.

    Raises
    ------
    DataError
        The recordings cannot be used, or have no such coordinates.
    PolicyError
        A policy's actions are not those of the recordings, or ordinary regression is not known.
    """
    recorded = as_demonstrations(demos, U, groups)
    rival = find_regression(policy) if other is None else other
    layers = [Layer(rival, DIRECT, labels[1], BEHIND), Layer(policy, LEARNT, labels[0])]
    ax = draw_layers(layers, recorded, policy, coordinates, None, None, ax)
    X = recorded.states[thin_evenly(len(recorded), MOST_POINTS)]
    P, Q = predict(policy, X), predict(rival, X)
    if isinstance(policy, Policy):  # degrees and metres have no common length otherwise
        P, Q = policy.scaled(P), policy.scaled(Q)
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
