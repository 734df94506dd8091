"""The rollout: its line, in another colour where something is in its way, and a marker for the time line."""

import numpy as np

from unconstrain.stopping import Movement
from unconstrain.viewer import palette
from unconstrain.viewer.following import is_held
from unconstrain.viewer.stage import Stage

THICKNESS, LIFT = 4.5, 0.012
MARKER = 0.018
"""Radius, as a share of the scene's extent."""


class Path:
    """The line of the newest rollout.

    Parameters
    ----------
    stage : Stage
        Where it is drawn.
    """

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        nothing = np.zeros((1, 2, 3))
        self._lines = [
            stage.server.scene.add_line_segments(
                name,
                nothing,
                palette.rgb(colour),
                thickness=THICKNESS,
                thickness_units="screen",
                visible=False,
            )
            for name, colour in (("/path/free", palette.PATH), ("/path/held", palette.HELD))
        ]
        self._marker = stage.server.scene.add_icosphere(
            "/path/now", radius=1.0, color=palette.rgb(palette.HELD)
        )
        self._end = stage.server.scene.add_icosphere("/path/end", radius=1.0, color=palette.rgb(palette.PATH))
        self.draw(stage)

    def draw(self, stage: Stage) -> None:
        """Draw it anew where coordinates changed; see `Part`."""
        radius = MARKER * stage.frame.extent
        self._marker.scale, self._end.scale = radius, 0.7 * radius
        if stage.movement is not None:
            self.update(stage.movement)

    def update(self, movement: Movement) -> None:
        """Draw a new rollout.

        Parameters
        ----------
        movement : Movement
            One.
        """
        P = self._stage.places(movement.states, lift=LIFT)
        pieces, held = np.stack([P[:-1], P[1:]], axis=1), is_held(movement)[:-1]
        with self._stage.server.atomic():
            for line, which in zip(self._lines, (~held, held), strict=True):
                if which.any():
                    line.points = pieces[which]
                line.visible = bool(which.any())
            self._end.position = tuple(P[-1])

    def mark(self, state: np.ndarray) -> None:
        """Put the marker to a state.

        Parameters
        ----------
        state : ndarray of shape (n,)
            Of the rollout, at the time of the time line.
        """
        self._marker.position = tuple(self._stage.places(state[None], lift=LIFT)[0])
