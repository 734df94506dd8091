"""The picture and the rollout as files."""

import io
import tempfile
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.plot.arrows import scale_arrows
from unconstrain.recordings.text import write_csv
from unconstrain.stopping import Movement
from unconstrain.viewer import field, palette
from unconstrain.viewer.following import is_held
from unconstrain.viewer.stage import DIRECT, Stage
from unconstrain.viewer.sureness import Sureness

SAMPLES = 4000
"""Recorded samples in a picture of vectors, which grows with them."""


def png(render: NDArray[np.uint8]) -> bytes:
    """Write what the browser rendered as PNG.

    Parameters
    ----------
    render : ndarray of shape (H, W, 3) or (H, W, 4)
        Numbers to 255; what is transparent becomes white.

    Returns
    -------
    bytes
        Of the file.
    """
    from matplotlib.image import imsave

    image = np.asarray(render, dtype=np.float64)
    if image.shape[-1] == 4:
        alpha = image[..., 3:] / 255.0
        image = alpha * image[..., :3] + (1.0 - alpha) * 255.0
    buffer = io.BytesIO()
    imsave(buffer, np.clip(image, 0, 255).astype(np.uint8), format="png")
    return buffer.getvalue()


def csv(movement: Movement) -> bytes:
    """Write a rollout as CSV, as `unconstrain rollout` does.

    Parameters
    ----------
    movement : Movement
        One.

    Returns
    -------
    bytes
        Of the file.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = FilePath(folder) / "rollout.csv"
        write_csv(movement, path)
        return path.read_bytes()


def svg(stage: Stage, sureness: Sureness) -> bytes:
    """Draw movements, field and rollout with matplotlib, as SVG.

    Parameters
    ----------
    stage : Stage
        What is shown.
    sureness : Sureness
        Of the policy that is shown.

    Returns
    -------
    bytes
        Of the file; from the usual side where it is in space.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 6.4), layout="constrained")
    flat = stage.frame.is_flat
    ax: Any = figure.add_subplot() if flat else figure.add_subplot(projection="3d")
    _draw_samples(ax, stage)
    X, longest = field.stand(stage)
    U = stage.policy.predict(X).reshape(len(X), -1)
    P, V = stage.coordinates.place(X), np.einsum("nkd,nd->nk", stage.coordinates.tangents(X), U)
    colour = palette.DIRECT if stage.name == DIRECT else palette.LEARNT
    shades = np.column_stack([np.tile(np.array(palette.rgb(colour)) / 255.0, (len(X), 1)), sureness(X)])
    arrow = longest / stage.frame.scale * scale_arrows(V)
    if flat:
        ax.quiver(*P.T, *arrow.T, angles="xy", scale_units="xy", scale=1.0, color=shades, width=0.0035)
        ax.set_aspect("equal", adjustable="datalim")
    else:
        ax.quiver(*P.T, *arrow.T, color=shades, linewidth=0.8)
        ax.set_aspect("equal")
    if stage.movement is not None:
        path, held = stage.coordinates.place(stage.movement.states), is_held(stage.movement)
        ax.plot(*path.T, color=palette.PATH, lw=2.2, label="rollout")
        if held.any():
            ax.plot(*path[held].T, ".", color=palette.HELD, ms=5, label="something in its way")
        ax.plot(*path[:1].T, "o", color=palette.LEARNT, ms=8, label="start")
    for name, set_label in zip(
        stage.coordinates.names, ("set_xlabel", "set_ylabel", "set_zlabel"), strict=False
    ):
        getattr(ax, set_label)(name)
    ax.legend(frameon=False, fontsize=8, loc="upper right")
    buffer = io.BytesIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()


def _draw_samples(ax: Any, stage: Stage) -> None:
    every = -(-len(stage.states) // SAMPLES)
    P = stage.coordinates.place(stage.states[::every])
    free = None if stage.shown.free is None else stage.shown.free[::every]
    if free is None:
        ax.plot(*P.T, ".", color=palette.RECORDED, ms=2, label="recorded")
        return
    for which, colour, label in (
        (free >= 0.5, palette.FREE, "free"),
        (free < 0.5, palette.CONSTRAINED, "constrained"),
        (np.isnan(free), palette.RECORDED, "not known"),
    ):
        if which.any():
            ax.plot(*P[which].T, ".", color=colour, ms=2, label=label)
