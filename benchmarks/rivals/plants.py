"""Simulated recordings whose policy is known, and what is measured on them."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.spatial.distance import cdist

from benchmarks.rivals.learnt import Array, Field, Learnt, Recorded, Velocity
from reproduction import scores
from reproduction.arm.trial import make_local_models
from reproduction.constraints.measured import make_grasp_model
from reproduction.grasp.trial import make_demonstrator
from reproduction.plants import arm
from reproduction.plants.grasping import DURATION, FREQUENCY
from reproduction.plants.robot_choice import OUR_OWN
from reproduction.regressors import problems
from unconstrain import demo
from unconstrain.demonstrations import Demonstrations
from unconstrain.limit_cycle import LimitCycle

NOISE = 0.05
"""Of recorded actions around the limit cycle, as a share of their root mean square; 3 % elsewhere."""

ARM_STARTS = 20
"""New starts that free movements of the arm are compared from."""


class Plant(NamedTuple):
    """A data set, and what is learnt from it is measured by.

    Attributes
    ----------
    recorded : Recorded
        To learn from.
    test : Demonstrations
        Without noise, with the true policy.
    policy : callable
        The true policy.
    starts : ndarray of shape (S, n)
        Of free movements.
    duration, dt : float
        Of these, and of a step, in the unit of time of the plant.
    """

    recorded: Recorded
    test: Demonstrations
    policy: Velocity
    starts: Array
    duration: float
    dt: float


class Errors(NamedTuple):
    """nUPE and nCPE at held-out states, and how far free movements are off; NaN where it does not apply."""

    nupe: float
    ncpe: float
    path: float


def draw_cycle(free: float, seed: int) -> Plant:
    """Draw 40 movements around the limit cycle, and 40 others."""
    training, test = problems.draw_cycle(free, NOISE, seed)
    recorded = Recorded(training, None, demo.make_policy)
    return Plant(recorded, test, LimitCycle(), first_states(test), 0.8, 0.02)


def draw_arm(rows: str, seed: int) -> Plant:
    """Draw 100 movements of the arm, its hand constrained; the test is held-out samples of them."""
    training, test = problems.draw_arm(rows, seed)
    recorded = Recorded(training, np.zeros(arm.JOINTS), make_local_models)
    starts = arm.draw_starts(ARM_STARTS, np.random.default_rng([seed, 9]))
    return Plant(recorded, test, arm.PowerPolicy(problems.POWER), starts, 99.0, 1.0)


def draw_grasps(seed: int) -> Plant:
    """Draw ten grasps past barriers, and ten others."""
    training, test = problems.draw_grasps(seed)
    expert = make_demonstrator(OUR_OWN).policy
    recorded = Recorded(training, expert.target, make_grasp_model)
    return Plant(recorded, test, expert, first_states(test), DURATION, 1 / FREQUENCY)


PLANTS: dict[str, Callable[[int], Plant]] = {
    **{f"limit cycle, {free:.0%} free": partial(draw_cycle, free) for free in (0.0, 0.5, 1.0)},
    **{f"arm, rows {rows} fixed": partial(draw_arm, rows) for rows in problems.CONSTRAINTS},
    "ten grasps": draw_grasps,
}
"""By row of the tables, from the number of a data set to it."""


def first_states(demos: Demonstrations) -> Array:
    """Return the state that each episode begins in."""
    return demos.states[np.unique(demos.episodes, return_index=True)[1]]


def measure(learnt: Learnt, plant: Plant) -> Errors:
    """Measure errors of the action at held-out states, and of free movements."""
    shown = Field(plant.policy).follow(plant.starts, plant.duration, plant.dt)
    path = compare_paths(learnt.follow(plant.starts, plant.duration, plant.dt), shown)
    if learnt.velocity is None:
        return Errors(np.nan, np.nan, path)
    P = learnt.velocity(plant.test.states)
    return Errors(scores.nupe(plant.test, P), scores.ncpe(plant.test, P), path)


def compare_paths(paths: Array, shown: Array) -> float:
    """Measure how far paths (S, T, n) lie from those that are right, whatever their speed.

    The mean distance of the points of each to the nearest of the other, over both, as a share of how far the right ones
    lead from their starts (root mean square over starts).
    """
    apart = [cdist(a, b) for a, b in zip(paths, shown, strict=True)]
    off = [0.5 * (np.mean(each.min(axis=0)) + np.mean(each.min(axis=1))) for each in apart]
    led = np.sqrt(np.mean(np.sum((shown[:, -1] - shown[:, 0]) ** 2, axis=1)))
    return float(np.mean(off) / led)
