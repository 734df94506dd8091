"""The learnt field as arrows and stream lines, fainter where the policy is less sure."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.demonstrations import Demonstrations
from unconstrain.features.centers import farthest_first
from unconstrain.motion import lengths
from unconstrain.plot.arrows import scale_arrows
from unconstrain.spaces import SecondOrder
from unconstrain.viewer import arrows, palette, streams
from unconstrain.viewer.stage import DIRECT, Stage
from unconstrain.viewer.sureness import Sureness
from unconstrain.viewer.surroundings import limits

Array = NDArray[np.float64]

ALONG, IN_SPACE = 17, 220
"""Arrows along each side of a plane, and in all elsewhere."""
LONGEST = {True: 1.15, False: 0.09}
"""The longest arrow: in spacings of a plane's, or as a share of the scene's extent."""
LIFT = 0.004
BACKGROUND = "#ffffff"

RECORDED, HELD = "recorded states", "the others as at the start"
"""Where arrows stand that are over more states than are shown."""


class Field:
    """Arrows and stream lines of the policy that is shown.

    Parameters
    ----------
    demos : Demonstrations, optional
        All recordings.
    """

    def __init__(self, demos: Demonstrations | None) -> None:
        self._demos = demos
        self._arrows: Any = None
        self._streams: Any = None
        self._sureness: dict[str, Sureness] = {}
        self.shows_arrows, self.shows_streams = True, False
        self.through = RECORDED

    def sureness(self, stage: Stage) -> Sureness:
        """Return how sure the policy is that is shown."""
        if stage.name not in self._sureness:
            self._sureness[stage.name] = Sureness(stage.policy, self._demos)
        return self._sureness[stage.name]

    def draw(self, stage: Stage) -> None:
        """Draw both; see `Part`."""
        colour = palette.DIRECT if stage.name == DIRECT else palette.LEARNT
        self._arrows = _replaced(self._arrows, self._draw_arrows(stage, colour))
        self._streams = _replaced(self._streams, self._draw_streams(stage, colour))

    def _draw_arrows(self, stage: Stage, colour: str) -> Any:
        if not self.shows_arrows or isinstance(stage.policy.space_, SecondOrder):
            return None
        X, spacing = stand(stage, self.through)
        U = stage.policy.predict(X).reshape(len(X), -1)
        V = stage.frame.vectors(np.einsum("nkd,nd->nk", stage.coordinates.tangents(X), U))
        vertices, faces = arrows.shape()
        return stage.server.scene.add_batched_meshes_simple(
            "/arrows",
            vertices,
            faces,
            batched_wxyzs=arrows.turns(V),
            batched_positions=stage.places(X, lift=LIFT),
            batched_scales=(spacing * lengths(scale_arrows(V))).astype(np.float32),
            batched_colors=palette.linear(np.array(palette.rgb(colour))),
            batched_opacities=self.sureness(stage)(X),
            lod="off",
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )

    def _draw_streams(self, stage: Stage, colour: str) -> Any:
        if not self.shows_streams:
            return None
        pieces, X = streams.segments(stage)
        if not len(pieces):
            return None
        colours = palette.linear(palette.blend(self.sureness(stage)(X), BACKGROUND, colour))
        return stage.server.scene.add_line_segments(
            "/streams",
            pieces,
            np.repeat(colours[:, None], 2, axis=1),
            thickness=1.5,
            thickness_units="screen",
        )


def stand(stage: Stage, through: str = RECORDED) -> tuple[Array, float]:
    """Choose where arrows stand.

    Parameters
    ----------
    stage : Stage
        What is shown.
    through : str
        `RECORDED` or `HELD`: where those over more states than are shown stand.

    Returns
    -------
    X : ndarray of shape (N, n)
        States: a grid where all of one or two are shown, else recorded ones that are spread out.
    longest : float
        How long the longest arrow is, in the scene.
    """
    frame, axes, shown = stage.frame, stage.axes, len(stage.coordinates.names)
    if frame.is_flat and shown == len(axes.names) == stage.states.shape[1]:
        low, high = limits(frame)
        spacing = float((high - low).max()) / (ALONG - 1)
        counts = np.maximum(np.round((high - low) / spacing).astype(int) + 1, 2)
        grid = np.meshgrid(*(np.linspace(a, b, k) for a, b, k in zip(low, high, counts, strict=True)))
        places = np.stack(grid, axis=-1).reshape(-1, shown)
        X = np.stack([stage.coordinates.put(stage.start, place) for place in places])
        return X, LONGEST[True] * spacing * frame.scale
    X = farthest_first(stage.states, n_centers=min(IN_SPACE, len(stage.states)))[0]
    if through == HELD:
        X = np.stack([stage.coordinates.put(stage.start, place) for place in stage.coordinates.place(X)])
    return X, LONGEST[False] * frame.extent


def _replaced(old: Any, new: Any) -> Any:
    """Return the new handle; one of the same name has taken the old one's place already."""
    if old is not None and new is None:
        old.remove()
    return new
