"""What recordings do not determine: ellipses of the policy's uncertainty, and markers of what to record next."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.demonstrations import Demonstrations
from unconstrain.diagnostics import Identifiability, identifiability
from unconstrain.errors import UnconstrainError
from unconstrain.features.centers import farthest_first
from unconstrain.viewer import palette
from unconstrain.viewer.stage import LEARNT, Stage

Array = NDArray[np.float64]

ELLIPSES, CORNERS = 70, 32
NEXT = 3
"""Recordings that are proposed."""
LONGEST = 0.11
"""Of the longest ellipse, as a share of the scene's extent."""
THINNEST = 0.07
"""Of ellipsoids, as a share of the longest: needles are not seen among arrows."""
ARROW, LIFT = 0.2, 0.02


class Diagnosis:
    """Ellipses and markers, computed once when they are first shown.

    Parameters
    ----------
    demos : Demonstrations, optional
        All recordings.
    """

    def __init__(self, demos: Demonstrations | None) -> None:
        self._demos = demos
        self._handles: list[Any] = []
        self._report: Identifiability | None = None
        self._planned: list[Any] = []
        self.visible = False
        self.words = ""

    def draw(self, stage: Stage) -> None:
        """Draw both where they are shown; see `Part`. This takes long the first time."""
        for handle in self._handles:
            handle.remove()
        self._handles = []
        if not self.visible:
            return
        if self._report is None and not self.words:
            self._compute(stage)
        if self._report is not None:
            self._draw_ellipses(stage, self._report)
            self._draw_markers(stage)

    def _compute(self, stage: Stage) -> None:
        if self._demos is None:
            self.words = "Without recordings it is not known what they determine."
            return
        try:
            report = identifiability(stage.policies[LEARNT], self._demos)
            self._planned = report.next_recordings(NEXT)
        except UnconstrainError as error:
            self.words = f"Not known: {error}."
            return
        self._report = report
        lessens = ", ".join(f"no. {k} by {each.gain:.0%}" for k, each in enumerate(self._planned, 1))
        self.words = (
            f"Determined: {report.determined_share:.1%} of the policy's directions. "
            f"A recording at each marker, in which motion along its arrow is free, lessens the expected squared error "
            f"of what is left: {lessens}. Ellipses are one standard deviation of the policy each way, drawn in "
            "proportion to the root of their size."
        )

    def _draw_ellipses(self, stage: Stage, report: Identifiability) -> None:
        X = farthest_first(stage.states, n_centers=min(ELLIPSES, len(stage.states)))[0]
        J = stage.coordinates.tangents(X)
        C = J @ report.covariance(X) @ J.swapaxes(1, 2)
        variances, vectors = np.linalg.eigh(C)
        # In proportion to the root of their size, lest small ones vanish, as in the pictures.
        lengths = np.maximum(variances, 0.0) ** 0.25
        lengths *= 0.5 * LONGEST * stage.frame.extent / (float(lengths.max()) or 1.0)
        places = stage.places(X, lift=LIFT / 2)
        if stage.frame.is_flat:
            self._handles.append(_outlines(stage, places, lengths, vectors))
        else:
            self._handles.append(_ellipsoids(stage, places, lengths, vectors))

    def _draw_markers(self, stage: Stage) -> None:
        scene, extent = stage.server.scene, stage.frame.extent
        for k, each in enumerate(self._planned, 1):
            x = each.state[None]
            at = stage.places(x, lift=LIFT)[0]
            along = stage.frame.vectors(stage.coordinates.tangents(x) @ each.direction)[0]
            along *= ARROW * extent / (float(np.linalg.norm(along)) or 1.0)
            self._handles += [
                scene.add_arrows(
                    f"/next/{k}/arrow",
                    np.stack([[at - along / 2, at + along / 2], [at + along / 2, at - along / 2]]),
                    palette.linear(np.array(palette.rgb(palette.HELD))),
                    shaft_radius=0.006 * extent,
                    head_radius=0.018 * extent,
                    head_length=0.035 * extent,
                ),
                # At the tip: several recordings may begin in one place.
                scene.add_label(
                    f"/next/{k}/label",
                    f"record next: {k}",
                    position=tuple(at + along / 2),
                    anchor="bottom-left",
                ),
            ]


def _outlines(stage: Stage, places: Array, lengths: Array, vectors: Array) -> Any:
    angles = np.linspace(0.0, 2 * np.pi, CORNERS + 1)
    k = lengths.shape[1]
    circle = np.stack([np.cos(angles), np.sin(angles)])[:k]
    rings = np.zeros((len(places), CORNERS + 1, 3))
    rings[..., :k] = np.einsum("nij,nj,jc->nci", vectors, lengths, circle)
    rings += places[:, None]
    pieces = np.stack([rings[:, :-1], rings[:, 1:]], axis=2).reshape(-1, 2, 3)
    return stage.server.scene.add_line_segments(
        "/unknown", pieces, palette.rgb(palette.UNKNOWN), thickness=1.8, thickness_units="screen"
    )


def _ellipsoids(stage: Stage, places: Array, lengths: Array, vectors: Array) -> Any:
    from scipy.spatial.transform import Rotation

    right_handed = vectors * np.array([1.0, 1.0, 1.0])
    right_handed[:, :, 2] *= np.sign(np.linalg.det(vectors))[:, None]
    vertices, faces = ball()
    return stage.server.scene.add_batched_meshes_simple(
        "/unknown",
        vertices,
        faces,
        batched_wxyzs=Rotation.from_matrix(right_handed).as_quat(scalar_first=True),
        batched_positions=places,
        batched_scales=np.maximum(lengths, THINNEST * lengths.max()).astype(np.float32),
        batched_colors=palette.linear(np.array(palette.rgb(palette.UNKNOWN))),
        opacity=0.35,
        lod="off",
        cast_shadow=False,
        receive_shadow=False,
    )


def ball(around: int = 16, rings: int = 8) -> tuple[Array, NDArray[np.uint32]]:
    """Make a ball of radius one.

    Parameters
    ----------
    around, rings : int
        How many points it has along the equator, and from pole to pole.

    Returns
    -------
    vertices : ndarray of shape (V, 3)
        Points.
    faces : ndarray of shape (F, 3)
        Triangles of them.
    """
    polar, azimuth = np.meshgrid(
        np.linspace(0, np.pi, rings + 1), 2 * np.pi * np.arange(around) / around, indexing="ij"
    )
    vertices = np.stack(
        [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1
    ).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rings), np.arange(around), indexing="ij")
    a, b = i * around + j, i * around + (j + 1) % around
    c, d = a + around, b + around
    faces = np.concatenate([np.stack([a, c, b], -1).reshape(-1, 3), np.stack([b, c, d], -1).reshape(-1, 3)])
    return vertices, faces.astype(np.uint32)
