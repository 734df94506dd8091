"""What all pictures share: axes to draw on, their labels and scales, a title with a legend below it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.transforms import Affine2D, ScaledTranslation, blended_transform_factory
from numpy.typing import NDArray

from unconstrain.arrays import check_whole, quote
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.plot.columns import name_columns, share_scale

Array = NDArray[np.float64]

NARROWEST = 0.5
"""Shorter side of a picture to one scale, in longer ones."""
STRIP, LINE = "legend above", 14.0
"""Label of the axes that hold the legend of others, and height of one of its lines, in points."""


def get_axes(ax: Any, dimensions: int = 2) -> Any:
    """Return the axes given, or new ones of matplotlib's current backend.

    Parameters
    ----------
    ax : Axes, optional
        Where to draw.
    dimensions : int
        Of new axes: 2 or 3.

    Returns
    -------
    Axes
        The axes to draw on. matplotlib has no types for axes in three dimensions.
    """
    if ax is not None:
        return ax
    from matplotlib import pyplot  # a picture on axes of one's own needs no backend, and no global state

    projection = "3d" if dimensions == 3 else None
    return pyplot.figure(layout="constrained").add_subplot(projection=projection)


def is_in_space(ax: Any) -> bool:
    """Whether axes have three dimensions."""
    return hasattr(ax, "get_zlim")


def check_coordinates(coordinates: Sequence[int] | None, n: int, ax: Any) -> tuple[int, ...]:
    """Check which coordinates are to be drawn.

    Parameters
    ----------
    coordinates : sequence of int, optional
        Two or three of them, counted from 0. By default the first two, or three on axes in three dimensions.
    n : int
        How many there are.
    ax : Axes, optional
        Where they are to be drawn.

    Returns
    -------
    tuple of int
        Two of them, or three for a picture in space.

    Raises
    ------
    DataError
        They are not two or three of those there are, or not as many as the axes have.
    """
    if coordinates is None:
        return tuple(range(min(n, 3 if is_in_space(ax) else 2)))
    if not isinstance(coordinates, tuple | list | np.ndarray) or np.shape(coordinates) not in ((2,), (3,)):
        raise DataError(f"coordinates must be two or three numbers counted from 0, got {quote(coordinates)}")
    chosen = tuple(check_whole(each, "coordinates", least=0, most=n - 1) for each in coordinates)
    if len(set(chosen)) < len(chosen):
        raise DataError(f"coordinates must be different ones, got {quote(coordinates)}")
    if ax is not None and is_in_space(ax) != (len(chosen) == 3):
        wanted = 3 if is_in_space(ax) else 2
        raise DataError(f"these axes have {wanted} dimensions: give {wanted} coordinates=, got {len(chosen)}")
    return chosen


def label_axes(ax: Any, demos: Demonstrations, coordinates: Sequence[int]) -> None:
    """Name the axes after the states, with units where these are known, and give them one scale if they share it.

    Parameters
    ----------
    ax : Axes
        The axes, in as many dimensions as there are coordinates.
    demos : Demonstrations
        Whose states are drawn.
    coordinates : sequence of int
        Which of them.
    """
    names = name_columns(demos)
    for axis, i in zip("xyz", coordinates, strict=False):
        ax.set(**{f"{axis}label": names[i]})
    ax.locator_params(nbins=5 if is_in_space(ax) else 6)  # more of them overlap
    if share_scale(demos, coordinates):
        # The box gives way and not the limits, which are the user's to set.
        ax.set_aspect("equal", adjustable="box")
        if not is_in_space(ax):
            _widen(ax, demos.states[:, list(coordinates)])


def _widen(ax: Axes, places: Array) -> None:
    """Leave room for the shorter side of some places: a straight line in one scale would make a slit of the axes."""
    low, high = places.min(axis=0), places.max(axis=0)
    half = np.maximum(high - low, NARROWEST * np.max(high - low)) / 2
    ax.update_datalim([(low + high) / 2 - half, (low + high) / 2 + half])
    ax.autoscale_view()


def add_title(ax: Any, title: str, note: str | None = None) -> None:
    """Put a title above the axes and a legend between the two, where it hides no data.

    Parameters
    ----------
    ax : Axes
        The axes, with all that is to be in the legend drawn already.
    title : str
        The title.
    note : str, optional
        What is to be said of the scale, in small letters above the legend.
    """
    handles, labels = ax.get_legend_handles_labels()
    shown = dict(zip(labels, handles, strict=True))
    ax.set_title(title, fontsize=10.5)
    look: dict[str, Any] = {"frameon": False, "fontsize": 8, "title": note, "title_fontsize": 7.5}
    if is_in_space(ax):
        ax.legend(list(shown.values()), list(shown), loc="upper left", **look)
        return
    strip = _make_strip(ax, LINE * (bool(shown) + bool(note)))
    strip.legend(
        list(shown.values()), list(shown), loc="center", ncols=max(1, len(shown)), columnspacing=1.4,
        handlelength=1.8, borderaxespad=0.0, **look,
    )  # fmt: skip


def _make_strip(ax: Any, height: float) -> Axes:
    """Make axes of so many points right above others, for a legend: titles move above axes, not above legends."""
    for earlier in ax.child_axes:
        if earlier.get_label() == STRIP:
            earlier.remove()
    points: Any = Affine2D().scale(height / 72) + ax.figure.dpi_scale_trans
    up = points + ScaledTranslation(0, 1, ax.transAxes)
    place = blended_transform_factory(ax.transAxes, up)
    strip: Axes = ax.inset_axes((0.0, 0.0, 1.0, 1.0), transform=place, label=STRIP)
    strip.set_axis_off()
    return strip
