"""The straight line to the goal, which needs no recording: what a plant's paths say little against."""

from dataclasses import dataclass

import numpy as np

from benchmarks.rivals.learnt import Array, Recorded, Velocity


@dataclass(frozen=True)
class Line:
    """It has no action for a state, only a path from each start."""

    goal: Array
    velocity: Velocity | None = None

    def follow(self, starts: Array, duration: float, dt: float) -> Array:
        """Go there at an even speed."""
        share = np.linspace(0.0, 1.0, round(duration / dt) + 1)[None, :, None]
        return np.asarray(starts[:, None] + share * (self.goal - starts[:, None]))


def learn(recorded: Recorded, _: None) -> Line | None:
    """Learn nothing; None where there is no goal."""
    return None if recorded.goal is None else Line(recorded.goal)
