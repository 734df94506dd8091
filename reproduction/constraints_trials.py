"""One data set of constraints to be learnt, in each setting where the truth is known; and of constraints measured."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone

from reproduction.errors import nupe
from reproduction.plants import arm
from reproduction.plants.planar import PlanarArm
from unconstrain import limit_cycle as toy
from unconstrain import metrics as risk
from unconstrain.constraints import from_forces, projection
from unconstrain.constraints.learnt import (
    ConstantConstraint,
    ConstraintChain,
    FeatureConstraint,
    NullspaceComponent,
)
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import UnconstrainError
from unconstrain.policies import LocallyLinearPolicy, ParametricPolicy
from unconstrain.selection import select_policy

Array = NDArray[np.float64]

EPISODES, LENGTH, STEP = 40, 40, 0.02
ARM_EPISODES, ARM_LENGTH = 20, 50
NOISE = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2)
"""Standard deviation of noise on the actions, as a share of their root mean square."""
KINDS = ("1-2-3", "4-5-6", "1-3-5", "2-4-6")
SWEPT = ("constant, linear", "parabola, limit cycle", "3-link arm, x and y", "7-DOF arm, 1-2-3")

CONDITIONS = 5
"""Different constraints in the data of the chain."""

SENSOR_NOISE, THRESHOLD, MARGIN = 0.5, 4.0, 5
"""Of the force sensor in physics: newtons, newtons, and samples: half the window of differentiation (0.2 s, 50 Hz)."""
PHYSICS_EPISODES, PHYSICS_NEW = 50, 12
GRASPS, GRASP_MODELS = 10, 8

Policy = Callable[[Array], Array]


@dataclass(frozen=True)
class Setting:
    """A policy, constraint rows, and the estimator that can hold the rows."""

    policy: Policy
    rows: Callable[[Array], Array]
    estimator: Any
    starts: Array
    length: int = LENGTH
    step: float = STEP

    def record(self) -> Demonstrations:
        """Movements ``x ← x + step N π`` from all starts."""
        x, n = self.starts, len(self.starts)
        kept: list[list[Array]] = [[], [], [], []]
        for _ in range(self.length):
            N, Pi = projection(self.rows(x)), self.policy(x)
            U = np.einsum("nij,nj->ni", N, Pi)
            for values, value in zip(kept, (x, Pi, U, N), strict=True):
                values.append(value)
            x = x + self.step * U
        states, policy, actions, projections = (np.concatenate(values) for values in kept)
        episodes = np.tile(np.arange(n), self.length)
        return Demonstrations(states, actions, episodes, policy=policy, projections=projections)


def settings(seed: int) -> dict[str, Setting]:
    """All settings of data set number `seed`, by name."""
    rng = np.random.default_rng(seed)
    W, target = _stable(rng, 2), rng.uniform(-0.5, 0.5, 2)

    def linear(X: Array) -> Array:
        return (X - target) @ W.T

    starts = rng.uniform(-1, 1, (EPISODES, 2))
    row, a = rng.normal(size=(1, 2)), float(rng.uniform(0.2, 2.0) * rng.choice([-1, 1]))

    def constant(X: Array) -> Array:
        return np.broadcast_to(row, (len(X), 1, 2))

    def parabola(X: Array) -> Array:
        return np.stack([-2 * a * X[:, 0], np.ones(len(X))], axis=1)[:, None]

    found: dict[str, Setting] = {}
    for name, policy in (("linear", linear), ("limit cycle", toy.LimitCycle())):
        found[f"constant, {name}"] = Setting(policy, constant, ConstantConstraint(), starts)
        found[f"parabola, {name}"] = Setting(policy, parabola, FeatureConstraint(), starts)
    for links, held, called in (
        (2, [0], "x"),
        (2, [1], "y"),
        (3, [0, 1], "x and y"),
        (3, [0, 2], "x and angle"),
    ):
        plant = PlanarArm((1.0,) * links)
        found[f"{links}-link arm, {called}"] = Setting(
            _towards(rng, links),
            _rows_of(plant, held),
            FeatureConstraint(plant.jacobian, n_constraints=None),
            rng.uniform(-1.5, 1.5, (EPISODES, links)),
        )
    return found


def trial(seed: int) -> dict[str, Any]:
    """Errors of the learnt constraints of one data set, without noise and with, and of the chain."""
    result: dict[str, Any] = {}
    recorded = {name: (each.record(), each.estimator) for name, each in settings(seed).items()}
    for kind in KINDS:
        D = arm.demonstrate(kind, n_episodes=ARM_EPISODES, length=ARM_LENGTH, random_state=seed)
        recorded[f"7-DOF arm, {kind}"] = (D, FeatureConstraint(arm.jacobian, n_constraints=None))
    for name, (D, estimator) in recorded.items():
        result[name] = _errors(estimator, D)
        if name in SWEPT:
            rng = np.random.default_rng([seed, 1])
            result[f"{name}, noise"] = [_errors(estimator, D, noise, rng) for noise in NOISE]
    return result | {"chain": _chain(seed)}


def _errors(estimator: Any, D: Demonstrations, noise: float = 0.0, rng: Any = None) -> dict[str, Any]:
    """Learnt from the first half of the episodes, tested on the other half without noise."""
    half = D.episodes < (D.n_episodes + 1) // 2
    train, test = D.select(half), D.select(~half)
    U = train.actions
    if noise:
        U = U + noise * np.sqrt(np.mean(U**2)) * rng.normal(size=U.shape)
    try:
        learnt = clone(estimator).fit(train.states, U, groups=train.episodes)
    except UnconstrainError:  # noise hides the number of rows
        return {"nPPE": np.nan, "nPOE": np.nan, "rows": 0}
    assert test.policy is not None
    assert test.projections is not None
    N = learnt.predict(test.states)
    ppe = risk.projected_policy_error(test.policy, test.projections, N)
    poe = risk.projected_observation_error(test.actions, N)
    result = {
        "nPPE": risk.normalized(ppe, test.policy),
        "nPOE": risk.normalized(poe, test.actions),
        "rows": learnt.n_constraints_,
    }
    if isinstance(learnt, FeatureConstraint):
        result["features"] = learnt.constrained_features_.tolist()
    return result


def _chain(seed: int) -> dict[str, float]:
    """A linear policy under five constant constraints, each a task that moves: nUPE of three ways to learn it."""
    rng = np.random.default_rng([seed, 2])
    X, W = rng.uniform(-1, 1, (1000, 2)), _stable(rng, 2)
    Pi = (X - rng.uniform(-0.5, 0.5, 2)) @ W.T
    condition = np.arange(1000) % CONDITIONS
    A = rng.normal(size=(CONDITIONS, 1, 2))[condition]
    task = rng.normal(size=(1000, 1)) * np.linalg.pinv(A)[:, :, 0] * np.linalg.norm(A, axis=2)
    U = np.einsum("nij,nj->ni", projection(A), Pi) + task * np.sqrt(np.mean(Pi**2))
    chain = ConstraintChain(ConstantConstraint(1), ParametricPolicy(), NullspaceComponent())
    ways: dict[str, Any] = {
        "component, constraint, policy": chain.fit(X, U, conditions=condition),
        "inconsistency": ParametricPolicy().fit(X, U),
        "direct": ParametricPolicy(risk="direct").fit(X, U),
    }
    return {
        name: risk.normalized(risk.unconstrained_policy_error(Pi, policy.predict(X)), Pi)
        for name, policy in ways.items()
    }


def measured_trial(seed: int) -> dict[str, Any]:
    """One data set of an arm on a table in physics, and one of ten grasps: what knowing the constraints is worth."""
    return {"arm": _felt(seed), "grasp": _grasp(seed)}


def _felt(seed: int) -> dict[str, Any]:
    """nUPE on movements from new starts, by inconsistency and with the constraints read off a noisy force sensor."""
    from reproduction import arm_trials
    from reproduction.plants import arm_dynamics

    policy = arm.PowerPolicy(1.8, 0.5)
    recording = arm_dynamics.demonstrate(
        arm_dynamics.TABLE, policy, PHYSICS_EPISODES + PHYSICS_NEW, random_state=seed
    )
    D, rng = recording.demonstrations, np.random.default_rng([seed, 3])
    forces = recording.contact_force + SENSOR_NOISE * rng.normal(size=recording.contact_force.shape)
    robot = arm_dynamics.stage(arm_dynamics.TABLE)
    N = from_forces(
        forces,
        THRESHOLD,
        actions=D.actions,
        jacobian=robot.jacobian(D.states, arm_dynamics.TIP)[:, :3],
        margin=MARGIN,
        episodes=D.episodes,
    )
    seen = D.episodes < PHYSICS_EPISODES
    train, test = D.select(seen), D.select(~seen)
    result: dict[str, Any] = {"unknown": float(np.mean(np.isnan(N[:, 0, 0])))}
    for name, known in (("inconsistency", None), ("forces", N[seen])):
        found = select_policy(
            arm_trials.candidates(),
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


def _grasp(seed: int) -> dict[str, float]:
    """nUPE on other movements after ten grasps, by inconsistency and with the true projections; the same models."""
    from reproduction import grasp
    from reproduction.robots import OUR_OWN

    demonstrator, rng = grasp.demonstrator_of(OUR_OWN), np.random.default_rng(seed)
    train, test = (grasp.training(demonstrator, rng, GRASPS)[0].demonstrations for _ in range(2))
    result = {}
    for name, N in (("inconsistency", None), ("projections", train.projections)):
        policy = LocallyLinearPolicy(centers="kmeans", n_centers=GRASP_MODELS, alpha="cv")
        policy.fit(train.states, train.actions, groups=train.episodes, projections=N)
        result[name] = nupe(test, policy.predict(test.states))
    return result


def _stable(rng: np.random.Generator, d: int) -> Array:
    """A random matrix whose eigenvalues have negative real parts: an attractor, turning."""
    turn = rng.normal(size=(d, d))
    return turn - turn.T - np.diag(rng.uniform(0.5, 1.5, d))


def _rows_of(plant: PlanarArm, held: list[int]) -> Callable[[Array], Array]:
    return lambda Q: plant.jacobian(Q)[:, held]


def _towards(rng: np.random.Generator, d: int) -> Policy:
    W, target = _stable(rng, d), rng.uniform(-0.5, 0.5, d)
    return lambda X: (X - target) @ W.T
