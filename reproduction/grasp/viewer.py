"""The grasp, to be watched and interfered with: a policy moves the robot while the barrier's gap is changed."""

import importlib
import os
import sys
import time

import numpy as np

from reproduction.grasp.figures import stage
from reproduction.plants.barrier import Barrier
from reproduction.plants.grasping import FREQUENCY, Demonstrator
from reproduction.plants.scene import show
from reproduction.plants.whole_body import WholeBody
from unconstrain.errors import UnconstrainError
from unconstrain.robots import import_mujoco
from unconstrain.simulation import Policy

STEP = 0.02
"""By which a key widens, narrows or moves the gap, in metres."""

START_WIDTH = 0.25
"""Of the gap, in metres: the mean of those learnt from."""

RIGHT, LEFT, DOWN, UP = 262, 263, 264, 265
"""GLFW's codes of the arrow keys."""

HELP = "arrows up and down: wider or narrower gap; left and right: move it; B: with or without barrier; R: start anew"


class Interaction:
    """A robot led by a policy over its hands' positions, and a barrier that can be changed at any time.

    Parameters
    ----------
    demonstrator : Demonstrator
        Whose robot and scene are shown.
    policy : object with ``predict(X)``, or callable ``X -> U``
        From hand positions (N, 6) to hand velocities (N, 6).
    random_state : int, Generator or None
        For the postures that `restart` draws.
    """

    def __init__(
        self, demonstrator: Demonstrator, policy: Policy, random_state: int | np.random.Generator | None = 0
    ):
        self.demonstrator = demonstrator
        self.policy = policy
        self.model = stage(demonstrator)
        self.body = WholeBody(demonstrator.humanoid, self.model)
        self.body.stand(demonstrator.humanoid.home)
        self.width, self.aside, self.barred = START_WIDTH, 0.0, True
        self._rng = np.random.default_rng(random_state)
        self._restart = False
        show(self.model, self.obstacle)

    @property
    def obstacle(self) -> Barrier | None:
        """The barrier as it stands now, or None."""
        return self.demonstrator.scene.with_gap([self.width], centre=self.aside) if self.barred else None

    def press(self, key: int) -> None:
        """React to a key, by GLFW's code. Others than those of `HELP` do nothing."""
        span = self.demonstrator.scene.span
        self.width = float(np.clip(self.width + STEP * ((key == UP) - (key == DOWN)), 0.0, span))
        self.aside = float(np.clip(self.aside + STEP * ((key == LEFT) - (key == RIGHT)), -span / 2, span / 2))
        self.barred ^= key == ord("B")
        self._restart |= key == ord("R")

    def step(self) -> None:
        """Move for one sample's time, under the barrier as it stands now."""
        if self._restart:
            self.body = self.demonstrator.draw_starts(1, self._rng, self.model)[0]
            self._restart = False
        show(self.model, self.obstacle)
        self.demonstrator.record(self.obstacle, [self.body], policy=self.policy, duration=1 / FREQUENCY)


def check_display() -> None:
    """Raise `UnconstrainError` where there is no display, before anything long is begun."""
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise UnconstrainError(
            "there is no display to open a window on: run this at a desktop, or make a video instead, "
            "python -m reproduction grasp --video grasp.mp4"
        )


def view(demonstrator: Demonstrator, policy: Policy) -> None:
    """Open MuJoCo's viewer with the policy in the loop, until its window is closed.

    Raises `UnconstrainError` where there is no display, or MuJoCo's viewer cannot run here.
    """
    check_display()
    mujoco = import_mujoco()
    interaction = Interaction(demonstrator, policy)
    shown = mujoco.MjData(interaction.model)
    try:
        viewer = importlib.import_module("mujoco.viewer")  # needs a window system already to be imported
        window = viewer.launch_passive(interaction.model, shown, key_callback=interaction.press)
    except (ImportError, RuntimeError) as error:
        raise UnconstrainError(
            f"MuJoCo's viewer cannot be opened here ({' '.join(str(error).split())}): on macOS start with "
            "mjpython, elsewhere check that OpenGL works"
        ) from error
    with window:
        window.cam.lookat, window.cam.distance = demonstrator.scene.origin, 1.8
        window.cam.azimuth, window.cam.elevation = 155.0, -24.0
        while window.is_running():
            begun = time.monotonic()
            with window.lock():
                interaction.step()
                shown.qpos = interaction.body.data.qpos
                mujoco.mj_forward(interaction.model, shown)
            window.sync()
            time.sleep(max(0.0, 1 / FREQUENCY - (time.monotonic() - begun)))
