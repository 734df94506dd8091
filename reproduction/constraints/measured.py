"""One data set of constraints that are measured: what knowing them is worth."""

from typing import Any

import numpy as np

from reproduction.arm.trial import make_candidates
from reproduction.constraints.trial import SETTINGS
from reproduction.grasp.trial import make_demonstrator, record_training
from reproduction.plants import arm, arm_dynamics, arm_stage
from reproduction.plants.robot_choice import OUR_OWN
from reproduction.scores import nupe
from unconstrain.constraints import from_forces
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
    "grasps": [GRASPS, GRASP_MODELS],
}
"""What the results depend on besides the seed."""


def run_measured(seed: int) -> dict[str, Any]:
    """Learn one data set of an arm on a table in physics, and one of ten grasps, with and without the constraints."""
    return {"arm": _run_arm(seed), "grasp": _run_grasp(seed)}


def _run_arm(seed: int) -> dict[str, Any]:
    """Measure nUPE on new starts, by inconsistency and with the constraints read off a noisy force sensor."""
    policy = arm.PowerPolicy(1.8, 0.5)
    recording = arm_dynamics.demonstrate(
        arm_stage.TABLE, policy, PHYSICS_EPISODES + PHYSICS_NEW, random_state=seed
    )
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
    learnt_from = D.episodes < PHYSICS_EPISODES
    train, test = D.select(learnt_from), D.select(~learnt_from)
    result: dict[str, Any] = {"unknown": float(np.mean(np.isnan(N[:, 0, 0])))}
    for name, known in (("inconsistency", None), ("forces", N[learnt_from])):
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


def _run_grasp(seed: int) -> dict[str, float]:
    """Measure nUPE on other movements after ten grasps, by inconsistency and with the true projections."""
    demonstrator, rng = make_demonstrator(OUR_OWN), np.random.default_rng(seed)
    train, test = (record_training(demonstrator, rng, GRASPS)[0].demonstrations for _ in range(2))
    result = {}
    for name, N in (("inconsistency", None), ("projections", train.projections)):
        policy = LocallyLinearPolicy(centers="kmeans", n_centers=GRASP_MODELS, alpha="cv")
        policy.fit(train.states, train.actions, groups=train.episodes, projections=N)
        result[name] = nupe(test, policy.predict(test.states))
    return result
