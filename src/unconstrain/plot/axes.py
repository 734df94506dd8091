"""What all pictures share: axes to draw on, their labels, a title with a legend below it."""

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from unconstrain.arrays import check_finite, check_numbers, check_whole, quote
from unconstrain.errors import DataError


def get_axes(ax: Axes | None) -> Axes:
    """Return the axes given, or new ones of matplotlib's current backend.

    Parameters
    ----------
    ax : Axes, optional
        Where to draw.

    Returns
    -------
    Axes
        The axes to draw on.
    """
    if ax is not None:
        return ax
    from matplotlib import pyplot  # a picture on axes of one's own needs no backend, and no global state

    return pyplot.subplots(layout="constrained")[1]


def check_coordinates(coordinates: tuple[int, int], n: int) -> tuple[int, int]:
    """Check which two coordinates are to be drawn.

    Parameters
    ----------
    coordinates : tuple of int
        Two of them, counted from 0.
    n : int
        How many there are.

    Returns
    -------
    tuple of int
        The two.

    Raises
    ------
    UnconstrainError
        They are not two of those there are.
    """
    if not isinstance(coordinates, tuple | list | np.ndarray) or np.shape(coordinates) != (2,):
        raise DataError(f"coordinates must be two numbers counted from 0, got {quote(coordinates)}")
    i, j = (check_whole(each, "coordinates", least=0, most=n - 1) for each in coordinates)
    return i, j


def check_region(low: ArrayLike, high: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Check the corners of a region of two states.

    Parameters
    ----------
    low, high : array_like of shape (2,)
        Its corners.

    Returns
    -------
    low, high : ndarray of shape (2,)
        Its corners.

    Raises
    ------
    DataError
        They are not two finite numbers each, the lower ones first.
    """
    corners = check_numbers(low, "low"), check_numbers(high, "high")
    for name, corner in zip(("low", "high"), corners, strict=True):
        if corner.shape != (2,):
            raise DataError(f"{name} must be a corner of the region, two numbers, got shape {corner.shape}")
        check_finite(corner, name)
    if (corners[0] > corners[1]).any() or not np.isfinite(corners[1] - corners[0]).all():
        raise DataError(
            f"low={corners[0].tolist()} and high={corners[1].tolist()} are no corners of a region: low first"
        )
    return corners


def label_plane(ax: Axes, names: tuple[str, str]) -> None:
    """Name the axes of a plane of positions, and give both the same scale.

    Parameters
    ----------
    ax : Axes
        The axes.
    names : tuple of str
        What lies along x and along y.
    """
    ax.set(xlabel=names[0], ylabel=names[1])
    ax.set_aspect("equal", adjustable="datalim")


def add_title(ax: Axes, title: str) -> None:
    """Put a title above the axes and a legend between the two, where it hides no data.

    Parameters
    ----------
    ax : Axes
        The axes, with all that is to be in the legend drawn already.
    title : str
        The title.
    """
    handles, labels = ax.get_legend_handles_labels()
    shown = dict(zip(labels, handles, strict=True))
    if shown:
        ax.legend(
            list(shown.values()), list(shown), loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=len(shown),
            frameon=False, fontsize=8, columnspacing=1.4, handlelength=1.8, borderaxespad=0.2,
        )  # fmt: skip
    ax.set_title(title, fontsize=10.5, pad=20 if shown else 6)
