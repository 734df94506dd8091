"""Learnt constraints: where the rows point, over what was recorded."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike, NDArray

from unconstrain.arrays import quote
from unconstrain.constraints.learnt.base import LearntConstraint
from unconstrain.constraints.learnt.lines import align
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, PolicyError
from unconstrain.plot.axes import check_coordinates, get_axes, label_axes
from unconstrain.plot.colors import DIRECT
from unconstrain.plot.columns import find_velocities
from unconstrain.plot.fields import draw_arrows, pick_columns, spread_samples
from unconstrain.plot.movements import demonstrations
from unconstrain.policies.inputs import as_demonstrations

Array = NDArray[np.float64]


def constraint(
    learnt: LearntConstraint,
    demos: Demonstrations | ArrayLike,
    U: ArrayLike | None = None,
    *,
    groups: ArrayLike | None = None,
    coordinates: Sequence[int] | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the rows of a constraint, the directions of no motion, over the recorded movements.

    Parameters
    ----------
    learnt : ConstantConstraint, FeatureConstraint or MechanismConstraint
        Fitted.
    demos : Demonstrations, or array_like of shape (N, n)
        Recordings, or their states. Where actions are velocities of two or three states, rows are arrows at recorded
        ones; else their mean squares are a table, a row each and a column for each action.
    U : array_like of shape (N, d), optional
        Actions, beside states.
    groups : array_like of shape (N,), optional
        Episodes, beside states.
    coordinates : sequence of int, optional
        Draw the rows over two or three states, as for `demonstrations`, whatever there are; an arrow is then shorter
        the more of its row lies along others. By default three states are drawn in space, unless `ax` is a plane.
    ax : Axes, optional
        Where to draw; new axes by default.

    Returns
    -------
    Axes
        With the rows.

    Raises
    ------
    DataError
        The recordings have other states or actions than the constraint, or no such coordinates.
    PolicyError
        It is no constraint.
    """
    if not isinstance(learnt, LearntConstraint):
        raise PolicyError(
            f"a constraint is one that was learnt, such as ConstantConstraint, not {quote(learnt)}"
        )
    demos = as_demonstrations(demos, U, groups)
    A, n, d = learnt.rows(demos.states), demos.states.shape[1], demos.actions.shape[1]
    if A.shape[2] != d:
        raise DataError(f"the constraint is one of {A.shape[2]} actions, and the recordings have {d}")
    velocities = find_velocities(demos.space, d)
    in_space = coordinates is None and n == 3 and ax is None
    shown = check_coordinates((0, 1, 2) if in_space else coordinates, n, ax)
    own = [velocities[i] for i in shown]
    is_small = n in (2, 3) and None not in own
    if coordinates is None and not is_small:
        ax = get_axes(ax)
        _draw_table(ax, A, demos.action_names)
        return ax
    if None in own:
        raise DataError(
            "rows are drawn over states whose velocities are actions: choose others with coordinates="
        )
    ax = get_axes(ax, len(shown))
    demonstrations(demos, coordinates=shown, ax=ax)
    label_axes(ax, demos, shown)
    places = demos.states[:, list(shown)]
    # Rows have one length, so the cells have one side also where the axes' scales differ.
    picked, spacing = spread_samples(places, is_square=True)
    for rows in A.swapaxes(0, 1):
        arrows = pick_columns(align(rows)[picked], own)
        draw_arrows(ax, places[picked], arrows, spacing, DIRECT, None, 1.0)
    k = A.shape[1]
    ax.set_title(f"{k} of {d} directions constrained", fontsize=10.5)
    return ax


def _draw_table(ax: Any, A: Array, action_names: Sequence[str]) -> None:
    image = ax.imshow(np.mean(A**2, axis=0), cmap="Blues", vmin=0, vmax=1, aspect="auto")
    ax.set_xticks(range(A.shape[2]), action_names, rotation=45, ha="right")
    ax.set_yticks(range(A.shape[1]), [f"row {j + 1}" for j in range(A.shape[1])])
    ax.set_title("Mean squares of the rows", fontsize=10.5)
    ax.figure.colorbar(image, ax=ax, label="share of the action in the row")
