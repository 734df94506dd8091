"""The grasp in the browser: the robot follows a policy in real time, and the barrier before it is dragged about."""

import threading
import time
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reproduction.grasp.drawn_barrier import DrawnBarrier
from reproduction.grasp.interaction import Interaction
from reproduction.grasp.panel import Panel
from reproduction.grasp.ways import Ways
from reproduction.plants.grasping import FREQUENCY, Demonstrator
from reproduction.plants.scene import BOXES
from unconstrain.simulation import Policy
from unconstrain.viewer import RobotScene, server

SHOWN_RATE = 25.0
"""Pictures a second."""

LATE = 0.2
"""Seconds that are made up for; of more the page says that it is slower than real time."""

TOP, BOTTOM, SKY_ROWS = (203, 214, 226), (245, 248, 252), 128
"""Colours of the sky, and how many rows it has between them."""

REST, RESTING = 0.02, 1.5
"""Hands slower than this (m/s) for so many seconds rest."""


class GraspPage:
    """A page with the robot, the barrier and what changes them.

    Parameters
    ----------
    demonstrator : Demonstrator
        Whose robot and scene are shown.
    policies : mapping from str to policy
        Over both hands' positions, by name; the first leads at first.
    host : str
        The address to listen at.
    port : int
        The port, 0 for any that is free.
    random_state : int, Generator or None
        For where the robot starts anew.

    Attributes
    ----------
    interaction : Interaction
        The robot, and what is in its way.
    server : viser.ViserServer
        Of the page.
    rate : float
        Steps a second, of the last second; `FREQUENCY` is real time.
    """

    def __init__(
        self,
        demonstrator: Demonstrator,
        policies: Mapping[str, Policy],
        *,
        host: str = server.HOST,
        port: int = server.PORT,
        random_state: int | np.random.Generator | None = 0,
    ):
        self.interaction = Interaction(demonstrator, policies, random_state)
        self.server = server.start(host, port)
        self.server.gui.set_panel_label("the grasp")
        self.rate, self.is_paused, self.starts_anew = 0.0, False, True
        self._closed, self._restart, self._changed = threading.Event(), threading.Event(), threading.Event()
        self._furnish()
        drawn_here = tuple(f"barrier{i}" for i in range(BOXES))
        self.robot = RobotScene(self.server, self.interaction.model, leave_out=drawn_here)
        self.ways = Ways(self.server)
        self.barrier = DrawnBarrier(self.server, self.interaction, self.change)
        self.panel = Panel(self)
        self.change()

    @property
    def url(self) -> str:
        """Where the page is."""
        host = self.server.get_host()
        return f"http://{'localhost' if host in ('127.0.0.1', '0.0.0.0') else host}:{self.server.get_port()}"

    def change(self, **changes: Any) -> None:
        """Change what is in the way, as `Interaction.change` does, and show it."""
        way = self.interaction.change(**changes)
        self.barrier.show()
        self.panel.show_obstacle(way)
        self._changed.set()

    def lead(self, name: str) -> None:
        """Let another of the policies lead, by name."""
        self.interaction.policy = name
        self._changed.set()

    def restart(self) -> None:
        """Let the robot stand in another posture before the next step."""
        self._restart.set()

    def wait(self) -> None:
        """Move the robot until the page is closed, or Ctrl-C is pressed, which closes it."""
        try:
            self.run()
        except KeyboardInterrupt:
            self.close()

    def run(self, seconds: float = np.inf) -> None:
        """Move the robot for some seconds, at the pace of its own time if this computer can.

        Parameters
        ----------
        seconds : float
            Of this computer's clock.
        """
        begun = due = counted = time.monotonic()
        shown, steps, rested = begun - 1.0, 0, 0.0
        while not self._closed.is_set() and time.monotonic() - begun < seconds:
            now = time.monotonic()
            if self._restart.is_set() or (self.starts_anew and rested > RESTING):
                self._begin_anew()
                rested, due = 0.0, time.monotonic()
            if self.is_paused:
                due, counted, steps = now + 1 / FREQUENCY, now, 0
            elif now >= due:
                rested = rested + 1 / FREQUENCY if self.interaction.step() < REST else 0.0
                self.ways.go(self.interaction.body.hands)
                steps += 1
                due = max(due + 1 / FREQUENCY, now - LATE)
            if now - shown >= 1 / SHOWN_RATE:
                shown = now
                self._show()
            if now - counted >= 1.0:
                self.rate, steps, counted = steps / (now - counted), 0, now
                self.panel.show_state(self)
            time.sleep(max(0.0, min(due, shown + 1 / SHOWN_RATE) - time.monotonic()))

    def close(self) -> None:
        """End the loop and the server."""
        if not self._closed.is_set():
            self._closed.set()
            server.stop(self.server)

    def _begin_anew(self) -> None:
        self._restart.clear()
        self.interaction.restart()
        self.ways.begin()
        self._changed.set()

    def _show(self) -> None:
        if self._changed.is_set():
            self._changed.clear()
            self.ways.show_foreseen(*self.interaction.foresee())
        with self.server.atomic():
            self.robot.show(self.interaction.body.data.qpos)
            self.ways.show_gone()

    def _furnish(self) -> None:
        """Put the camera before the robot, and a sky behind it: what is white would not be seen on white."""
        scene: Any = self.server.scene
        camera: Any = self.server.initial_camera
        x, y, z = self.interaction.scene.origin
        scene.set_up_direction("+z")
        camera.look_at = (x, y + 0.2, z)
        camera.position = (x + 1.65, y + 0.75, z + 0.75)
        camera.fov = 0.75
        scene.set_background_image(_sky(), format="png")
        scene.add_light_ambient("/light/everywhere", intensity=1.7)
        scene.add_light_directional("/light/front", intensity=2.0, position=(1.2, 1.6, 3.0))


def _sky() -> NDArray[np.uint8]:
    height = np.linspace(0.0, 1.0, SKY_ROWS)[:, None]
    colors = TOP + height * (np.array(BOTTOM) - TOP)
    return np.broadcast_to(colors[:, None], (SKY_ROWS, 2, 3)).round().astype(np.uint8)
