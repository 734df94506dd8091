"""Pictures of learnt constraints: how the motion is shared out, and where the rows point."""

import numpy as np
from matplotlib.figure import Figure

from unconstrain.constraints.learnt.base import LearntConstraint
from unconstrain.demonstrations import Demonstrations
from unconstrain.plot.policy import DIRECT, LEARNT, RECORDED

ARROWS = 60
ARROW_LENGTH = 0.12
"""Of the recording's extent."""


def found(demonstrations: Demonstrations, constraint: LearntConstraint) -> Figure:
    """Shares of motion by direction, constrained ones marked; and the rows.

    Where states and actions are two or three positions and their velocities, the rows are drawn on the recorded points,
    else as a table of their mean squares by action.
    """
    X, names = demonstrations.states, demonstrations.state_names
    A, shares = constraint.rows(X), constraint.shares_
    figure = Figure(figsize=(10.0, 4.4), layout="constrained")
    left = figure.add_subplot(1, 2, 1)
    k = constraint.n_constraints_
    whole = len(shares) == A.shape[2]
    bars = shares if whole else np.append(shares, 1.0 - shares.sum())
    names_of_bars = [f"{i + 1}" for i in range(len(shares))] + ([] if whole else ["all others"])
    left.bar(names_of_bars, 100 * bars, color=[DIRECT] * k + [LEARNT] * (len(bars) - k))
    for i, share in enumerate(bars):
        left.annotate(f"{share:.2%}", (i, 100 * share), ha="center", va="bottom", fontsize=9)
    left.set(
        xlabel="direction, from the least moved in", ylabel="share of motion (%)",
        title=f"{k} of {A.shape[2]} directions constrained",
    )  # fmt: skip
    picked = slice(None, None, max(1, len(X) // ARROWS))
    extent = float(np.ptp(X, axis=0).max()) or 1.0
    if X.shape[1] == A.shape[2] == 3:
        ax = figure.add_subplot(1, 2, 2, projection="3d")
        ax.scatter(*X[:: max(1, len(X) // 1000)].T, s=5, color=RECORDED, alpha=0.5, linewidths=0)
        for j in range(A.shape[1]):
            up = aligned(A[:, j])
            ax.quiver(*X[picked].T, *up[picked].T, length=ARROW_LENGTH * extent, color=DIRECT, linewidth=1.0)
        ax.set(xlabel=names[0], ylabel=names[1], zlabel=names[2], title="Rows on the recorded points")
        ax.set_aspect("equal")
        ax.locator_params(nbins=5)
    elif X.shape[1] == A.shape[2] == 2:
        ax = figure.add_subplot(1, 2, 2)
        ax.plot(*X.T, ".", color=RECORDED, ms=2, alpha=0.4)
        up = aligned(A[:, 0])
        ax.quiver(
            *X[picked].T, *up[picked].T, angles="xy", scale_units="xy", scale=1 / (ARROW_LENGTH * extent),
            color=DIRECT, width=0.004,
        )  # fmt: skip
        ax.set(xlabel=names[0], ylabel=names[1], title="Row on the recorded points")
        ax.set_aspect("equal", adjustable="datalim")
    else:
        ax = figure.add_subplot(1, 2, 2)
        image = ax.imshow(np.mean(A**2, axis=0), cmap="Blues", vmin=0, vmax=1, aspect="auto")
        ax.set_xticks(range(A.shape[2]), demonstrations.action_names, rotation=45, ha="right")
        ax.set_yticks(range(A.shape[1]), [f"row {j + 1}" for j in range(A.shape[1])])
        ax.set_title("Mean squares of the rows")
        figure.colorbar(image, ax=ax)
    return figure


def aligned(rows: np.ndarray) -> np.ndarray:
    """Rows (N, d) with their signs turned the same way: a row and its negative are the same constraint."""
    return rows * np.where(rows @ middle(rows) < 0, -1.0, 1.0)[:, None]


def middle(rows: np.ndarray) -> np.ndarray:
    """The unit vector (d,) nearest to unit rows (N, d), whatever their signs."""
    return np.linalg.eigh(rows.T @ rows)[1][:, -1]
