"""One data set of constraints to be learnt, in each setting where the truth is known."""

from typing import Any

import numpy as np
from sklearn.base import clone

from reproduction.constraints.settings import KINDS, draw_stable, make_settings, record_arm
from reproduction.plants import arm
from unconstrain import metrics
from unconstrain.constraints import projection
from unconstrain.constraints.learnt import (
    ConstantConstraint,
    ConstraintChain,
    FeatureConstraint,
    NullspaceComponent,
)
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import UnconstrainError
from unconstrain.policies import ParametricPolicy

NOISE = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2)
"""Standard deviation of noise on the actions, as a share of their root mean square."""

SWEPT = ("constant, linear", "parabola, limit cycle", "3-link arm, x and y", "7-DOF arm, 1-2-3")
"""Settings in which the noise is varied."""

CONDITIONS = 5
"""Different constraints in the data of the chain."""

ALPHA = 1e-6
"""λ of the policies beneath the chain, which hold the truth: hardly any."""

SETTINGS = {"experiment": "constraints", "noise": NOISE, "version": 2}
"""What the results depend on besides the seed."""


def run_trial(seed: int) -> dict[str, Any]:
    """Measure the errors of constraints learnt from one data set, without noise and with, and of the chain."""
    result: dict[str, Any] = {}
    recorded = {name: (each.record(), each.estimator) for name, each in make_settings(seed).items()}
    for kind in KINDS:
        estimator = FeatureConstraint(arm.jacobian, n_constraints=None)
        recorded[f"7-DOF arm, {kind}"] = (record_arm(kind, seed), estimator)
    for name, (D, estimator) in recorded.items():
        result[name] = _measure_errors(estimator, D)
        if name in SWEPT:
            rng = np.random.default_rng([seed, 1])
            result[f"{name}, noise"] = [_measure_errors(estimator, D, noise, rng) for noise in NOISE]
    return result | {"chain": _run_chain(seed)}


def _measure_errors(
    estimator: Any, D: Demonstrations, noise: float = 0.0, rng: np.random.Generator | None = None
) -> dict[str, Any]:
    """Learn from the first half of the episodes, and test on the other half without noise."""
    half = D.episodes < (D.n_episodes + 1) // 2
    train, test = D.select(half), D.select(~half)
    U = train.actions
    if noise and rng is not None:
        U = U + noise * np.sqrt(np.mean(U**2)) * rng.normal(size=U.shape)
    try:
        learnt = clone(estimator).fit(train.states, U, groups=train.episodes)
    except UnconstrainError:  # noise hides the number of rows
        return {"nPPE": np.nan, "nPOE": np.nan, "rows": 0}
    assert test.policy is not None
    assert test.projections is not None
    N = learnt.predict(test.states)
    ppe = metrics.projected_policy_error(test.policy, test.projections, N)
    poe = metrics.projected_observation_error(test.actions, N)
    result = {
        "nPPE": metrics.normalized(ppe, test.policy),
        "nPOE": metrics.normalized(poe, test.actions),
        "rows": learnt.n_constraints_,
    }
    if isinstance(learnt, FeatureConstraint):
        result["features"] = learnt.constrained_features_.tolist()
    return result


def _run_chain(seed: int) -> dict[str, float]:
    """Learn a linear policy under five constant constraints, each a task that moves, in three ways: the nUPE."""
    rng = np.random.default_rng([seed, 2])
    X, W = rng.uniform(-1, 1, (1000, 2)), draw_stable(rng, 2)
    Pi = (X - rng.uniform(-0.5, 0.5, 2)) @ W.T
    condition = np.arange(1000) % CONDITIONS
    A = rng.normal(size=(CONDITIONS, 1, 2))[condition]
    task = rng.normal(size=(1000, 1)) * np.linalg.pinv(A)[:, :, 0] * np.linalg.norm(A, axis=2)
    U = np.einsum("nij,nj->ni", projection(A), Pi) + task * np.sqrt(np.mean(Pi**2))
    linear = ParametricPolicy(risk="inconsistency", alpha=ALPHA)
    chain = ConstraintChain(ConstantConstraint(1), linear, NullspaceComponent())
    ways: dict[str, Any] = {
        "component, constraint, policy": chain.fit(X, U, conditions=condition),
        "inconsistency": clone(linear).fit(X, U),
        "direct": ParametricPolicy(risk="direct", alpha=ALPHA).fit(X, U),
    }
    return {
        name: metrics.normalized(metrics.unconstrained_policy_error(Pi, policy.predict(X)), Pi)
        for name, policy in ways.items()
    }
