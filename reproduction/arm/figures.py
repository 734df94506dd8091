"""Table I as a picture."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reproduction import published
from reproduction.adaptive_column import ADAPTIVE, name_data_sets
from reproduction.arm.tables import ERRORS, Results, collect, list_constraints, list_nonlinear
from unconstrain.plot.colors import DIRECT, LEARNT, SERIES, TRUE

ORACLE = "#009E73"
"""Its colour."""


def plot_table(results: Results, adaptive: Results = ()) -> Figure:
    """Plot the rows of Table I with p < 2: published, ours, and what else was measured; log scale, mean and s.d.

    Parameters
    ----------
    results, adaptive : sequence of dict
        What was measured on each data set, and what risk "adaptive" did, if anything.

    Returns
    -------
    Figure
        A panel for each error.
    """
    has = next(iter(results[0].values()))
    series = (
        [
            ("chosen by inconsistency", "auto", LEARNT, "o"),
            ("local models", "locally linear", ORACLE, "^"),
        ]
        if "chosen" in has
        else [
            ("inconsistency", "inconsistency", LEARNT, "o"),
            ("direct", "direct", DIRECT, "v"),
            ("oracle", "oracle", ORACLE, "^"),
            *([(f"adaptive ({name_data_sets(adaptive)})", ADAPTIVE, SERIES[3], "D")] if adaptive else []),
        ]
    )
    figure = Figure(figsize=(11.0, 4.4), layout="constrained")
    rows, each = list_nonlinear(results), len(list_constraints(results))
    at = np.arange(len(rows)) + np.array([0.4 * (p > 1.5) for p, _ in rows])
    known = np.array([key in published.ARM for key in rows])
    for ax, error in zip(figure.subplots(1, len(ERRORS), sharey=True), ERRORS, strict=True):
        if known.any():
            means, spreads = np.array([published.ARM[key][error] for key in rows if key in published.ARM]).T
            _draw_points(ax, at[known] - 0.24, means, spreads, color=TRUE, fmt="s", label="published")
        for i, (label, name, color, marker) in enumerate(series):
            of_way = adaptive if name == ADAPTIVE else results
            numbers = np.array([collect(of_way, *key, f"{name} {error}") for key in rows])
            _draw_points(
                ax, at - 0.08 + 0.16 * i, numbers.mean(axis=1), numbers.std(axis=1),
                color=color, fmt=marker, label=label,
            )  # fmt: skip
        ax.set_yscale("log")
        ax.set_xticks(at, [constraint for _, constraint in rows], rotation=45)
        for p, middle in ((1.5, at[:each].mean()), (1.8, at[each:].mean())):
            ax.annotate(f"p = {p}", (middle, -0.2), xycoords=("data", "axes fraction"), ha="center")
        ax.set_title(error, fontsize=10.5)
        ax.grid(axis="y", alpha=0.3)
    figure.axes[0].set_ylabel("share of the policy's variance")
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)
    return figure


def _draw_points(ax: Axes, x: np.ndarray, mean: np.ndarray, spread: np.ndarray, **options: Any) -> None:
    # A bar that would reach below zero ends at a tenth of the mean: on a log scale it has no other end.
    ax.errorbar(x, mean, yerr=[np.minimum(spread, 0.9 * mean), spread], ms=4, capsize=2, lw=1, **options)
