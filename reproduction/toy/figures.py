"""Figs. 3 and 4 anew."""

import numpy as np
from matplotlib.figure import Figure

from reproduction.markdown import mean_and_deviation
from reproduction.toy.trial import NOISE, SHARES, Result, collect
from unconstrain import demo
from unconstrain.plot.colors import DIRECT, LEARNT, RECORDED


def plot_fields(results: list[Result]) -> Figure:
    """Plot Fig. 3: the true field, those learnt from 4 and from 40 movements, and the direct one."""
    captions = {
        row: "\n".join(
            f"{error} {mean_and_deviation(collect(results, row, error))}" for error in ("nUPE", "nCPE")
        )
        for row in results[0]
    }
    return demo.plot_fields(captions)


def plot_sweeps(results: list[Result]) -> Figure:
    """Plot Fig. 4: errors against the share of the data (log scale), and against noise on the actions."""
    figure = Figure(figsize=(10.0, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    for ax, name, values, title in (
        (left, "share", SHARES, "size of the data set (% of 40 trajectories)"),
        (right, "noise", NOISE, "noise on the actions (% of their scale)"),
    ):
        for error, color, marker in (("nUPE", LEARNT, "o"), ("nCPE", DIRECT, "s")):
            errors = np.array([collect(results, f"{name} {value}", error) for value in values])
            percent = 100 * np.array(values)
            low, high = np.percentile(errors, [10, 90], axis=1)
            ax.fill_between(percent, low, high, color=color, alpha=0.15, lw=0)
            ax.plot(percent, errors.mean(axis=1), f"{marker}-", color=color, label=error, ms=4)
        ax.set(xlabel=title, ylabel="normalised error")
        ax.legend(frameon=False)
        ax.grid(alpha=0.3)
    left.set_yscale("log")
    right.plot(100 * np.array(NOISE), np.square(NOISE), color=RECORDED, ls="--", label="noise variance")
    right.legend(frameon=False)
    return figure
