"""A plane to place and tilt, and a box to move, in the way of the rollout."""

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.viewer import palette
from unconstrain.viewer.barriers import Barrier, Box, Plane
from unconstrain.viewer.frame import Frame
from unconstrain.viewer.stage import Stage

Array = NDArray[np.float64]

NOTHING, PLANE, BOX, BOTH = "nothing", "a plane", "a box", "a plane and a box"
SHEET, THIN = {True: 3.0, False: 1.5}, 0.008
"""Side of the plane that is drawn, where all is flat and in space, and its thickness, as shares of the scene's extent:
it goes on for ever."""
BEGINS = 0.22
"""Side of the box at first, as a share of the scene's extent."""
HANDLE = 0.18


class Obstacles:
    """The barriers of the rollout, with their handles.

    Parameters
    ----------
    changed : callable
        Is called when one is moved, chosen or left away.
    """

    def __init__(self, changed: Callable[[], None]) -> None:
        self._changed = changed
        # Whoever changes the coordinates draws at once, and the thread that draws does as well.
        self._lock = threading.Lock()
        self._handles: dict[str, Any] = {}
        self._body: Any = None
        self._stage: Stage | None = None
        self._frame: Frame | None = None
        self.chosen = NOTHING
        self.side = 1.0

    def draw(self, stage: Stage) -> None:
        """Draw those that are chosen, anew if what is shown changed; see `Part`."""
        with self._lock:
            self._draw(stage, stage.frame)

    def _draw(self, stage: Stage, frame: Frame) -> None:
        if self._stage is not stage or self._frame is not frame:
            self.side = BEGINS * frame.extent
            for handle in self._handles.values():
                handle.remove()
            self._handles, self._body, self._stage, self._frame = {}, None, stage, frame
        wanted = {PLANE: [PLANE], BOX: [BOX], BOTH: [PLANE, BOX]}.get(self.chosen, [])
        for name in (PLANE, BOX):
            if name in wanted and name not in self._handles:
                self._handles[name] = self._make(stage, name)
            if name in self._handles:
                self._handles[name].visible = name in wanted

    def choose(self, chosen: str, stage: Stage) -> None:
        """Put one, both or neither in the way.

        Parameters
        ----------
        chosen : str
            `NOTHING`, `PLANE`, `BOX` or `BOTH`.
        stage : Stage
            Where they are drawn.
        """
        self.chosen = chosen
        self.draw(stage)
        self._changed()

    def side_in_units(self, stage: Stage) -> float:
        """Return the side of the box in the units of what is shown."""
        self.draw(stage)
        return self.side / stage.frame.scale

    def resize(self, side: float) -> None:
        """Make the box of another side, in the scene."""
        with self._lock:
            self.side = side
            if self._body is not None and self._stage is not None:
                self._body.dimensions = self._drawn_sides(self._stage)
        self._changed()

    def place(self, name: str, point: Array, wxyz: Array | None = None) -> None:
        """Put a plane or a box to a point (3,) of the scene, and turn it, as if its handle were dragged."""
        self._handles[name].position = tuple(point)
        if wxyz is not None:
            self._handles[name].wxyz = tuple(wxyz)
        self._changed()

    def barriers(self) -> list[Barrier]:
        """Return what is in the way now."""
        found: list[Barrier] = []
        # A handle is missing for a moment while other coordinates are shown.
        if self.chosen in (PLANE, BOTH) and (handle := self._handles.get(PLANE)) is not None:
            found.append(Plane(np.array(handle.position), _first_axis(np.array(handle.wxyz))))
        if self.chosen in (BOX, BOTH) and (handle := self._handles.get(BOX)) is not None:
            sides = np.full(3, self.side)
            if self._stage is not None:
                sides[len(self._stage.coordinates.names) :] = np.inf
            found.append(Box(np.array(handle.position), sides))
        return found

    def _make(self, stage: Stage, name: str) -> Any:
        scene, frame, extent = stage.server.scene, stage.frame, stage.frame.extent
        # The plane begins on the far side of where the rollout starts, facing it.
        begin = stage.places(stage.start[None])[0]
        towards = frame.middle - begin
        far = float(np.linalg.norm(towards))
        towards = towards / far if far > 0.05 * extent else np.array([1.0, 0.0, 0.0])
        at = begin + max(0.6 * far, self.side) * towards
        handle = scene.add_transform_controls(
            f"/{'plane' if name == PLANE else 'box'}",
            scale=HANDLE * extent,
            active_axes=(True, True, not frame.is_flat),
            disable_rotations=name == BOX,
            depth_test=False,
            position=tuple(at),
            wxyz=_facing(begin - at) if name == PLANE else (1.0, 0.0, 0.0, 0.0),
        )
        style: dict[str, Any] = {"opacity": 0.35, "cast_shadow": False, "receive_shadow": False}
        style["color"] = palette.rgb(palette.HELD)
        if name == PLANE:
            high = 0.04 * extent if frame.is_flat else SHEET[False] * extent
            sheet = (THIN * extent, SHEET[frame.is_flat] * extent, high)
            # What is drawn lies behind the surface that bars the way.
            scene.add_box("/plane/sheet", dimensions=sheet, position=(-THIN * extent / 2, 0.0, 0.0), **style)
        else:
            self._body = scene.add_box("/box/body", dimensions=self._drawn_sides(stage), **style)

        async def moved(event: Any) -> None:
            self._changed()

        handle.on_update(moved)
        return handle

    def _drawn_sides(self, stage: Stage) -> tuple[float, float, float]:
        return self.side, self.side, 0.04 * stage.frame.extent if stage.frame.is_flat else self.side


def _first_axis(wxyz: Array) -> Array:
    """Return where a rotation turns the x axis to."""
    w, x, y, z = wxyz
    return np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])


def _facing(direction: Array) -> tuple[float, float, float, float]:
    from unconstrain.viewer.arrows import turns

    w, x, y, z = turns(direction[None])[0].tolist()
    return w, x, y, z
