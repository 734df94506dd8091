"""The errors of the posture as a picture."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from reproduction import published
from reproduction.posture.trial import RISKS, collect
from unconstrain.plot.colors import DIRECT, LEARNT, TRUE


def plot_errors(results: list[dict[str, Any]]) -> Figure:
    """Plot the nUPE of every data set, and the published means."""
    figure = Figure(figsize=(7.0, 3.2), layout="constrained")
    ax = figure.subplots()
    for row, (risk, color) in enumerate(zip(RISKS, (LEARNT, DIRECT), strict=True)):
        values = collect(results, risk, "nUPE")
        ax.plot(values, np.full(len(values), row), "o", color=color, alpha=0.35, ms=6, mec="none")
        mean = published.POSTURE_NUPE[risk][0]
        ax.plot([mean, mean], [row - 0.3, row + 0.3], "--", color=TRUE, lw=1.2)
    ax.set(xscale="log", xlabel="nUPE", yticks=range(len(RISKS)), yticklabels=RISKS, ylim=(-0.6, 1.6))
    ax.grid(axis="x", alpha=0.3)
    return figure
