"""Following the report's advice on what to record next, against recording at random and against knowing the truth."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from reproduction.arm.trial import make_local_models
from reproduction.plants import arm
from reproduction.scores import nupe
from unconstrain.demo import make_policy
from unconstrain.demonstrations import Demonstrations
from unconstrain.diagnostics import identifiability
from unconstrain.diagnostics.foresight import Movements
from unconstrain.limit_cycle import LimitCycle, demonstrate
from unconstrain.motion import directions
from unconstrain.policies.base import Policy
from unconstrain.robots import TaskConstraint
from unconstrain.simulation import simulate

Array = np.ndarray

WAYS = ("advised", "random", "oracle")
"""How the next demonstration is chosen. The oracle has the truth in view: of several it takes the one after which the
policy learnt has the least nUPE on the test movements."""

KINDS = ("2-4-6", "1-3-5", "4-5-6", "1-2-3")
"""Constraints on the arm's hand that can be chosen."""

TOY_FIRST, TOY_MOST = 2, 24
"""Demonstrations of the limit cycle to begin with, and in the end."""

TOY_POOL = 100
"""Random starts that the next one is chosen from."""

ARM_FIRST, ARM_MOST, ARM_AT_ONCE = 12, 60, 4
"""Demonstrations of the arm to begin with, in the end, and how many are added at a time."""

ARM_POOL, PATH_POINTS = 30, 10
"""Random starts that the next are chosen from, and points at which a movement that is foreseen counts."""

MATTERING = 300
"""Foreseen states of the arm over which the expected error is to fall."""

TOY_TRIED, ARM_TRIED = 30, 10
"""Demonstrations that the oracle tries for each that it takes."""

TOY = (TOY_FIRST, TOY_MOST, TOY_POOL, TOY_TRIED)
ARM = (ARM_FIRST, ARM_MOST, ARM_AT_ONCE, ARM_POOL, PATH_POINTS, MATTERING, ARM_TRIED)
LENGTH, RATE = 40, 50.0
"""Samples of a movement around the limit cycle, and samples per second."""

PLANTS = {"limit cycle": TOY, "arm": ARM}
"""What is followed, and what its results depend on besides the seed."""

RISKS = ("inconsistency", "adaptive")

Learn = Callable[[list[Demonstrations]], Policy]


def follow(plant: str, risk: str, way: str, seed: int) -> dict[str, Any]:
    """Follow one way to choose on one data set.

    Parameters
    ----------
    plant : {"limit cycle", "arm"}
        Of which demonstrations are made.
    risk : str
        That policies are learnt by.
    way : str
        One of `WAYS`.
    seed : int
        Of everything that is drawn.

    Returns
    -------
    dict of str to list of float
        "nUPE" after each number of demonstrations.
    """
    run = {"limit cycle": follow_on_toy, "arm": follow_on_arm}[plant]
    return {"nUPE": run(seed, way, risk)}


def follow_on_toy(seed: int, way: str, risk: str) -> list[float]:
    """Add demonstrations of the limit cycle one by one, each with one direction free all the way.

    Parameters
    ----------
    seed : int
        Of everything that is drawn.
    way : str
        How the next is chosen, one of `WAYS`.
    risk : str
        That policies are learnt by.

    Returns
    -------
    list of float
        nUPE after each demonstration, from `TOY_FIRST` to `TOY_MOST`.
    """
    rng = np.random.default_rng([seed, 3])
    test = demonstrate(random_state=np.random.default_rng([seed, 1]))
    learn = partial(_learn, lambda: make_policy(risk))
    movements = [record_along(*_draw_movement(rng)) for _ in range(TOY_FIRST)]
    errors = []
    while True:
        policy = learn(movements)
        errors.append(nupe(test, policy.predict(test.states)))
        if len(movements) == TOY_MOST:
            return errors
        if way == "random":
            movements.append(record_along(*_draw_movement(rng)))
        elif way == "oracle":
            tried = [record_along(*_draw_movement(rng)) for _ in range(TOY_TRIED)]
            movements.append(tried[_choose_in_truth(learn, movements, tried, test)])
        else:
            seen = Demonstrations.concatenate(movements)
            report = identifiability(policy, seen.states, seen.actions, groups=seen.episodes)
            pool = rng.uniform(-1.0, 1.0, size=(TOY_POOL, 2))
            best = report.next_recordings(1, candidates=pool)[0]
            movements.append(record_along(best.state, best.direction))


def _learn(make: Callable[[], Policy], movements: list[Demonstrations]) -> Policy:
    seen = Demonstrations.concatenate(movements)
    return make().fit(seen.states, seen.actions, groups=seen.episodes)


def _choose_in_truth(
    learn: Learn, movements: list[Demonstrations], tried: list[Demonstrations], test: Demonstrations
) -> int:
    """Choose the demonstration after which the policy learnt has the least error on test movements."""
    errors = [nupe(test, learn([*movements, one]).predict(test.states)) for one in tried]
    return int(np.argmin(errors))


