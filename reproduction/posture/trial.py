"""One data set of the posture: a linear policy learnt from movements with a wall in the way."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reproduction.plants.posture import demonstrate
from reproduction.plants.robot_choice import OUR_OWN, RobotChoice
from reproduction.scores import nupe_and_ncpe
from unconstrain.demonstrations import Demonstrations
from unconstrain.policies import ParametricPolicy

RISKS = ("inconsistency", "direct")

HELD_OUT = 0.2
"""Movements made for the test alone, as a share of those to learn from."""


def record(
    seed: int, choice: RobotChoice = OUR_OWN, n_episodes: int = 100, length: int = 100
) -> tuple[Demonstrations, Demonstrations, NDArray[np.bool_]]:
    """Record movements to learn from, others to test on, and at which samples of the first the wall blocks a hand."""
    held_out = max(1, round(HELD_OUT * n_episodes))
    everything, blocked = demonstrate(choice.load(), n_episodes + held_out, length, random_state=seed)
    learnt_from = everything.episodes < n_episodes
    return everything.select(learnt_from), everything.select(~learnt_from), blocked[learnt_from]


def run_trial(
    seed: int,
    choice: RobotChoice = OUR_OWN,
    n_episodes: int = 100,
    length: int = 100,
    risks: Sequence[str] = RISKS,
) -> dict[str, Any]:
    """Learn one data set; normalised errors on movements that were not learnt from, and what the wall did."""
    train, test, blocked = record(seed, choice, n_episodes, length)
    result: dict[str, Any] = {}
    for risk in risks:
        policy = ParametricPolicy(risk=risk, alpha="cv")
        policy.fit(train.states, train.actions, groups=train.episodes)
        result[risk] = nupe_and_ncpe(test, policy.predict(test.states))
    blocked = blocked.reshape(n_episodes, length)
    result["samples the wall blocks"] = float(blocked.mean())
    result["movements that meet the wall"] = float(blocked.any(axis=1).mean())
    return result


def collect(results: list[dict[str, Any]], risk: str, error: str) -> NDArray[np.float64]:
    """Return one error of all data sets, (trials,)."""
    return np.array([result[risk][error] for result in results])
