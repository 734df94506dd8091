"""How far recordings determine a policy: its standard deviation over the states, and its spectrum."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from numpy.typing import ArrayLike

from unconstrain.arrays import check_names, check_numbers
from unconstrain.diagnostics.report import Identifiability
from unconstrain.errors import DataError
from unconstrain.features.centers import farthest_first
from unconstrain.plot.axes import check_region, get_axes
from unconstrain.plot.colors import LEARNT, TRUE
from unconstrain.plot.trajectories import trajectory

CELLS, ELLIPSES = 60, 9
SHOWN = 600
"""States drawn where there are more than two dimensions."""


def identifiability_figure(report: Identifiability, state_names: Sequence[str]) -> Figure:
    """Draw the standard deviation of a policy over the recorded region, and the spectrum of observed shares.

    Parameters
    ----------
    report : Identifiability
        As `unconstrain.identifiability` returns it.
    state_names : sequence of str
        Names of the n states.

    Returns
    -------
    Figure
        Over two states and two actions: the standard deviation as a field, with ellipses. Otherwise: recorded states,
        projected onto pairs of the first three coordinates, coloured by the largest standard deviation in any
        direction. And the share of the policy's directions of which at least so much was observed.

    Raises
    ------
    DataError
        There are not as many names as states.
    """
    X = report.require_samples("where to draw").states
    state_names = check_names(state_names, "state_names", X.shape[1])
    n, d = X.shape[1], report.policy.n_actions_
    pairs = [(0, 1), (0, 2), (1, 2)] if n > 2 else [(0, 1)] if n == 2 else [(0, 0)]
    figure = Figure(figsize=(4.6 * (len(pairs) + 1), 4.4), layout="constrained")
    *panels, last = figure.subplots(1, len(pairs) + 1)
    if n == 2 and d == 2:
        standard_deviation(report, X.min(axis=0), X.max(axis=0), ax=panels[0])
        panels[0].set(xlabel=state_names[0], ylabel=state_names[1])
        panels[0].set_title("standard deviation of the policy", fontsize=10.5)
    else:
        _draw_scatter(figure, panels, report, farthest_first(X, n_centers=SHOWN)[0], pairs, state_names)
    values = report.spectrum
    last.plot(np.maximum(values[::-1], 1e-8), np.arange(1, len(values) + 1) / len(values), color=LEARNT)
    last.axvline(report.threshold, color=TRUE, ls="--", lw=1)
    last.set_xscale("log")
    last.set(
        xlabel="share of a direction that was observed",
        ylabel="share of directions observed at least that much",
    )
    last.set_title(f"determined: {report.determined_share:.1%}", fontsize=10.5)
    last.set_ylim(0, 1.02)
    last.grid(alpha=0.3)
    return figure


def standard_deviation(
    report: Identifiability,
    low: ArrayLike,
    high: ArrayLike,
    *,
    levels: ArrayLike | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the root of the summed variances of a policy over a plane of states, and ellipses.

    Parameters
    ----------
    report : Identifiability
        Of a policy over two states and two actions.
    low, high : array_like of shape (2,)
        Corners of the region, in units of the states.
    levels : array_like, optional
        Standard deviations between which the colour changes, in units of the action; by default the range there is.
    ax : Axes, optional
        Where to draw; new axes by default.

    Returns
    -------
    Axes
        With the field, and ellipses of one standard deviation each way. The longest ellipse is a grid spacing long;
        others are in proportion to the root of their size, lest they vanish.

    Raises
    ------
    DataError
        The region or the levels are none, or the policy has other than two states and two actions.
    """
    low, high = check_region(low, high)
    n, d = report.policy.n_features_in_, report.policy.n_actions_
    if (n, d) != (2, 2):
        raise DataError(
            f"standard deviations are drawn over two states of a policy with two actions, and this one has {n} states "
            f"and {d} actions"
        )
    if levels is not None:
        levels = check_numbers(levels, "levels")
        rising = levels.ndim == 1 and len(levels) > 1 and bool((np.diff(levels) > 0).all())
        if not (rising and levels[0] > 0 and np.isfinite(levels[-1])):
            raise DataError("levels must be two or more rising numbers above zero, in units of the action")
    ax = get_axes(ax)
    x, y = (np.linspace(a, b, CELLS) for a, b in zip(low, high, strict=True))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    deviation = np.sqrt(np.einsum("njj->n", report.covariance(grid))).reshape(CELLS, CELLS)
    if levels is None:
        least = max(float(deviation.min()), 1e-6 * float(deviation.max()), 1e-300)
        levels = np.geomspace(least, max(float(deviation.max()), 2 * least), 17)
    shown = ax.contourf(x, y, np.clip(deviation, levels[0], levels[-1]), levels, norm="log", cmap="viridis")
    decades = 10.0 ** np.arange(np.ceil(np.log10(levels[0])), np.floor(np.log10(levels[-1])) + 1)
    ax.figure.colorbar(
        shown, ax=ax, label="units of the action", format="%.2g", ticks=decades if len(decades) > 1 else None
    )
    if report.samples is not None:
        trajectory(report.samples.states, episodes=report.episodes, color="white", ax=ax)
    _draw_ellipses(ax, report, low, high)
    ax.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x1", ylabel="x2")
    return ax


def _draw_scatter(
    figure: Figure,
    panels: Sequence[Axes],
    report: Identifiability,
    X: np.ndarray,
    pairs: Sequence[tuple[int, int]],
    names: Sequence[str],
) -> None:
    """Colour states X (N, n) by the largest standard deviation; those most uncertain are drawn on top."""
    deviation = np.sqrt(np.linalg.eigvalsh(report.covariance(X))[:, -1])
    order = np.argsort(deviation)
    X, deviation = X[order], deviation[order]
    single = X.shape[1] == 1
    for ax, (i, j) in zip(panels, pairs, strict=True):
        points = ax.scatter(
            X[:, i], deviation if single else X[:, j], c=deviation, s=9, cmap="viridis", norm="log", lw=0
        )
        ax.set(xlabel=names[i], ylabel="standard deviation" if single else names[j])
    panels[0].set_title("largest standard deviation of the policy", fontsize=10.5)
    figure.colorbar(points, ax=panels, label="units of the action", format="%.2g")


def _draw_ellipses(ax: Axes, report: Identifiability, low: np.ndarray, high: np.ndarray) -> None:
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
