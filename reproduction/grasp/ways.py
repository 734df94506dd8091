"""The hands' ways on the page: where they went, and where they will go."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.viewer import palette

Array = NDArray[np.float64]

MOST = 400
"""Samples of the way gone that are drawn."""

GONE, FORESEEN = 4.0, 2.5
"""Widths of the lines, in pixels."""


class Ways:
    """Lines for both hands.

    Parameters
    ----------
    server : viser.ViserServer
        In whose scene they are.
    """

    def __init__(self, server: Any) -> None:
        self._server = server
        self._trail: list[Array] = []
        styles = {
            "gone": (palette.PATH, GONE),
            "foreseen": (palette.LEARNT, FORESEEN),
            "held": (palette.HELD, FORESEEN),
        }
        self._lines = {
            name: server.scene.add_line_segments(
                f"/hands/{name}",
                np.zeros((1, 2, 3)),
                palette.rgb(color),
                thickness=width,
                thickness_units="screen",
                visible=False,
            )
            for name, (color, width) in styles.items()
        }

    def begin(self) -> None:
        """Forget where the hands went."""
        self._trail = []

    def go(self, hands: Array) -> None:
        """Take where the hands (2, 3) are now."""
        self._trail = [*self._trail[1 - MOST :], hands]

    def show_gone(self) -> None:
        """Show where the hands went."""
        self._draw("gone", _pieces(np.stack(self._trail)) if self._trail else np.empty((0, 2, 3)))

    def show_foreseen(self, ways: Array, held: NDArray[np.bool_]) -> None:
        """Show where the hands will go, ways (T, 2, 3), and where they are held, (T, 2)."""
        pieces, is_held = _pieces(ways), held[:-1].T.ravel()
        with self._server.atomic():
            self._draw("foreseen", pieces[~is_held])
            self._draw("held", pieces[is_held])

    def _draw(self, name: str, pieces: Array) -> None:
        line = self._lines[name]
        line.visible = len(pieces) > 0
        if len(pieces):
            line.points = pieces.astype(np.float32)


def _pieces(ways: Array) -> Array:
    """Cut ways (T, 2, 3) into pieces (2 (T - 1), 2, 3), those of the first hand first."""
    return np.stack([ways[:-1], ways[1:]], axis=2).transpose(1, 0, 2, 3).reshape(-1, 2, 3)
