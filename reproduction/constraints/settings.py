"""Plants with constraints to be learnt, in each of which the truth is known."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reproduction.plants import arm
from reproduction.plants.planar import PlanarArm
from unconstrain.constraints.learnt import ConstantConstraint, FeatureConstraint
from unconstrain.demonstrations import Demonstrations
from unconstrain.limit_cycle import LimitCycle
from unconstrain.simulation import rollout

Array = NDArray[np.float64]

EPISODES, LENGTH, STEP = 40, 40, 0.02
"""Movements, samples of each, and seconds between them, in the plane and of planar arms."""

ARM_EPISODES, ARM_LENGTH = 20, 50
"""Movements and samples of each, of the 7-DOF arm."""

KINDS = ("1-2-3", "4-5-6", "1-3-5", "2-4-6")
"""Constraints of the 7-DOF arm's hand."""

Field = Callable[[Array], Array]
"""From states (N, n) to actions (N, n), or to constraint rows (N, k, n)."""


@dataclass(frozen=True)
class Setting:
    """A policy, constraint rows, and the estimator that can hold the rows.

    Parameters
    ----------
    policy, rows : callable
        The truth.
    estimator : FeatureConstraint or ConstantConstraint
        Not fitted yet.
    starts : ndarray of shape (S, n)
        Of the movements.
    """

    policy: Field
    rows: Field
    estimator: Any
    starts: Array

    def record(self) -> Demonstrations:
        """Record movements ``x ← x + STEP N π`` from all starts."""
        movements = rollout(self.policy, self.starts, LENGTH - 1, STEP, self.rows)
        # All movements' first samples, then their second: noise has always been drawn in this order.
        return movements.select(np.arange(len(movements)).reshape(-1, LENGTH).T.ravel())


def make_settings(seed: int) -> dict[str, Setting]:
    """Make the settings of data set number `seed`, by name."""
    rng = np.random.default_rng(seed)
    linear = _attract(rng, 2)
    starts = rng.uniform(-1, 1, (EPISODES, 2))
    row, a = rng.normal(size=(1, 2)), float(rng.uniform(0.2, 2.0) * rng.choice([-1, 1]))

    def constant(X: Array) -> Array:
        return np.broadcast_to(row, (len(X), 1, 2))

    def parabola(X: Array) -> Array:
        return np.stack([-2 * a * X[:, 0], np.ones(len(X))], axis=1)[:, None]

    found: dict[str, Setting] = {}
    for name, policy in (("linear", linear), ("limit cycle", LimitCycle())):
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
            _attract(rng, links),
            _hold(plant, held),
            FeatureConstraint(plant.jacobian, n_constraints=None),
            rng.uniform(-1.5, 1.5, (EPISODES, links)),
        )
    return found


def record_arm(kind: str, seed: int) -> Demonstrations:
    """Record the 7-DOF arm with these rows of its hand's motion held."""
    return arm.demonstrate(kind, n_episodes=ARM_EPISODES, length=ARM_LENGTH, random_state=seed)


def draw_stable(rng: np.random.Generator, d: int) -> Array:
    """Draw a matrix (d, d) whose eigenvalues have negative real parts: an attractor, turning."""
    turn = rng.normal(size=(d, d))
    return turn - turn.T - np.diag(rng.uniform(0.5, 1.5, d))


def _attract(rng: np.random.Generator, d: int) -> Field:
    W, target = draw_stable(rng, d), rng.uniform(-0.5, 0.5, d)
    return lambda X: (X - target) @ W.T


def _hold(plant: PlanarArm, coordinates: list[int]) -> Field:
    return lambda Q: plant.jacobian(Q)[:, coordinates]
