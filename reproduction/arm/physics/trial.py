"""One data set of the arm in physics: three ways to learn it, and how ideal the physics was."""

from typing import Any

import numpy as np

from reproduction.arm.trial import make_candidates, make_local_models
from reproduction.plants import arm_dynamics
from reproduction.plants.arm import PowerPolicy
from reproduction.plants.arm_stage import GRIPPED, SERVO_GAIN, TABLE
from reproduction.scores import nupe_and_ncpe
from unconstrain.selection import select_policy

EPISODES, NEW_EPISODES = 50, 12
POWER, GAIN = 1.8, 0.5

NAMES = {GRIPPED: "hand gripped (1-2-3)", TABLE: "hand on a table"}
METHODS = ("direct", "inconsistency", "auto")
"""Ways to learn; the last is the model chosen by inconsistency."""

SETTINGS = {
    "episodes": EPISODES,
    "new episodes": NEW_EPISODES,
    "p": POWER,
    "gain": GAIN,
    "servo": SERVO_GAIN,
    "noise": arm_dynamics.ENCODER_NOISE,
    "window": arm_dynamics.WINDOW,
}
"""What the results depend on besides the seed."""

Result = dict[str, dict[str, Any]]
"""Numbers by scenario."""


def run_trial(scenarios: tuple[str, ...], seed: int, episodes: int = EPISODES) -> Result:
    """Learn one data set of each scenario, and measure errors and how ideal the physics was."""
    return {scenario: _run_scenario(scenario, seed, episodes) for scenario in scenarios}


def collect(results: list[Result], scenario: str, key: str) -> np.ndarray:
    """Return one number of all data sets, (trials,)."""
    return np.array([result[scenario][key] for result in results])


def _run_scenario(scenario: str, seed: int, episodes: int) -> dict[str, Any]:
    new = max(1, episodes * NEW_EPISODES // EPISODES)
    recording = arm_dynamics.demonstrate(
        scenario, PowerPolicy(POWER, GAIN), episodes + new, random_state=seed
    )
    everything = recording.demonstrations
    training = everything.select(everything.episodes < episodes)
    test = everything.select(everything.episodes >= episodes)
    X, U, groups = training.states, training.actions, training.episodes
    found = select_policy(make_candidates(), X, U, groups=groups)
    policies = {
        "direct": make_local_models("direct").fit(X, U, groups=groups),
        "inconsistency": found.policies["locally linear"],
        "auto": found.policy,
    }
    result: dict[str, Any] = {"chosen": found.name}
    for name, policy in policies.items():
        result |= {
            f"{name} {error}": value
            for error, value in nupe_and_ncpe(test, policy.predict(test.states)).items()
        }
    angle = np.degrees(recording.off_projection())
    away = np.sum((everything.actions - recording.ideal) ** 2) / np.sum(recording.ideal**2)
    if scenario == TABLE:
        forces = np.linalg.norm(recording.contact_force[recording.touching], axis=1)
        result["force, median"] = float(np.median(forces))
    return result | {
        "angle, median": float(np.nanmedian(angle)),
        "angle, 90 %": float(np.nanpercentile(angle, 90)),
        "off the projection": float(np.sqrt(away)),
        "touching": float(recording.touching.mean()),
    }
