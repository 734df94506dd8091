"""One data set of constraints that are measured: what knowing them is worth."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reproduction.arm.trial import make_candidates
from reproduction.constraints.trial import SETTINGS
from reproduction.grasp.trial import make_demonstrator, record_training
from reproduction.plants import arm, arm_dynamics, arm_stage
from reproduction.plants.robot_choice import OUR_OWN
from reproduction.scores import nupe
from unconstrain.constraints import from_forces
from unconstrain.demonstrations import Demonstrations
from unconstrain.policies import LocallyLinearPolicy
from unconstrain.selection import select_policy

SENSOR_NOISE, THRESHOLD, MARGIN = 0.5, 4.0, 5
"""Of the force sensor in physics: newtons, newtons, and samples: half the window of differentiation (0.2 s, 50 Hz)."""

PHYSICS_EPISODES, PHYSICS_NEW = 50, 12
"""Movements of the arm in physics to learn from, and to test on."""

GRASPS, GRASP_MODELS = 10, 8
"""Movements of the humanoid to learn from and to test on, and local models."""

MEASURED_SETTINGS = SETTINGS | {
    "sensor": [SENSOR_NOISE, THRESHOLD, MARGIN],
    "grasps": [GRASPS, GRASP_MODELS, "inconsistency"],
}
"""What the results depend on besides the seed."""


def run_measured(seed: int) -> dict[str, Any]:
    """Learn one data set of an arm on a table in physics, and one of ten grasps, with and without the constraints."""
    return {"arm": _run_arm(seed), "grasp": _run_grasp(seed)}


@dataclass(frozen=True)
class Sliding:
    """Movements of the arm in physics over tables, and what a force sensor says of the constraints.

    Attributes
    ----------
    train, test : Demonstrations
        Recorded; movements to learn from, and others from new starts.
    known : ndarray of shape (N, 7, 7)
        Projections of the samples learnt from, read off the sensor; NaN around landings.
    ideal : ndarray of shape (N, 7)
        The actions `N π` of the ideal constraint at the samples learnt from.
    unknown : float
        Share of the samples, those to test on among them, whose projection the sensor leaves unknown.
    """

    train: Demonstrations
    test: Demonstrations
    known: NDArray[np.float64]
    ideal: NDArray[np.float64]
    unknown: float


def record_sliding(seed: int, episodes: int = PHYSICS_EPISODES, new: int = PHYSICS_NEW) -> Sliding:
    """Record a data set of the arm sliding on tables, with a noisy force sensor."""
    policy = arm.PowerPolicy(1.8, 0.5)
    recording = arm_dynamics.demonstrate(arm_stage.TABLE, policy, episodes + new, random_state=seed)
    D, rng = recording.demonstrations, np.random.default_rng([seed, 3])
    forces = recording.contact_force + SENSOR_NOISE * rng.normal(size=recording.contact_force.shape)
    robot = arm_stage.stage(arm_stage.TABLE)
    N = from_forces(
        forces,
        THRESHOLD,
        actions=D.actions,
        jacobian=robot.jacobian(D.states, arm_stage.TIP)[:, :3],
        margin=MARGIN,
        episodes=D.episodes,
    )
    learnt_from = D.episodes < episodes
    return Sliding(
        D.select(learnt_from),
        D.select(~learnt_from),
        N[learnt_from],
        recording.ideal[learnt_from],
        unknown=float(np.mean(np.isnan(N[:, 0, 0]))),
    )


def _run_arm(seed: int) -> dict[str, Any]:
    """Measure nUPE on new starts, by inconsistency and with the constraints read off a noisy force sensor."""
    recorded = record_sliding(seed)
    train, test = recorded.train, recorded.test
    result: dict[str, Any] = {"unknown": recorded.unknown}
    for name, known in (("inconsistency", None), ("forces", recorded.known)):
        found = select_policy(
            make_candidates(),
            train.states,
            train.actions,
            groups=train.episodes,
            projections=known,
        )
        result[f"{name}, chosen"] = found.name
        result[name] = nupe(test, found.policy.predict(test.states))
        local = found.policies["locally linear"]
        result[f"{name}, local models"] = nupe(test, local.predict(test.states))
    return result


def record_grasps(seed: int, grasps: int = GRASPS) -> tuple[Demonstrations, Demonstrations]:
    """Record ten grasps of the humanoid to learn from, and ten others to test on."""
    demonstrator, rng = make_demonstrator(OUR_OWN), np.random.default_rng(seed)
    train, test = (record_training(demonstrator, rng, grasps)[0].demonstrations for _ in range(2))
    return train, test


def make_grasp_model() -> LocallyLinearPolicy:
    """Make the few local models that ten grasps suffice for, fitted by inconsistency."""
    return LocallyLinearPolicy(centers="kmeans", n_centers=GRASP_MODELS, risk="inconsistency", alpha="cv")


def _run_grasp(seed: int) -> dict[str, float]:
    """Measure nUPE on other movements after ten grasps, by inconsistency and with the true projections."""
    train, test = record_grasps(seed)
    result = {}
    for name, N in (("inconsistency", None), ("projections", train.projections)):
        policy = make_grasp_model()
        policy.fit(train.states, train.actions, groups=train.episodes, projections=N)
        result[name] = nupe(test, policy.predict(test.states))
    return result
