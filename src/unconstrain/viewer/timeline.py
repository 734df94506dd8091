"""The time line: play, pause, speed, and where the rollout is then."""

import threading
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from unconstrain.stopping import Movement

Array = NDArray[np.float64]

RATE = 25.0
"""Positions a second while it plays."""


class Timeline:
    """A time within the newest rollout, which goes on by itself while it plays.

    Parameters
    ----------
    moved : callable
        Is given the time in seconds and the state (n,) then, from a thread of the time line's while it plays.

    Attributes
    ----------
    time : float
        Seconds since the rollout's start.
    speed : float
        How many seconds of the rollout pass in one.
    """

    def __init__(self, moved: Callable[[float, Array], None]) -> None:
        self._moved = moved
        self._movement: Movement | None = None
        self._plays, self._closed = threading.Event(), False
        self.time, self.speed = 0.0, 1.0
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    @property
    def is_playing(self) -> bool:
        """Whether it goes on by itself."""
        return self._plays.is_set()

    @property
    def duration(self) -> float:
        """Seconds that the newest rollout lasts."""
        movement = self._movement
        return 0.0 if movement is None or movement.time is None else float(movement.time[-1])

    def set_movement(self, movement: Movement) -> None:
        """Take another rollout, at the same time within it."""
        self._movement = movement
        self.go_to(min(self.time, self.duration))

    def go_to(self, seconds: float) -> None:
        """Go to a time in seconds."""
        self.time = float(seconds)
        movement = self._movement
        if movement is None or movement.time is None:
            return
        k = int(np.searchsorted(movement.time, self.time - 1e-9))
        self._moved(self.time, movement.states[min(k, len(movement) - 1)])

    def play(self) -> None:
        """Go on from here, and from the start after the end."""
        self._plays.set()

    def pause(self) -> None:
        """Stay here."""
        self._plays.clear()

    def close(self) -> None:
        """End the thread."""
        self._closed = True
        self._plays.set()
        self._thread.join(timeout=2.0)

    def _run(self) -> None:
        before = time.monotonic()
        while not self._closed:
            if not self._plays.is_set():
                self._plays.wait()
                before = time.monotonic()
                continue
            now = time.monotonic()
            following = self.time + self.speed * (now - before)
            before = now
            self.go_to(following if following <= self.duration else 0.0)
            time.sleep(1.0 / RATE)
