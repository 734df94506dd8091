"""Fig. 1 anew."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from reproduction.plants.box import Box
from reproduction.plants.finger import Finger
from unconstrain import plot
from unconstrain.demonstrations import Demonstrations
from unconstrain.plot.colors import DIRECT, LEARNT, TRUE
from unconstrain.policies import ParametricPolicy


def plot_figure_1(
    finger: Finger,
    free: Demonstrations,
    blocked: Demonstrations,
    obstacle: Box,
    seen: Demonstrations,
    learnt: ParametricPolicy,
    direct: ParametricPolicy,
) -> Figure:
    """Plot both movements, both fields over the two inner joints, and the learnt policy over the true one."""
    figure = Figure(figsize=(13.0, 6.6), layout="constrained")
    panels = figure.subplot_mosaic([["free", "fields", "learnt"], ["blocked", "fields", "learnt"]])
    for name, movement, box in (("free", free, None), ("blocked", blocked, obstacle)):
        _draw_movement(panels[name], finger, movement, box)
    panels["free"].set_title("(a) unconstrained", fontsize=11)
    panels["blocked"].set_title("(b) an obstacle in the way", fontsize=11)

    X = blocked.states[::12]
    _draw_arrows(panels["fields"], X, finger.policy(X), DIRECT, "policy π")
    _draw_arrows(panels["fields"], X, blocked.actions[::12], TRUE, "recorded u = Nπ")
    for movement, color, label in (
        (free, DIRECT, "free"),
        (blocked, TRUE, "along the obstacle"),
    ):
        plot.demonstrations(movement, color=color, label=label, ax=panels["fields"])
    panels["fields"].set_title("(c) one policy, two behaviours", fontsize=11)

    picked = slice(None, None, 40)
    plot.demonstrations(seen, label="recorded movements", ax=panels["learnt"])
    X = seen.states[picked]
    _draw_arrows(panels["learnt"], X, finger.policy(X), TRUE, "policy π", width=0.011)
    _draw_arrows(panels["learnt"], X, direct.predict(X), DIRECT, "ordinary regression")
    _draw_arrows(panels["learnt"], X, learnt.predict(X), LEARNT, "learnt", width=0.005)
    panels["learnt"].set_title(f"(d) learnt from {seen.n_episodes} obstacles", fontsize=11)
    for name in ("fields", "learnt"):
        panels[name].set(xlabel="joint 1 (rad)", ylabel="joint 2 (rad)")
        panels[name].set_aspect("equal", adjustable="datalim")
        panels[name].legend(frameon=False, fontsize=9, loc="upper left")
    return figure


def _draw_movement(ax: Axes, finger: Finger, movement: Demonstrations, box: Box | None) -> None:
    if box is not None:
        ax.add_patch(Polygon(box.outline(), color="#444444"))
    postures = movement.episode(0).states
    frames = postures[np.linspace(0, len(postures) - 1, 6).astype(int)]
    for i, q in enumerate(frames):
        # Mixed with white, not transparent: phalanges overlap at the joints. As thick as it is, the finger touches.
        shade = 0.2 + 0.8 * i / (len(frames) - 1)
        face = 1 - shade * (1 - np.array(to_rgb(LEARNT)))
        for outline in finger.outlines(q):
            ax.add_patch(Polygon(outline, facecolor=tuple(face), edgecolor="white", lw=0.6, zorder=2 + i))
        ax.plot(*finger.joints(q[None])[0, :-1].T, "o", color="white", ms=2.5, zorder=2 + i)
    ax.set_aspect("equal")
    ax.set(xlim=(-0.012, 0.112), ylim=(-0.09, 0.018), xlabel="m", ylabel="m")


def _draw_arrows(
    ax: Axes, X: np.ndarray, U: np.ndarray, color: str, label: str, width: float = 0.005
) -> None:
    ax.quiver(
        X[:, 0], X[:, 1], U[:, 0], U[:, 1],
        angles="xy", scale_units="xy", scale=6.0, width=width, color=color, label=label, zorder=3,
    )  # fmt: skip
