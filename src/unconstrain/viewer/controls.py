"""What is shown, by checkboxes and dropdowns; and the time line, obstacles and files."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from unconstrain.spaces import SecondOrder
from unconstrain.viewer import exporting, field, legend, obstacles
from unconstrain.viewer.coordinates import Picked
from unconstrain.viewer.legend import ANYWHERE

if TYPE_CHECKING:
    from unconstrain.viewer.page import Page

SPEEDS = ("0.25", "0.5", "1", "2", "4")
NONE = "(none)"
MOST_SLIDERS = 12
RENDERED = (1200, 1600)
"""Height and width of a picture, in pixels."""


class Controls:
    """The panel of the page.

    Parameters
    ----------
    page : Page
        What it controls.
    """

    def __init__(self, page: "Page") -> None:
        self.page = page
        gui = page.stage.server.gui
        self.gui = gui
        self.colours = gui.add_html(legend.describe_colours(page.stage))
        self.notes = gui.add_html(legend.describe_notes(page.notes), visible=bool(page.notes))
        self._add_what_is_shown()
        self._add_rollout()
        self._add_others()
        self._add_files()

    def _add_what_is_shown(self) -> None:
        page, gui, stage = self.page, self.gui, self.page.stage
        with gui.add_folder("Shown"):
            if len(stage.policies) > 1:
                self.policy = gui.add_dropdown("Policy", tuple(stage.policies), initial_value=stage.name)
                self._react(self.policy, lambda event: page.show_policy(self.policy.value))
            self.movements = gui.add_checkbox("Movements", True)
            self._react(self.movements, lambda event: page.movements.show(self.movements.value))
            self.arrows = gui.add_checkbox("Field: arrows", page.field.shows_arrows)
            # Accelerations would need a velocity at every place.
            self.arrows.visible = not isinstance(stage.policy.space_, SecondOrder)
            self.streams = gui.add_checkbox("Field: stream lines", page.field.shows_streams)
            for box in (self.arrows, self.streams):
                self._react(box, lambda event: page.show_field(self.arrows.value, self.streams.value))
            self.unknown = gui.add_checkbox("What is not determined", False)
            self._react(self.unknown, lambda event: page.show_diagnosis(self.unknown.value))
            self.diagnosis = gui.add_html("", visible=False)
            if isinstance(stage.coordinates, Picked) and len(stage.axes.names) > 1:
                self._add_axes()

    def _add_axes(self) -> None:
        page, gui, names = self.page, self.gui, self.page.stage.axes.names
        which = self.page.stage.coordinates.which  # type: ignore[attr-defined]
        options = (tuple(names), tuple(names), (NONE, *names))
        chosen = [names[each] for each in which] + [NONE] * (3 - len(which))
        self.axes: list[Any] = []
        if len(names) == 2:
            return
        self.axes = [
            gui.add_dropdown(label, each, initial_value=initial)
            for label, each, initial in zip(("Across", "Upwards", "Third"), options, chosen, strict=True)
        ]

        def pick(event: Any) -> None:
            picked = [names.index(each.value) for each in self.axes if each.value != NONE]
            # While all three are set one after the other, two may be the same for a moment.
            if event.client is not None and len(set(picked)) == len(picked):
                page.show_coordinates(picked)

        for each in self.axes:
            self._react(each, pick)
        self.through = gui.add_dropdown("Arrows at", (field.RECORDED, field.HELD))
        self._react(self.through, lambda event: page.show_through(self.through.value))

    def _add_rollout(self) -> None:
        page, gui = self.page, self.gui
        with gui.add_folder("Rollout"):
            self.seconds = gui.add_slider("Lasts (s)", *_range(page.stage.seconds), page.stage.seconds)
            self._react(self.seconds, lambda event: page.set_seconds(_within(self.seconds)))
            self.obstacles = gui.add_dropdown(
                "In its way", (obstacles.NOTHING, obstacles.PLANE, obstacles.BOX, obstacles.BOTH)
            )
            # A barrier takes away velocity, and the actions of these are accelerations.
            self.obstacles.visible = not isinstance(page.stage.policy.space_, SecondOrder)
            self._react(self.obstacles, lambda event: page.put_in_the_way(self.obstacles.value))
            side = page.obstacles.side_in_units(page.stage)
            self.side = gui.add_slider("Box side", *_range(side), side, visible=False)
            self._react(self.side, lambda event: page.resize_box(_within(self.side)))
            if page.stage.under is not None:
                self.under = gui.add_checkbox("Under the given constraint", True)
                self._react(self.under, lambda event: page.follow_under(self.under.value))
            self.anywhere = gui.add_checkbox(ANYWHERE, False)
            self._react(self.anywhere, lambda event: page.lead_anywhere(self.anywhere.value))
            self.time = gui.add_slider("Time (s)", 0.0, page.stage.seconds, page.stage.seconds / 200.0, 0.0)
            self._react(self.time, self._sought)
            self.play = gui.add_button_group("Play", ("play", "pause", "to start"))
            self._react(self.play, lambda event: page.control_time(event.target.value))
            self.speed = gui.add_dropdown("Speed", SPEEDS, initial_value="1")
            self._react(self.speed, lambda event: setattr(page.timeline, "speed", float(self.speed.value)))
            self.ending = gui.add_html("")

    def show_axes(self, which: list[int]) -> None:
        """Show which numbers are shown."""
        names = [self.page.stage.axes.names[each] for each in which]
        for dropdown, name in zip(self.axes, [*names, NONE], strict=False):
            dropdown.value = name

    def show_seconds(self, seconds: float) -> None:
        """Let the slider of the time end where rollouts do, and show how long that is."""
        self.seconds.max = max(self.seconds.max, seconds)
        self.seconds.value = seconds
        self.time.max = seconds
        self.time.value = min(self.time.value, seconds)

    def show_side(self, side: float) -> None:
        """Show how long the box is, in the units of what is shown."""
        self.side.min, self.side.max, self.side.step = _range(side)
        self.side.value = side

    def _sought(self, event: Any) -> None:
        if event.client is not None:  # not when the time line itself moved it
            self.page.timeline.go_to(_within(self.time))

    def _add_others(self) -> None:
        """Add a slider for each number that is not shown, by which the start is moved along it."""
        stage = self.page.stage
        self.others: list[Any] = []
        if not isinstance(stage.coordinates, Picked) or len(stage.axes.names) < 3:
            return
        values, start = stage.axes.values(stage.states), stage.axes.values(stage.start[None])[0]
        with self.gui.add_folder("Start, along the others", expand_by_default=False):
            for k, name in list(enumerate(stage.axes.names))[:MOST_SLIDERS]:
                low, high = float(values[:, k].min()), float(values[:, k].max())
                step = max((high - low) / 200.0, 1e-9)
                slider = self.gui.add_slider(
                    name, low, max(high, low + step), step, float(np.clip(start[k], low, high))
                )
                slider.visible = k not in stage.coordinates.which
                self._react(slider, partial(self._moved, k, slider))
                self.others.append(slider)

    def _moved(self, k: int, slider: Any, event: Any) -> None:
        if event.client is not None:
            self.page.move_start(k, _within(slider))

    def _add_files(self) -> None:
        gui = self.gui
        with gui.add_folder("Save", expand_by_default=False):
            self.png, self.svg = gui.add_button("Picture (PNG)"), gui.add_button("Picture (SVG)")
            self.csv = gui.add_button("Rollout (CSV)")
        self._react(self.png, self._save_png)
        self._react(self.svg, self._save_svg)
        self._react(self.csv, self._save_csv)

    def _save_png(self, event: Any) -> None:
        render = event.client.get_render(*RENDERED, transport_format="png", timeout=60.0)
        self._send(event.client, "view.png", exporting.png(render))

    def _save_svg(self, event: Any) -> None:
        self._send(event.client, "view.svg", self.page.draw_svg())

    def _save_csv(self, event: Any) -> None:
        if self.page.stage.movement is not None:
            self._send(event.client, "rollout.csv", exporting.csv(self.page.stage.movement))

    def _send(self, client: Any, name: str, content: bytes) -> None:
        if self._is_there(client):
            client.send_file_download(name, content, save_immediately=True)

    def _is_there(self, client: Any) -> bool:
        """Say whether a browser has not been closed meanwhile."""
        return client.client_id in self.page.stage.server.get_clients()

    def _react(self, control: Any, react: Callable[[Any], None]) -> None:
        """Call a function when a control is used. What it raises is said on the page, not in the terminal."""

        def guarded(event: Any) -> None:
            try:
                react(event)
            except Exception as error:  # the page goes on
                if event.client is None or self._is_there(event.client):
                    self.page.report(error)

        (control.on_click if hasattr(control, "on_click") else control.on_update)(guarded)


def _within(slider: Any) -> float:
    """Return the number of a slider within its range, which a number that is typed need not be in."""
    return float(np.clip(slider.value, slider.min, slider.max))


def _range(usual: float) -> tuple[float, float, float]:
    """Return the least, the largest and the step of a slider around a usual number."""
    return usual / 40.0, 4.0 * usual, usual / 40.0