def _draw_movement(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    return rng.uniform(-1.0, 1.0, size=2), directions(rng.normal(size=(1, 2)))[0][0]


def record_along(start: Array, direction: Array) -> Demonstrations:
    """Record the limit cycle from a start (2,) with motion along one direction (2,) free, as under one constraint."""
    N = np.outer(direction, direction)[None]
    return simulate(LimitCycle(), start, LENGTH - 1, 1 / RATE, project=lambda k, X, wanted: N)


def follow_on_arm(seed: int, way: str, risk: str, kinds: tuple[str, ...] = KINDS) -> list[float]:
    """Add demonstrations of the arm a few at a time, each from a start in a pool under one of the constraints.

    Parameters
    ----------
    seed : int
        Of everything that is drawn.
    way : str
        How the next are chosen, one of `WAYS`.
    risk : str
        That policies are learnt by.
    kinds : tuple of str
        The constraints on the hand.

    Returns
    -------
    list of float
        nUPE from `ARM_FIRST` to `ARM_MOST` demonstrations, after every `ARM_AT_ONCE`.
    """
    rng = np.random.default_rng([seed, 4])
    truth = arm.PowerPolicy(1.8)
    constraints = [TaskConstraint.parse(rows) for rows in kinds]
    tests = [
        arm.demonstrate(one, truth, 8, random_state=np.random.default_rng([seed, 5])) for one in constraints
    ]
    test = Demonstrations.concatenate(tests)
    learn = partial(_learn, lambda: make_local_models(risk))
    movements = []
    for _ in range(ARM_FIRST):
        start = arm.draw_starts(1, rng)
        movements.append(arm.follow(constraints[rng.integers(len(constraints))], truth, start))
    errors = []
    while True:
        policy = learn(movements)
        errors.append(nupe(test, policy.predict(test.states)))
        if len(movements) >= ARM_MOST:
            return errors
        pool = arm.draw_starts(ARM_POOL, rng)
        if way == "oracle":
            for _ in range(ARM_AT_ONCE):
                tried = [
                    arm.follow(constraints[rng.integers(len(constraints))], truth, pool[i : i + 1])
                    for i in rng.integers(ARM_POOL, size=ARM_TRIED)
                ]
                movements.append(tried[_choose_in_truth(learn, movements, tried, test)])
            continue
        if way == "random":
            chosen = [
                (pool[i : i + 1], constraints[rng.integers(len(constraints))]) for i in range(ARM_AT_ONCE)
            ]
        else:
            seen = Demonstrations.concatenate(movements)
            chosen = _choose_most_telling(policy, seen, pool, constraints, rng)
        movements += [arm.follow(constraint, truth, start) for start, constraint in chosen]


def _choose_most_telling(
    policy: Policy,
    seen: Demonstrations,
    pool: Array,
    constraints: list[TaskConstraint],
    rng: np.random.Generator,
) -> list[tuple[Array, TaskConstraint]]:
    """Choose starts and constraints whose movements, as the learnt policy foresees them, would tell most."""
    report = identifiability(policy, seen.states, seen.actions, groups=seen.episodes)
    paths = [foresee(policy, pool, constraint) for constraint in constraints]
    foreseen = Movements(*(np.concatenate(each) for each in zip(*paths, strict=True)))
    states = foreseen.states.reshape(-1, foreseen.states.shape[-1])
    planner = report.planner(rng.permutation(states)[:MATTERING], len(seen.states) / seen.n_episodes)
    starts = np.arange(len(foreseen)) % len(pool)
    chosen: list[int] = []
    for _ in range(ARM_AT_ONCE):
        gains = planner.gains_of(foreseen)
        gains[np.isin(starts, starts[chosen])] = -np.inf
        chosen.append(int(np.argmax(gains)))
        planner.record_movements(foreseen.select(slice(chosen[-1], chosen[-1] + 1)))
    return [(pool[i % len(pool)][None], constraints[i // len(pool)]) for i in chosen]


def foresee(policy: Policy, pool: Array, constraint: TaskConstraint) -> tuple[Array, Array]:
    """Foresee where a learnt policy would lead under a constraint: states (C, points, 7), and directions of motion."""
    length = 100
    path = simulate(
        policy,
        pool,
        length - 1,
        1.0,
        project=lambda k, X, wanted: constraint.projections(arm.jacobian(X)),
        # A policy learnt from little may lead anywhere; the joints stop at their limits.
        advance=lambda X, U: (np.clip(X + U, -arm.LIMITS, arm.LIMITS), U),
    )
    X, U = (
        each.reshape(len(pool), length, -1)[:, :: length // PATH_POINTS]
        for each in (path.states, path.actions)
    )
    # Directions are taken time by time: whether an action is rounding is judged among those of the same time.
    along = np.stack([directions(U[:, k])[0] for k in range(U.shape[1])], axis=1)
    return X, along
