"""Where arrows of a policy stand, and how they are drawn."""

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.arrays import check_actions, check_finite, check_numbers, quote
from unconstrain.errors import DataError, PolicyError
from unconstrain.plot.arrows import scale_arrows

Array = NDArray[np.float64]


class Predictor(Protocol):
    """Anything with a `predict` method from states to actions: policies of this library, scikit-learn's regressors."""

    def predict(self, X: Array, /) -> ArrayLike:
        """Return actions (N, d) at states X (N, n)."""
        ...


PolicyLike = Predictor | Callable[[Array], ArrayLike]

ARROWS_ALONG = 16
"""Arrows along the longer side of a plane of states."""
CELLS_ALONG = {2: 13, 3: 7}
"""Cells along each side of the states, by dimension; each that holds samples has an arrow."""
LONGEST_ARROW = 1.25
"""In spacings of the arrows: shorter, and slow regions show no direction; longer, and arrows run together."""
WIDTH, BEHIND = 0.0045, 0.0085
"""Widths of arrows, in widths of the axes: of those in front, and of those that others are drawn over."""


def predict(policy: PolicyLike, X: Array) -> Array:
    """Predict actions.

    Parameters
    ----------
    policy : object with ``predict(X)``, or callable ``X -> U``
        From states to actions.
    X : ndarray of shape (N, n)
        States.

    Returns
    -------
    ndarray of shape (N, d)
        Finite actions.

    Raises
    ------
    PolicyError
        It is no policy.
    DataError
        Actions are not finite, or not one row a state.
    """
    call = getattr(policy, "predict", policy)
    if not callable(call):
        raise PolicyError(f"a policy has a method predict, or is a function of states, not {quote(policy)}")
    P = check_actions(call(X), "the policy's actions")
    if len(P) != len(X):
        raise DataError(
            f"the policy gives {len(P)} actions at {len(X)} states: it must give one row for each"
        )
    return P


def check_region(region: ArrayLike) -> Array:
    """Check the corners of a region of states.

    Parameters
    ----------
    region : array_like of shape (2, n)
        The lower corner, then the upper one.

    Returns
    -------
    ndarray of shape (2, n)
        The corners.

    Raises
    ------
    DataError
        They are not two corners, the lower one first.
    """
    corners = check_numbers(region, "region")
    if corners.ndim != 2 or len(corners) != 2:
        raise DataError(
            f"region must be two corners, the lower one first: [[-1, -1], [1, 1]], got shape {corners.shape}"
        )
    check_finite(corners, "region")
    if (corners[0] > corners[1]).any() or not np.isfinite(corners[1] - corners[0]).all():
        raise DataError(f"region must be two corners, the lower one first, got {corners.tolist()}")
    return corners


def lay_grid(region: Array, *, is_square: bool, near: Array | None = None) -> tuple[Array, Array]:
    """Lay a grid over a region of two states.

    Parameters
    ----------
    region : ndarray of shape (2, 2)
        Its corners.
    is_square : bool
        Whether the grid has one spacing, as on axes of one scale.
    near : ndarray of shape (N, 2), optional
        Keep only points within about a spacing of one of these states: away from the data a policy is a guess, and a
        picture should not pretend otherwise.

    Returns
    -------
    points : ndarray of shape (M, 2)
        Points of the grid.
    spacing : ndarray of shape (2,)
        The distances between them, in units of the states.
    """
    low, extent = region[0], region[1] - region[0]
    if is_square:
        extent = np.full(2, extent.max())
    spacing = np.where(extent > 0, extent, 1.0) / (ARROWS_ALONG - 1)
    counts = np.floor((region[1] - low) / spacing + 1e-6).astype(int)
    start = low + (region[1] - low - counts * spacing) / 2  # in the middle of the region
    axes = [a + s * np.arange(k + 1) for a, s, k in zip(start, spacing, counts, strict=True)]
    points = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    if near is not None:
        # Quarters of a spacing are as good as the states themselves, of which there may be millions.
        places = np.unique(np.round(4 * (near - low) / spacing), axis=0) / 4
        steps = (points - low) / spacing
        distance = np.array([np.min(np.sum((places - step) ** 2, axis=1)) for step in steps])
        points = points[distance <= 1.0]
    return points, spacing


def spread_samples(places: Array, *, is_square: bool) -> tuple[NDArray[np.intp], Array]:
    """Choose recorded states that are spread evenly: one in each occupied cell of a grid, the nearest to its middle.

    Parameters
    ----------
    places : ndarray of shape (N, k)
        The coordinates that are drawn, two or three.
    is_square : bool
        Whether the cells have one side, as on axes of one scale.

    Returns
    -------
    rows : ndarray of int
        Which samples.
    side : ndarray of shape (k,)
        Sides of the cells.
    """
    low, extent = places.min(axis=0), np.ptp(places, axis=0)
    if is_square:
        extent = np.full(len(extent), extent.max())
    side = np.where(extent > 0, extent, 1.0) / CELLS_ALONG[places.shape[1]]
    steps = (places - low) / side
    cells = np.minimum(np.floor(steps), CELLS_ALONG[places.shape[1]] - 1)
    order = np.argsort(np.sum((steps - cells - 0.5) ** 2, axis=1), kind="stable")
    _, first = np.unique(cells[order], axis=0, return_index=True)
    return order[first], side


def draw_arrows(
    ax: Any,
    points: Array,
    vectors: Array,
    spacing: Array,
    color: str,
    label: str | None,
    full_speed: float,
    width: float = WIDTH,
) -> None:
    """Draw an action at each point, as an arrow that is at most a bit longer than the spacing.

    Parameters
    ----------
    ax : Axes
        In k dimensions.
    points, vectors : ndarray of shape (M, k)
        Where arrows begin, and actions.
    spacing : ndarray of shape (k,)
        Of the points along each axis.
    color, label : str
        Of the arrows.
    full_speed : float
        From which on arrows are of full length, in spacings where these differ between the axes.
    width : float
        In widths of the axes; in space lines are twice as wide where arrows are.
    """
    arrows = scale_arrows(vectors / stretch(spacing), full_speed) * spacing * LONGEST_ARROW
    if points.shape[1] == 3:
        ax.quiver(
            *points.T, *arrows.T, color=color, label=label, arrow_length_ratio=0.3, lw=1.2 * width / WIDTH
        )
        return
    ax.update_datalim(points + arrows)  # matplotlib looks at where arrows begin only
    ax.autoscale_view()
    order = 2.0 if width == WIDTH else 1.9  # the broad ones below
    ax.quiver(
        *points.T, *arrows.T, angles="xy", scale_units="xy", scale=1.0, color=color, label=label,
        width=width, headwidth=3.4, headlength=3.6, headaxislength=3.3, minlength=0.5, zorder=order,
    )  # fmt: skip


def stretch(spacing: Array) -> Array:
    """Return what actions are divided by before their lengths are compared: one, or spacings that differ."""
    same = bool(np.all(spacing == spacing[0]))
    return np.ones(len(spacing)) if same else spacing


def pick_columns(vectors: Array, columns: Sequence[int | None]) -> Array:
    """Return the velocities of the coordinates that are drawn, zero where one has none."""
    zero = np.zeros(len(vectors))
    return np.column_stack([zero if i is None else vectors[:, i] for i in columns])
