"""The closed form: the inconsistency corrected for noise, where samples are constrained, and where they are not."""

from pathlib import Path

import numpy as np

from reproduction.adaptive.settings import Part, Result
from reproduction.adaptive.simulated import MANY, draw_noise, name_cycle_cell, name_noise
from reproduction.adaptive.ways import CORRECTED, DIRECT, INCONSISTENCY, TOLD, compare_ways
from reproduction.arm.trial import EPISODES, SETTINGS, Recordings
from unconstrain import demo
from unconstrain.features import DecoupledFeatures
from unconstrain.limit_cycle import demonstrate
from unconstrain.policies import ParametricPolicy

MOVEMENTS = (demo.MOVEMENTS, MANY)
CYCLE_NOISE, ARM_NOISE = (0.0, 0.05, 0.1, 0.2), (0.02, 0.05, 0.1)
SOME_FREE, THEIR_NOISE = (0.5, 1.0), 0.05
"""Shares of free segments beside none, and the noise there."""

POWER, CONSTRAINTS = 2.0, ("2-4-6", "1-2-3")
"""The arm's policy is linear in its posture."""

KNOTS = 15


def run_closed(
    ways: tuple[str, ...],
    folder: Path | None,
    seed: int,
    movements: tuple[int, ...] = MOVEMENTS,
    episodes: int = EPISODES,
) -> Result:
    """Learn the limit cycle, and the arm with linear and with decoupled features."""
    result: Result = {}
    for number in movements:
        for free in (0.0, *SOME_FREE):
            clean = demonstrate(number, free=free, random_state=np.random.default_rng([seed, 0]))
            test = demonstrate(demo.MOVEMENTS, free=free, random_state=np.random.default_rng([seed, 1]))
            for noise in CYCLE_NOISE if free == 0.0 else (THEIR_NOISE,):
                name = f"limit cycle, {number} movements, {name_cycle_cell(free, noise)}"
                result[name] = compare_ways(demo.make_policy(), ways, clean, test, noise, draw_noise(seed))
    for constraint in CONSTRAINTS:
        recordings = Recordings.simulate(POWER, constraint, seed, episodes)
        for model, policy in make_models().items():
            for noise in ARM_NOISE:
                name = f"arm, {constraint}, {model}, {name_noise(noise)}"
                result[name] = compare_ways(
                    policy, ways, recordings.training, recordings.test, noise, draw_noise(seed)
                )
    return result


def make_models() -> dict[str, ParametricPolicy]:
    """Make the models of the arm, by name."""
    return {"linear": ParametricPolicy(), "decoupled": ParametricPolicy(DecoupledFeatures(KNOTS))}


CLOSED = {
    "closed": Part(
        title="The closed form, in one pass",
        measure="nUPE on held-out samples",
        run=run_closed,
        settings={
            **SETTINGS,
            "movements": MOVEMENTS,
            "cycle": CYCLE_NOISE,
            "free": [SOME_FREE, THEIR_NOISE],
            "arm": [POWER, CONSTRAINTS, ARM_NOISE, KNOTS],
        },
        ways=(DIRECT, INCONSISTENCY, CORRECTED, TOLD),
    )
}
"""The part of risk "corrected"."""
