"""What the regressors learn from: the limit cycle, the arm and ten grasps, with the true policy and projections."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from reproduction.adaptive.simulated import draw_noise, name_cycle_cell, name_noise
from reproduction.adaptive.ways import add_noise
from reproduction.arm.trial import Recordings
from reproduction.constraints import measured
from unconstrain import demo
from unconstrain.demonstrations import Demonstrations
from unconstrain.limit_cycle import demonstrate

FREE = (0.0, 0.4, 1.0)
"""Share of free thirds of movements around the limit cycle."""

NOISE = 0.03
"""Of the rms action, in all components of it."""

POWER, CONSTRAINTS, ARM_EPISODES = 1.8, ("1-2-3", "2-4-6"), 100
"""Of the arm of Table I, as many movements as there."""


class Problem(NamedTuple):
    """A data set with noise to learn from, and one without to test on; both have the true policy and projections."""

    training: Demonstrations
    test: Demonstrations


Draw = Callable[[int], Problem]
"""From the number of a data set to it."""


def draw_cycle(free: float, noise: float, seed: int) -> Problem:
    """Simulate 40 movements around the limit cycle, and 40 others."""
    clean, test = (
        demonstrate(demo.MOVEMENTS, free=free, random_state=np.random.default_rng([seed, k])) for k in (0, 1)
    )
    return Problem(add_noise(clean, noise, draw_noise(seed))[0], test)


def draw_arm(constraint: str, seed: int) -> Problem:
    """Simulate the arm of Table I; the test is held-out samples of the same movements, as there."""
    recordings = Recordings.simulate(POWER, constraint, seed, ARM_EPISODES)
    return Problem(add_noise(recordings.training, NOISE, draw_noise(seed))[0], recordings.test)


def draw_grasps(seed: int) -> Problem:
    """Record ten grasps, and ten others."""
    clean, test = measured.record_grasps(seed)
    return Problem(add_noise(clean, NOISE, draw_noise(seed))[0], test)


PLANTS: dict[str, dict[str, Draw]] = {
    "cycle": {
        name_cycle_cell(free, noise): partial(draw_cycle, free, noise)
        for free in FREE
        for noise in (0.0, NOISE)
    },
    "arm": {f"{rows}, {name_noise(NOISE)}": partial(draw_arm, rows) for rows in CONSTRAINTS},
    "grasp": {name_noise(NOISE): draw_grasps},
}
"""By plant and by row of its table."""

TITLES = {
    "cycle": "Limit cycle, 40 movements",
    "arm": f"7-DOF arm, p = {POWER:g}, {ARM_EPISODES} movements",
    "grasp": f"{measured.GRASPS} grasps, both hands (6-D)",
}
