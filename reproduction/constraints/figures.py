"""Pictures of constraints learnt and measured."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from reproduction.constraints.settings import KINDS
from reproduction.constraints.surfaces import CENTERS, Surfaces
from reproduction.constraints.trial import NOISE, SWEPT
from unconstrain.constraints.learnt import FeatureConstraint
from unconstrain.constraints.learnt.lines import align
from unconstrain.features import NormalizedRBF
from unconstrain.plot.colors import DIRECT, LEARNT, RECORDED

COLORS = (LEARNT, DIRECT, "#009E73", "#CC79A7")
TASK = ("x", "y", "z", "ωx", "ωy", "ωz")
NORMAL_LENGTH = 0.02
"""Of the drawn normals, in metres."""


def plot_noise(results: list[dict[str, Any]]) -> Figure:
    """Plot nPPE against noise, by setting."""
    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    ax = figure.subplots()
    percent = 100 * np.array(NOISE)
    for name, color in zip(SWEPT, COLORS, strict=True):
        errors = np.array(
            [[at["nPPE"] for at in result[f"{name}, noise"]] for result in results], dtype=float
        )
        low, middle, high = np.nanpercentile(errors, [25, 50, 75], axis=0)
        ax.fill_between(percent[1:], low[1:], high[1:], color=color, alpha=0.15, lw=0)
        ax.plot(
            percent[1:], middle[1:], "o-", color=color, ms=4, label=f"{name} (without noise {middle[0]:.0e})"
        )
    ax.set_yscale("log")
    ax.set(xlabel="noise on the actions (% of their scale)", ylabel="nPPE, held out")
    ax.legend(frameon=False, fontsize=8)
    ax.grid(alpha=0.3)
    return figure


def plot_rows(results: list[dict[str, Any]]) -> Figure:
    """Plot how far each of the arm's six task coordinates is constrained: mean over data sets, four types."""
    figure = Figure(figsize=(5.6, 2.9), layout="constrained")
    ax = figure.subplots()
    shares = np.array([[result[f"7-DOF arm, {kind}"]["features"] for kind in KINDS] for result in results])
    image = ax.imshow(shares.mean(axis=0), cmap="Blues", vmin=0, vmax=1, aspect="auto")
    for (i, j), share in np.ndenumerate(shares.mean(axis=0)):
        ax.text(
            j,
            i,
            f"{share:.2f}",
            ha="center",
            va="center",
            color="white" if share > 0.5 else "black",
            fontsize=8,
        )
    ax.set_xticks(range(6), [f"{i + 1}: {name}" for i, name in enumerate(TASK)])
    ax.set_yticks(range(4), KINDS)
    ax.set(xlabel="task coordinate of the hand", ylabel="rows held fixed")
    figure.colorbar(image, ax=ax, label="found constrained")
    return figure


def plot_measured(results: list[dict[str, Any]]) -> Figure:
    """Plot the nUPE of every data set by inconsistency and with the constraints known; log scale."""
    figure = Figure(figsize=(7.6, 3.8), layout="constrained")
    pairs = {
        "arm on a table,\nmodel chosen": ("arm", "inconsistency", "forces"),
        "arm on a table,\nlocal models": ("arm", "inconsistency, local models", "forces, local models"),
        "grasp,\nten movements": ("grasp", "inconsistency", "projections"),
    }
    ax = figure.subplots()
    for i, (plant, *names) in enumerate(pairs.values()):
        for side, name, color, label in zip(
            (-0.18, 0.18),
            names,
            (RECORDED, LEARNT),
            ("inconsistency", "constraints known"),
            strict=True,
        ):
            values = np.array([result[plant][name] for result in results])
            spread = np.linspace(-0.1, 0.1, len(values)) if len(values) > 1 else np.zeros(1)
            ax.plot(
                i + side + spread, values, ".", color=color, alpha=0.6, ms=5, label=label if i == 0 else None
            )
            ax.plot([i + side - 0.14, i + side + 0.14], [values.mean()] * 2, color=color, lw=2)
    ax.set_yscale("log")
    ax.set_xticks(range(len(pairs)), list(pairs))
    ax.set_ylabel("nUPE, new starts")
    ax.legend(frameon=False, fontsize=8)
    ax.grid(axis="y", alpha=0.3)
    return figure


def plot_surfaces(found: Surfaces) -> Figure:
    """Plot points of both recordings with learnt normals, and the error by number of RBFs."""
    figure = Figure(figsize=(14.5, 4.4), layout="constrained")
    learnt = FeatureConstraint(NormalizedRBF(found.best)).fit(found.curved.states, found.curved.actions)
    normals = (np.broadcast_to(found.normal, found.flat.states.shape), learnt.rows(found.curved.states)[:, 0])
    for place, (title, D, n) in enumerate(
        (
            ("flat surface: one normal", found.flat, normals[0]),
            (f"curved: {found.best} RBFs", found.curved, normals[1]),
        )
    ):
        ax = figure.add_subplot(1, 3, place + 1, projection="3d")
        X, step = D.states, max(1, len(D) // 60)
        up = align(n)
        up = up * (np.sign(up[:, 2].mean()) or 1.0)
        ax.scatter(*X[::4].T, s=5, color=RECORDED, alpha=0.5, linewidths=0)
        ax.quiver(*X[::step].T, *up[::step].T, length=NORMAL_LENGTH, color=LEARNT, linewidth=1.0)
        ax.set(xlabel="x (m)", ylabel="y (m)", zlabel="z (m)", title=title)
        ax.set_aspect("equal")
        ax.set_box_aspect(None, zoom=0.95)
        ax.locator_params(nbins=3)
    ax = figure.add_subplot(1, 3, 3)
    ax.plot(CENTERS, [found.curved_errors[f"{n} RBFs"] for n in CENTERS], "o-", color=LEARNT, label="RBFs")
    ax.axhline(found.curved_errors["constant row"], color=DIRECT, ls="--", label="constant row")
    ax.set(xlabel="number of RBFs", ylabel="nPOE, blocks held out", title="curved surface")
    ax.set_xticks(CENTERS)
    ax.set_ylim(bottom=0)
    ax.legend(frameon=False)
    ax.grid(alpha=0.3)
    return figure
