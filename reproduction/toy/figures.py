"""Figs. 3 and 4 anew."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reproduction import published
from reproduction.adaptive_column import ADAPTIVE, name_data_sets
from reproduction.markdown import mean_and_deviation
from reproduction.toy.trial import (
    NOISE,
    SHARES,
    WAYS,
    Result,
    collect,
    name_noise,
    name_row,
    name_share,
)
from unconstrain import demo
from unconstrain.demo import FEW, MOVEMENTS
from unconstrain.plot.colors import DIRECT, LEARNT, RECORDED, SERIES, TRUE

COLORS = {"direct": DIRECT, "inconsistency": RECORDED, ADAPTIVE: LEARNT}
"""As in the pictures of the adaptive experiment."""

STYLES = {"nUPE": ("o-", 1.6), "nCPE": ("s--", 1.0)}
"""Marker and line, and width of the line, of each error."""


def plot_fields(results: list[Result]) -> Figure:
    """Plot Fig. 3: the true field, those learnt from 4 and from 40 movements, and the direct one."""
    captions = {
        name_row(way, movements): "\n".join(
            f"{error} {mean_and_deviation(collect(results, name_row(way, movements), error))}"
            for error in STYLES
        )
        for way in WAYS
        for movements in (FEW, MOVEMENTS)
    }
    return demo.plot_fields(captions)


def plot_sweeps(results: list[Result], adaptive: list[Result]) -> Figure:
    """Plot Fig. 4: errors of each risk against the share of the data, and against noise on the actions.

    Parameters
    ----------
    results, adaptive : list of dict
        What the paper's ways to learn measured on each data set, and what risk "adaptive" did, if anything.

    Returns
    -------
    Figure
        Two panels side by side, both with a logarithmic scale of errors.
    """
    figure = Figure(figsize=(11.0, 5.0), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    for way, color in COLORS.items():
        of_way = adaptive if way == ADAPTIVE else results
        if of_way:
            _draw_sweep(left, of_way, way, SHARES, name_share, color)
            _draw_sweep(right, of_way, way, NOISE, name_noise, color)
    for movements in (FEW, MOVEMENTS):
        for error, (marker, _) in STYLES.items():
            mean, _ = published.TOY[name_row("inconsistency", movements)][error]
            left.plot(
                100 * movements / MOVEMENTS, mean, marker[0], color=TRUE, ms=7, mfc="none",
                label=f"published, inconsistency, {error}",
            )  # fmt: skip
    right.plot(100 * np.array(NOISE[1:]), np.square(NOISE[1:]), ":", color=SERIES[2], label="noise variance")
    left.set(
        yscale="log",
        xlabel=f"size of the data set (% of {MOVEMENTS} trajectories)",
        ylabel="normalised error",
    )
    right.set(xlabel="noise on the actions (% of their scale)")
    for ax in (left, right):
        ax.grid(alpha=0.3)
    handles = {
        label: handle
        for ax in (left, right)
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)
    }
    figure.legend(handles.values(), handles, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    return figure


def _draw_sweep(
    ax: Axes,
    results: list[Result],
    way: str,
    values: Sequence[float],
    name: Callable[[str, float], str],
    color: str,
) -> None:
    """Draw the means of both errors, and the nUPE from the 10th to the 90th percentile."""
    percent = 100 * np.array(values)
    for error, (style, width) in STYLES.items():
        errors = np.array([collect(results, name(way, value), error) for value in values])
        label = f"{way}, {error} ({name_data_sets(results)})"
        ax.plot(percent, errors.mean(axis=1), style, color=color, label=label, ms=4, lw=width)
        if error == "nUPE":
            low, high = np.percentile(errors, [10, 90], axis=1)
            ax.fill_between(percent, low, high, color=color, alpha=0.12, lw=0)
