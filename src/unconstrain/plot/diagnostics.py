"""How far recordings determine a policy: its standard deviation over the states."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Ellipse
from numpy.typing import ArrayLike, NDArray

from unconstrain.arrays import check_numbers, check_whole, quote
from unconstrain.demonstrations import Demonstrations
from unconstrain.diagnostics.report import Identifiability
from unconstrain.errors import DataError, PolicyError
from unconstrain.features.centers import farthest_first
from unconstrain.plot.axes import add_title, check_coordinates, get_axes, is_in_space, label_axes
from unconstrain.plot.colors import DIRECT
from unconstrain.plot.columns import name_columns
from unconstrain.plot.fields import check_region
from unconstrain.plot.movements import demonstrations

Array = NDArray[np.float64]

CELLS, ELLIPSES = 60, 9
SHOWN = 600
"""States drawn where there are more than two."""
COLORS = "viridis"


def identifiability(
    report: Identifiability,
    *,
    coordinates: Sequence[int] | None = None,
    region: ArrayLike | None = None,
    levels: ArrayLike | None = None,
    worst: int = 3,
    ax: Axes | None = None,
) -> Axes:
    """Draw how far the policy may be from what was learnt, over the recorded states.

    Of two states and two actions it is a field of the standard deviation (the root of the summed variances), with
    ellipses of one standard deviation each way; the longest is a spacing long, others are in proportion to the root of
    their size, lest they vanish. Of other numbers it is recorded states, at most 600 of them, coloured by the largest
    standard deviation in any direction; of a single state that is drawn against it.

    Parameters
    ----------
    report : Identifiability
        As `unconstrain.identifiability` returns it, of recordings.
    coordinates : sequence of int, optional
        Which two states are drawn, or which three in space, as for `demonstrations`.
    region : array_like of shape (2, 2), optional
        Corners of the field, in units of the two states; by default what was recorded.
    levels : array_like, optional
        Standard deviations between which the field's colour changes, in units of the action; by default the range there
        is.
    worst : int
        Mark so many of the recorded states where the policy is known least. What to record next is said by
        `report.next_recordings`.
    ax : Axes, optional
        Where to draw; new axes by default. A colour bar takes some of their room.

    Returns
    -------
    Axes
        With the standard deviation.

    Raises
    ------
    DataError
        The report is of moments alone, the region or the levels are none, or there are no such coordinates.
    """
    if not isinstance(report, Identifiability):
        raise PolicyError(f"a report is what uc.identifiability returns, not {quote(report)}")
    samples = report.require_samples("where to draw")
    n, d = samples.states.shape[1], samples.actions.shape[1]
    codes = None if samples.groups is None else np.unique(samples.groups, return_inverse=True)[1]
    demos = Demonstrations(
        samples.states, samples.actions, codes, space=report.policy.space_, state_names=report.state_names
    )
    shown = check_coordinates(coordinates, n, ax)
    is_field = n == d == 2
    if not is_field and not (region is None and levels is None):
        raise DataError(
            f"region= and levels= are of a field over two states of a policy with two actions, and this one has {n} "
            f"states and {d} actions"
        )
    check_whole(worst, "worst", least=0)
    if levels is not None:
        levels = _check_levels(levels)
    corners = _find_corners(demos.states) if region is None else check_region(region)
    if is_field and corners.shape[1] != 2:
        raise DataError(f"region must have corners of two states, got {corners.shape[1]}")
    ax = get_axes(ax, len(shown))
    if is_field:
        _draw_field(ax, report, corners, levels, shown)
        demonstrations(demos, coordinates=shown, color="white", label=None, ax=ax)
        _draw_ellipses(ax, report, corners, shown)
    else:
        _draw_states(ax, report, demos, shown)
    _mark_worst(ax, report, shown, worst)
    _label(ax, demos, shown)
    if is_field:
        ax.set(xlim=corners[:, shown[0]], ylim=corners[:, shown[1]])
    add_title(ax, f"{report.determined_share:.0%} of the policy's directions determined")
    return ax


def _find_corners(X: Array) -> Array:
    """Find the corners of what was recorded; a state that never changes gets an extent of one."""
    low, high = X.min(axis=0), X.max(axis=0)
    margin = np.where(high > low, 0.0, 0.5)
    return np.stack([low - margin, high + margin])


def _draw_field(
    ax: Any, report: Identifiability, corners: Array, levels: Array | None, shown: Sequence[int]
) -> None:
    x, y = (np.linspace(a, b, CELLS) for a, b in corners.T)
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    deviation = np.sqrt(np.einsum("njj->n", report.covariance(grid))).reshape(CELLS, CELLS)
    if levels is None:
        least = max(float(deviation.min()), 1e-6 * float(deviation.max()), 1e-300)
        levels = np.geomspace(least, max(float(deviation.max()), 2 * least), 17)
    values = np.clip(deviation, levels[0], levels[-1])
    a, b = (x, y) if tuple(shown) == (0, 1) else (y, x)
    image = ax.contourf(a, b, values if tuple(shown) == (0, 1) else values.T, levels, norm="log", cmap=COLORS)
    _add_bar(ax, image, levels[0], levels[-1], "standard deviation, in units of the action")


def _draw_states(ax: Any, report: Identifiability, demos: Demonstrations, shown: Sequence[int]) -> None:
    """Colour recorded states by the largest standard deviation; those most uncertain are drawn on top."""
    X = farthest_first(demos.states, n_centers=SHOWN)[0]
    deviation = np.sqrt(np.maximum(np.linalg.eigvalsh(report.covariance(X))[:, -1], 0.0))
    # Where nothing is in doubt a logarithm has no bottom.
    deviation = np.maximum(deviation, max(1e-6 * deviation.max(), 1e-300))
    order = np.argsort(deviation)
    X, deviation = X[order], deviation[order]
    places = np.column_stack([X[:, 0], deviation]) if len(shown) == 1 else X[:, list(shown)]
    dots = ax.scatter(*places.T, c=deviation, s=9, cmap=COLORS, norm="log", lw=0)
    if len(shown) == 1:
        ax.set_ylabel("standard deviation, in units of the action")
    else:
        _add_bar(ax, dots, deviation[0], deviation[-1], "largest standard deviation, in units of the action")


def _add_bar(ax: Any, shown: Any, low: float, high: float, label: str) -> None:
    """Add a colour bar of a logarithmic scale with a few plain numbers."""
    decades = 10.0 ** np.arange(np.ceil(np.log10(low)), np.floor(np.log10(high)) + 1)
    ticks = decades if len(decades) > 2 else np.geomspace(low, high, 4)
    bar = ax.figure.colorbar(shown, ax=ax, label=label, format="%.2g", ticks=ticks, shrink=0.8)
    bar.minorticks_off()


def _draw_ellipses(ax: Any, report: Identifiability, corners: Array, shown: Sequence[int]) -> None:
    spacing = (corners[1] - corners[0]) / ELLIPSES
    axes = [a + s * (np.arange(ELLIPSES) + 0.5) for a, s in zip(corners[0], spacing, strict=True)]
    centers = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    order = list(shown)
    covariances = report.covariance(centers)[:, order][:, :, order]
    variances, vectors = np.linalg.eigh(covariances)
    lengths = np.maximum(variances, 0.0) ** 0.25
    scale = 0.9 * float(spacing.min()) / (float(lengths.max()) or 1.0)
    for center, (minor, major), V in zip(centers[:, order], scale * lengths, vectors, strict=True):
        angle = float(np.degrees(np.arctan2(V[1, 1], V[0, 1])))
        ax.add_patch(
            Ellipse(tuple(center), major, minor, angle=angle, fill=False, ec="white", lw=1.0, alpha=0.9)
        )


def _mark_worst(ax: Any, report: Identifiability, shown: Sequence[int], worst: int) -> None:
    if worst < 1:
        return
    X = np.array([region.state for region in report.worst_regions(worst)])
    if len(shown) == 1:
        deviation = np.sqrt(np.linalg.eigvalsh(report.covariance(X))[:, -1])
        places = np.column_stack([X[:, 0], deviation])
    else:
        places = X[:, list(shown)]
    ax.plot(
        *places.T,
        "o",
        ms=9,
        mfc="none",
        mec=DIRECT,
        mew=2,
        label="known least",
        zorder=4,
        clip_on=is_in_space(ax),
    )


def _label(ax: Any, demos: Demonstrations, shown: Sequence[int]) -> None:
    if len(shown) == 1:
        ax.set_xlabel(name_columns(demos)[0])
    else:
        label_axes(ax, demos, shown)


def _check_levels(levels: ArrayLike) -> Array:
    values = check_numbers(levels, "levels")
    rising = values.ndim == 1 and len(values) > 1 and bool((np.diff(values) > 0).all())
    if not (rising and values[0] > 0 and np.isfinite(values[-1])):
        raise DataError("levels must be two or more rising numbers above zero, in units of the action")
    return values
