"""One data set of the grasp: demonstrations through gaps, the policies learnt from them, and their errors."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.preprocessing import PolynomialFeatures

from reproduction import published
from reproduction.plants.barrier import Barrier
from reproduction.plants.grasping import DURATION, Demonstrator, Recording, constrain
from reproduction.plants.robot_choice import OUR_OWN, RobotChoice
from reproduction.scores import ncpe, nupe
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import UnconstrainError
from unconstrain.features import PotentialFeatures
from unconstrain.policies import LocallyLinearPolicy, ParametricPolicy
from unconstrain.policies.base import Policy
from unconstrain.selection import candidates, select_policy

Array = NDArray[np.float64]

COLUMNS = tuple(published.GRASP)

RISKS = ("inconsistency", "direct")
"""The paper's."""

GAP_MEAN, GAP_DEVIATION = 0.25, 0.1
"""The gap's width is drawn from this Gaussian for each movement, in metres."""

N_MODELS = 150

POTENTIAL_DEGREE = 4
"""Of the polynomial potential: the expert's is a Gaussian, even and nearly a parabola over the table."""

HELD_OUT = 0.2
"""Movements made for each test alone, as a share of those to learn from."""


def measure_columns(demonstrator: Demonstrator, test: Demonstrations, P: Array) -> dict[str, float]:
    """Measure Table II's columns for predictions P (N, 6) at held-out states: one error, three projections of it."""
    assert test.policy is not None
    unseen, _ = constrain(demonstrator.scene.central(len(test)), test.states, test.policy)
    errors = (ncpe(test, P), ncpe(test, P, unseen), nupe(test, P))
    return dict(zip(COLUMNS, errors, strict=True))


def make_model(risk: str, name: str = "local") -> Policy | dict[str, Policy]:
    """Make the model of an approach; λ by cross-validation of its risk.

    Parameters
    ----------
    risk : str
        "inconsistency", "direct" or "adaptive".
    name : str
        "local" for the 150 local models with centres by k-means, "potential" for a potential that is a polynomial of
        degree 4 in the hands' positions, "auto" for a choice of candidates, these two among them.

    Returns
    -------
    Policy, or dict of str to Policy
        For "auto" the candidates, by name.

    Raises
    ------
    UnconstrainError
        If there is no such model.
    """
    # As published, weights decay to zero: a linear policy of all data, learnt from one number a sample, is all but
    # undetermined here.
    prior = "zero" if risk == "inconsistency" else "global"
    local = LocallyLinearPolicy(centers="kmeans", n_centers=N_MODELS, risk=risk, alpha="cv", prior=prior)
    if name == "local":
        return local
    potential = ParametricPolicy(
        PotentialFeatures(PolynomialFeatures(POTENTIAL_DEGREE)), risk=risk, alpha="cv"
    )
    if name == "potential":
        return potential
    if name == "auto":
        named = {each: policy.set_params(risk=risk) for each, policy in candidates(6, 6).items()}
        return {**named, "150 local models": local, "quartic potential": potential}
    raise UnconstrainError(f"there is no model {name!r} for the grasp: choose local, potential or auto")


def learn(D: Demonstrations, risk: str, name: str = "local") -> tuple[Policy, str]:
    """Learn the policy behind demonstrations, and name its model: for "auto" that of the chosen candidate."""
    made = make_model(risk, name)
    if isinstance(made, dict):
        chosen = select_policy(made, D.states, D.actions, groups=D.episodes)
        return chosen.policy, chosen.name
    return made.fit(D.states, D.actions, groups=D.episodes), name


@lru_cache(maxsize=1)
def make_demonstrator(choice: RobotChoice) -> Demonstrator:
    """Make the demonstrator with the robot chosen, once in each process."""
    return Demonstrator(choice.load())


def run_trial(
    seed: int,
    choice: RobotChoice = OUR_OWN,
    name: str = "local",
    n_episodes: int = 100,
    duration: float = DURATION,
    risks: Sequence[str] = RISKS,
) -> dict[str, Any]:
    """Learn one data set; normalised errors by risk, and what happened in it.

    The errors named as Table II's columns are those at the states of held-out movements under training constraints,
    projected as each column says. Those that end in "moving" are errors along movements the expert makes under the
    column's own constraint. "direct" always has the 150 local models.
    """
    demonstrator, rng = make_demonstrator(choice), np.random.default_rng(seed)
    held_out = max(2, round(HELD_OUT * n_episodes))
    train, test = record_both(demonstrator, rng, n_episodes, duration)
    barred = demonstrator.scene.central(held_out)
    around = demonstrator.record(barred, demonstrator.draw_starts(held_out, rng), duration=duration)
    free = demonstrator.record(None, demonstrator.draw_starts(held_out, rng), duration=duration)

    result: dict[str, Any] = {}
    for risk in risks:
        policy, chosen = learn(train.demonstrations, risk, "local" if risk == "direct" else name)
        errors = measure_columns(
            demonstrator, test.demonstrations, policy.predict(test.demonstrations.states)
        )
        for movements, column in ((around, COLUMNS[1]), (free, COLUMNS[2])):
            M = movements.demonstrations
            errors[f"{column}, moving"] = ncpe(M, policy.predict(M.states))
        result[risk] = errors
        result[f"{risk} model"] = chosen
    return result | {
        "movements that meet the barrier": train.movements_blocked,
        "samples the barrier blocks": float(train.blocked.any(axis=1).mean()),
        "movements that meet the unseen barrier": around.movements_blocked,
        "tracking error": train.tracking,
    }


def record_training(
    demonstrator: Demonstrator,
    random_state: int | np.random.Generator | None,
    n: int = 100,
    duration: float = DURATION,
) -> tuple[Recording, Barrier]:
    """Record n movements through gaps of random width, and return the barriers they met as well."""
    rng = np.random.default_rng(random_state)
    obstacle = demonstrator.scene.with_gap(rng.normal(GAP_MEAN, GAP_DEVIATION, n))
    return demonstrator.record(obstacle, demonstrator.draw_starts(n, rng), duration=duration), obstacle


def record_both(
    demonstrator: Demonstrator, rng: np.random.Generator, n: int = 100, duration: float = DURATION
) -> tuple[Recording, Recording]:
    """Record n movements to learn from, and a fifth as many to test on."""
    train, _ = record_training(demonstrator, rng, n, duration)
    test, _ = record_training(demonstrator, rng, max(2, round(HELD_OUT * n)), duration)
    return train, test


def collect(results: list[dict[str, Any]], risk: str, column: str) -> Array:
    """Return one error of all data sets, (trials,)."""
    return np.array([result[risk][column] for result in results])
