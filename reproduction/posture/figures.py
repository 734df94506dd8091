"""The errors of the posture as a picture."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from reproduction import published
from reproduction.adaptive_column import ADAPTIVE
from reproduction.posture.trial import collect
from unconstrain.plot.colors import DIRECT, LEARNT, SERIES, TRUE


def plot_errors(results: list[dict[str, Any]], adaptive: list[dict[str, Any]]) -> Figure:
    """Plot the nUPE of every data set, and the published means.

    Parameters
    ----------
    results, adaptive : list of dict
        What the paper's risks measured on each data set, and what risk "adaptive" did, if anything.

    Returns
    -------
    Figure
        A row of dots a risk.
    """
    figure = Figure(figsize=(7.0, 3.2), layout="constrained")
    ax = figure.subplots()
    shown = {"inconsistency": (results, LEARNT), "direct": (results, DIRECT)}
    if adaptive:
        shown[ADAPTIVE] = (adaptive, SERIES[2])
    for row, (risk, (of_risk, color)) in enumerate(shown.items()):
        values = collect(of_risk, risk, "nUPE")
        ax.plot(values, np.full(len(values), row), "o", color=color, alpha=0.35, ms=6, mec="none")
        if risk in published.POSTURE_NUPE:
            mean = published.POSTURE_NUPE[risk][0]
            ax.plot([mean, mean], [row - 0.3, row + 0.3], "--", color=TRUE, lw=1.2)
    ax.set(xscale="log", xlabel="nUPE", yticks=range(len(shown)), yticklabels=shown)
    ax.set_ylim(-0.6, len(shown) - 0.4)
    ax.grid(axis="x", alpha=0.3)
    return figure
