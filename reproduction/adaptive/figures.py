"""Errors of the four ways on the limit cycle, and contact as it was and as it is inferred."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
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

CONTACT = LinearSegmentedColormap.from_list("contact", [colors.LEARNT, "#EEEEEE", colors.DIRECT])
"""From free to constrained; grey where it is not decided."""


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
    """Plot contact as inferred over contact as it was: along the ways of both hands from above, and over time.

    Parameters
    ----------
    demos : Demonstrations
        Positions of both hands in metres, (N, 6).
    free : ndarray of shape (N,), bool
        Which samples were free.
    inferred : ndarray of shape (N,)
        How probably they were, as inferred.
    """
    figure = Figure(figsize=(12.0, 7.6), layout="constrained")
    panels = figure.subplot_mosaic([["inferred", "time"], ["true", "time"]], width_ratios=(1.3, 1.0))
    contact = {"inferred": 1 - inferred, "true": 1.0 - free}
    shades: dict[str, Any] = {"cmap": CONTACT, "vmin": 0.0, "vmax": 1.0}
    for name, title in (("inferred", "contact as inferred"), ("true", "contact as it was")):
        ax = panels[name]
        for hand in range(2):
            x, y = demos.states[:, 3 * hand], demos.states[:, 3 * hand + 1]
            points = ax.scatter(y, x, c=contact[name], s=10, linewidths=0, **shades)
        ax.set(title=title, ylabel="x / m, forward")
        ax.set_aspect("equal")
        ax.invert_xaxis()
        ax.grid(alpha=0.25)
    panels["true"].set_xlabel("y / m")
    labels = np.unique(demos.episodes)
    for row, label in enumerate(labels):
        of_row = demos.episodes == label
        for name, top in (("inferred", row - 0.4), ("true", row)):
            panels["time"].imshow(
                contact[name][of_row][None], extent=(0, np.sum(of_row), top + 0.38, top), aspect="auto",
                interpolation="nearest", **shades,
            )  # fmt: skip
    panels["time"].set(
        xlim=(0, max(np.sum(demos.episodes == label) for label in labels)),
        ylim=(len(labels) - 0.5, -0.6),
        yticks=range(len(labels)),
        yticklabels=range(1, len(labels) + 1),
        xlabel="sample",
        ylabel="grasp",
        title="upper bar: as inferred, lower bar: as it was",
    )
    figure.colorbar(
        points, ax=list(panels.values()), shrink=0.7, label="probability that the barrier blocks either hand"
    )
    return figure


def plot_sphere() -> Figure:
    """Plot where an action of one policy can lie in the plane: on the sphere, behind a projection, and at the pole."""
    rng = np.random.default_rng(0)
    pi, noise, row = np.array([2.0, 0.6]), 0.045, np.array([np.sin(0.55), -np.cos(0.55)])
    v = pi - row * (row @ pi)
    angle = np.linspace(0.0, 2 * np.pi, 200)
    circle = pi / 2 + np.linalg.norm(pi) / 2 * np.column_stack([np.cos(angle), np.sin(angle)])
    # Three constraints, a stretch of an episode each, under which the action moves slowly over the sphere.
    normals = np.concatenate([np.linspace(start, start + 0.25, 25) for start in (0.35, 1.3, 2.3)])
    A = np.column_stack([np.cos(normals), np.sin(normals)])
    bent = pi - A * (A @ pi)[:, None] + rng.normal(0.0, noise, A.shape)
    free = pi + rng.normal(0.0, noise, (25, 2))

    figure = Figure(figsize=(6.4, 4.6), layout="constrained")
    ax = figure.subplots()
    ax.plot(*circle.T, "--", color=colors.RECORDED, lw=1.2)
    ax.plot(*bent.T, "s", ms=4, color=colors.DIRECT, mec="none", alpha=0.75, label="u, constrained")
    ax.plot(*free.T, "o", ms=4.5, color=colors.LEARNT, mec="none", alpha=0.75, label="u, free")
    for tip, color, name, aside in (
        (pi, colors.TRUE, "π, the pole", (24, -4)),
        (v, colors.SERIES[2], "v = Nπ", (4, 10)),
    ):
        ax.annotate(
            "", tuple(tip), (0, 0), arrowprops={"arrowstyle": "-|>", "color": color, "lw": 1.8, "shrinkA": 0}
        )
        ax.annotate(name, tuple(tip), aside, textcoords="offset points", color=color, fontsize=11)
    ax.plot(*np.array([v, pi]).T, ":", color=colors.SERIES[2], lw=1.6)
    ax.plot(*(pi / 2), "+", color=colors.RECORDED, ms=9)
    ax.annotate("π/2", tuple(pi / 2), (6, -14), textcoords="offset points", color=colors.RECORDED)
    ax.plot(0, 0, ".", color=colors.TRUE)
    ax.annotate("0", (0, 0), (-12, -4), textcoords="offset points")
    ax.set_aspect("equal")
    ax.set(xlabel="u1", ylabel="u2", xlim=(-0.25, 2.85), ylim=(-0.9, 1.5))
    ax.legend(loc="lower right", frameon=False)
    return figure
