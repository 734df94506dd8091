"""What all pictures share: axes to draw on, their labels, a title with a legend below it."""

from matplotlib.axes import Axes


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
