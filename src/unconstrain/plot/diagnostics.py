"""How far the policy is determined, drawn over the states."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from unconstrain.diagnostics.report import Identifiability
from unconstrain.features.centers import farthest_first
from unconstrain.plot import policy as figures

CELLS, ELLIPSES = 60, 9
SHOWN = 600
"""States drawn where there are more than two dimensions."""


def drawn(report: Identifiability, state_names) -> Figure:
    """Standard deviation of the policy over the recorded region, and the spectrum.

    Over two states and two actions: as a field, with ellipses of one standard deviation. Otherwise: recorded states
    projected onto pairs of the first three coordinates, coloured by the largest standard deviation in any direction.
    """
    X = report.recordings_for("where to draw").X
    n, d = X.shape[1], report.policy.n_actions_
    pairs = [(0, 1), (0, 2), (1, 2)] if n > 2 else [(0, 1)] if n == 2 else [(0, 0)]
    figure = Figure(figsize=(4.6 * (len(pairs) + 1), 4.4), layout="constrained")
    *panels, last = figure.subplots(1, len(pairs) + 1)
    if n == 2 and d == 2:
        determination(panels[0], report, X.min(axis=0), X.max(axis=0))
        panels[0].set(xlabel=state_names[0], ylabel=state_names[1])
        panels[0].set_title("standard deviation of the policy", fontsize=10.5)
    else:
        shown = farthest_first(X, n_centers=SHOWN)[0]
        deviation = np.sqrt(np.linalg.eigvalsh(report.covariance(shown))[:, -1])
        order = np.argsort(deviation)
        points: Any = None
        for ax, (i, j) in zip(panels, pairs, strict=True):
            second = deviation if n == 1 else shown[:, j]
            points = ax.scatter(
                shown[order, i], second[order], c=deviation[order], s=9, cmap="viridis", norm="log", lw=0
            )
            ax.set(xlabel=state_names[i], ylabel="standard deviation" if n == 1 else state_names[j])
        panels[0].set_title("largest standard deviation of the policy", fontsize=10.5)
        figure.colorbar(points, ax=panels, label="units of the action", format="%.2g")
    values = report.spectrum
    last.plot(
        np.maximum(values[::-1], 1e-8), np.arange(1, len(values) + 1) / len(values), color=figures.LEARNT
    )
    last.axvline(report.threshold, color=figures.TRUE, ls="--", lw=1)
    last.set_xscale("log")
    last.set(
        xlabel="share of a direction that was seen", ylabel="share of directions seen at least that much"
    )
    last.set_title(f"determined: {report.determined_share:.1%}", fontsize=10.5)
    last.set_ylim(0, 1.02)
    last.grid(alpha=0.3)
    return figure


def determination(ax: Axes, report: Identifiability, low, high, *, levels=None) -> None:
    """Draw the root of the summed variances over the plane, and ellipses of one standard deviation each way.

    The longest ellipse is a grid spacing long; others in proportion to the root of their size, lest they vanish.
    """
    low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    x, y = (np.linspace(a, b, CELLS) for a, b in zip(low, high, strict=True))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    deviation = np.sqrt(np.einsum("njj->n", report.covariance(grid))).reshape(CELLS, CELLS)
    if levels is None:
        least = max(float(deviation.min()), 1e-6 * float(deviation.max()), 1e-300)
        levels = np.geomspace(least, max(float(deviation.max()), 2 * least), 17)
    values = np.clip(deviation, levels[0], levels[-1])
    shown = ax.contourf(x, y, values, levels, norm="log", cmap="viridis")
    decades = 10.0 ** np.arange(np.ceil(np.log10(levels[0])), np.floor(np.log10(levels[-1])) + 1)
    ax.figure.colorbar(
        shown, ax=ax, label="units of the action", format="%.2g", ticks=decades if len(decades) > 1 else None
    )
    near = report.recordings
    if near is not None:
        codes = np.zeros(len(near.X)) if near.episodes is None else near.episodes
        figures.trajectories(ax, near.X, codes, color="white")
    spacing = (high - low) / ELLIPSES
    axes = [a + s * (np.arange(ELLIPSES) + 0.5) for a, s in zip(low, spacing, strict=True)]
    centers = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    variances, vectors = np.linalg.eigh(report.covariance(centers))
    lengths = np.maximum(variances, 0.0) ** 0.25
    scale = 0.9 * float(spacing.min()) / (float(lengths.max()) or 1.0)
    for center, (minor, major), V in zip(centers, scale * lengths, vectors, strict=True):
        angle = float(np.degrees(np.arctan2(V[1, 1], V[0, 1])))
        ax.add_patch(
            Ellipse(tuple(center), major, minor, angle=angle, fill=False, ec="white", lw=1.0, alpha=0.9)
        )
    ax.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x1", ylabel="x2")
