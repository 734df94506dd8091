"""Pictures of what recordings cannot tell."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from reproduction.identifiability import advice
from reproduction.identifiability.surfaces import Surface
from reproduction.identifiability.trial import BEST_FIRST, POWERS
from unconstrain import plot
from unconstrain.demo import make_policy
from unconstrain.diagnostics import identifiability
from unconstrain.limit_cycle import LimitCycle, demonstrate
from unconstrain.plot.colors import DIRECT, LEARNT, RECORDED, TRUE

COUNTS = {
    "limit cycle": (advice.TOY_FIRST, 1),
    "arm": (advice.ARM_FIRST, advice.ARM_AT_ONCE),
}
"""Demonstrations to begin with, and how many are added at a time."""

COLORS = ("#0072B2", "#009E73", "#E69F00", "#D55E00")


def plot_toy(seed: int = 0, movements: int = 4) -> Figure:
    """Plot predicted deviation and actual error over the plane, after few movements."""
    demos = demonstrate(movements, random_state=np.random.default_rng([seed, 0]))
    policy = make_policy().fit(demos.states, demos.actions, groups=demos.episodes)
    report = identifiability(policy, demos.states, demos.actions, groups=demos.episodes)
    figure = Figure(figsize=(10.5, 4.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    levels = np.geomspace(1e-3, 10.0, 17)
    plot.identifiability(report, region=((-1.0, -1.0), (1.0, 1.0)), levels=levels, worst=0, ax=left)
    left.set_title("predicted: standard deviation of the policy", fontsize=10.5)
    axis = np.linspace(-1.0, 1.0, 60)
    X = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    error = np.linalg.norm(policy.predict(X) - LimitCycle()(X), axis=1).reshape(60, 60)
    shown = right.contourf(
        axis, axis, np.clip(error, levels[0], levels[-1]), levels, norm="log", cmap="viridis"
    )
    plot.demonstrations(demos, color="white", ax=right)
    right.set(xlabel="x1", ylabel="x2", aspect="equal", xlim=(-1, 1), ylim=(-1, 1))
    right.set_title("actual: error of the policy", fontsize=10.5)
    figure.colorbar(
        shown, ax=right, ticks=[1e-3, 1e-2, 1e-1, 1, 10], format="%g", label="units of the action", shrink=0.8
    )
    return figure


def plot_shares(results: list[dict[str, Any]]) -> Figure:
    """Plot determined share against nUPE, a point a trial and type of constraint."""
    figure = Figure(figsize=(9.6, 4.0), layout="constrained")
    for ax, p in zip(figure.subplots(1, 2), POWERS, strict=True):
        for rows, color in zip(BEST_FIRST, COLORS, strict=True):
            found = [result["arm"][f"{p} {rows}"] for result in results]
            share, error = (np.array([one[what] for one in found]) for what in ("determined", "nUPE"))
            ax.plot(share, error, "o", color=color, ms=4, alpha=0.7, mec="none", label=rows)
        ax.set_yscale("log")
        ax.set(xlabel="determined share of the policy", ylabel="nUPE", title=f"p = {p}")
        ax.grid(alpha=0.3)
        ax.legend(title="rows constrained", frameon=False, fontsize=8)
    return figure


def plot_advice(studies: dict[tuple[str, str], dict[str, np.ndarray]]) -> Figure:
    """Plot nUPE against the number of demonstrations, at random, as advised and by the oracle."""
    rows = -(-len(studies) // 2)
    figure = Figure(figsize=(9.6, 4.0 * rows), layout="constrained")
    panels = figure.subplots(rows, 2, squeeze=False).ravel()
    for ax, ((plant, risk), ways) in zip(panels, studies.items(), strict=False):
        first, step = COUNTS[plant]
        for way, color in (("random", DIRECT), ("advised", LEARNT), ("oracle", TRUE)):
            if way not in ways:
                continue
            counts = first + step * np.arange(ways[way].shape[1])
            low, middle, high = np.percentile(ways[way], [25, 50, 75], axis=0)
            ax.fill_between(counts, low, high, color=color, alpha=0.15, lw=0)
            ax.plot(counts, middle, "o-", color=color, ms=3.5, label=way)
        ax.set_yscale("log")
        ax.set(xlabel="demonstrations", ylabel="nUPE", title=f"{plant}, {risk}")
        ax.grid(alpha=0.3)
        ax.legend(frameon=False)
    return figure


def plot_surfaces(found: list[Surface]) -> Figure:
    """Plot points of each surface with their normals and the directions least seen, and the angles between them."""
    figure = Figure(figsize=(12.5, 4.2))
    for i, surface in enumerate(found, 1):
        ax: Any = figure.add_axes((0.35 * i - 0.34, 0.06, 0.31, 0.84), projection="3d")
        ax.plot(*surface.points.T, ".", color=RECORDED, ms=1.5)
        picked = slice(None, None, max(1, len(surface.points) // 30))
        points, length = surface.points[picked], 0.2 * float(np.ptp(surface.points, axis=0).max())
        # A normal has no sign: both are drawn to the same side, the upper one.
        for lines, color, label in (
            (surface.normals[picked], TRUE, "normal of the points"),
            (surface.unseen[picked], LEARNT, "direction least seen"),
        ):
            up = lines * np.where(lines[:, 2:] < 0, -1.0, 1.0)
            ax.quiver(*points.T, *(length * up).T, color=color, lw=1, arrow_length_ratio=0.2, label=label)
        ax.set_title(surface.name, fontsize=10.5)
        ax.set(xlabel="x (m)", ylabel="y (m)", zlabel="z (m)")
        ax.set_box_aspect(np.maximum(np.ptp(surface.points, axis=0), 0.1))
        ax.locator_params(nbins=4)
        if i == 1:
            ax.legend(frameon=False, fontsize=8, loc="upper left")
    last = figure.add_axes((0.74, 0.15, 0.24, 0.72))
    for surface, color in zip(found, (LEARNT, DIRECT), strict=False):
        angles = np.sort(surface.angles)
        last.plot(angles, np.arange(1, len(angles) + 1) / len(angles), color=color, label=surface.name)
    last.set(xlabel="angle between them (°)", ylabel="share of states", xlim=(0, 90), ylim=(0, 1))
    last.grid(alpha=0.3)
    last.legend(frameon=False)
    return figure
