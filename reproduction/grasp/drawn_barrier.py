"""The barrier on the page, with a handle that moves it aside and one that changes its width."""

from collections.abc import Callable
from typing import Any

from reproduction.grasp.interaction import NOTHING, Interaction
from reproduction.plants.scene import BOXES, OPACITY

COLOR = (0.35, 0.45, 0.6)

HANDLE, ABOVE = 0.1, 0.04
"""Size of the handles, and how far above and below the barrier's upper edge they are, in metres."""


class DrawnBarrier:
    """Boxes and handles.

    Parameters
    ----------
    server : viser.ViserServer
        In whose scene they are.
    interaction : Interaction
        Whose barrier is drawn.
    change : callable
        Is given `aside` or `width` in metres, by name, when a handle is dragged.

    Attributes
    ----------
    handles : dict of str to viser.TransformControlsHandle
        Named "aside" and "width".
    """

    def __init__(self, server: Any, interaction: Interaction, change: Callable[..., None]) -> None:
        self._server, self._interaction, self._change = server, interaction, change
        self.boxes = [
            server.scene.add_box(
                f"/barrier/{i}", COLOR, opacity=OPACITY, cast_shadow=False, receive_shadow=False
            )
            for i in range(BOXES)
        ]
        self.handles = {
            name: server.scene.add_transform_controls(
                f"/handle/{name}",
                HANDLE,
                active_axes=(False, True, False),
                line_width=6.0,
                disable_sliders=True,
                disable_rotations=True,
                depth_test=False,
            )
            for name in ("aside", "width")
        }

        # A coroutine is called in the order of what happens; a function would be by any of 32 threads.
        async def move(event: Any) -> None:
            self.drag("aside", float(event.target.position[1]))

        async def widen(event: Any) -> None:
            self.drag("width", float(event.target.position[1]))

        self.handles["aside"].on_update(move)
        self.handles["width"].on_update(widen)

    def drag(self, handle: str, y: float) -> None:
        """Take a handle, "aside" or "width", to a place along y, in metres."""
        if handle == "aside":
            self._change(aside=y)
        else:
            self._change(width=2 * abs(y - self._interaction.in_the_way.aside))

    def show(self) -> None:
        """Show the barrier as it stands now."""
        way, obstacle, scene = (
            self._interaction.in_the_way,
            self._interaction.obstacle,
            self._interaction.scene,
        )
        with self._server.atomic():
            for i, box in enumerate(self.boxes):
                box.visible = False
                if obstacle is None or i >= obstacle.low.shape[1]:
                    continue
                low, high = obstacle.low[0, i], obstacle.high[0, i]
                if (high > low).all():
                    box.position, box.dimensions, box.visible = (
                        tuple((low + high) / 2),
                        tuple(high - low),
                        True,
                    )
            x, top = scene.origin[0] + scene.barrier_x, scene.table_top + scene.height
            places = {"aside": (way.aside, ABOVE), "width": (way.aside + way.width / 2, -ABOVE)}
            for name, (y, above) in places.items():
                self.handles[name].visible = way.kind != NOTHING
                self.handles[name].position = (x, y, top + above)
