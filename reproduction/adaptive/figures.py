"""Errors of the four ways on the limit cycle, and contact as it was and as it is inferred."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from reproduction.adaptive.judgement import average
from reproduction.adaptive.settings import Result
from reproduction.adaptive.simulated import FREE, NOISE, name_cycle_cell
from reproduction.adaptive.ways import ADAPTIVE, DIRECT, INCONSISTENCY, TOLD, WAYS
from unconstrain.demonstrations import Demonstrations
from unconstrain.plot import colors

STYLES = {
    DIRECT: (colors.DIRECT, "v-", "direct"),
    INCONSISTENCY: (colors.RECORDED, "s-", "inconsistency"),
    ADAPTIVE: (colors.LEARNT, "o-", "adaptive"),
    TOLD: (colors.TRUE, "^--", "told all projections"),
}
"""Colour, marker and line, and label of each way."""


def plot_cycle(results: Sequence[Result]) -> Figure:
    """Plot the mean nUPE of every way against noise, a panel for each share of free segments."""
    means = average(results)
    figure = Figure(figsize=(12.0, 3.6), layout="constrained")
    percent = 100 * np.array(NOISE)
    for ax, free in zip(figure.subplots(1, len(FREE), sharey=True), FREE, strict=True):
        cells = [means[name_cycle_cell(free, noise)] for noise in NOISE]
        for way in WAYS:
            if all(way in cell for cell in cells):
                color, style, label = STYLES[way]
                ax.plot(percent, [cell[way] for cell in cells], style, color=color, ms=4, lw=1.4, label=label)
        # Where no noise is added there is no error that noise makes, and the bound is none.
        bound = [cell["bound"] for cell, noise in zip(cells, NOISE, strict=True) if noise]
        ax.plot(percent[np.array(NOISE) > 0], bound, ":", color=colors.SERIES[2], lw=1.6, label="bound")
        ax.set(yscale="log", xlabel="noise (%)", title=f"{100 * free:g} % free", xticks=(0, 5, 10, 20))
        ax.grid(alpha=0.3)
    figure.axes[0].set_ylabel("nUPE")
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(handles), frameon=False, fontsize=9)
    return figure


def plot_contact(demos: Demonstrations, free: NDArray[np.bool_], inferred: NDArray[np.float64]) -> Figure:
    """Plot the ways of both hands from above, coloured by contact: inferred over true.

    Parameters
    ----------
    demos : Demonstrations
        Positions of both hands in metres, (N, 6).
    free : ndarray of shape (N,), bool
        Which samples were free.
    inferred : ndarray of shape (N,)
        How probably they were, as inferred.
    """
    figure = Figure(figsize=(7.4, 7.6), layout="constrained")
    panels = figure.subplots(2, 1, sharex=True, sharey=True)
    for ax, shown, title in zip(
        panels, (1 - inferred, 1.0 - free), ("contact as inferred", "contact as it was"), strict=True
    ):
        for hand in range(2):
            x, y = demos.states[:, 3 * hand], demos.states[:, 3 * hand + 1]
            points = ax.scatter(y, x, c=shown, s=5, cmap="cividis", vmin=0.0, vmax=1.0, linewidths=0)
        ax.set(title=title, ylabel="x / m")
        ax.set_aspect("equal")
        ax.grid(alpha=0.25)
    panels[1].set_xlabel("y / m")
    figure.colorbar(points, ax=panels, shrink=0.6, label="probability that the barrier blocks a hand")
    return figure
