"""Following the report's advice on what to record next, against recording at random."""

import numpy as np

from reproduction.arm.trial import make_local_models
from reproduction.plants import arm
from reproduction.scores import nupe
from unconstrain.demo import make_policy
from unconstrain.demonstrations import Demonstrations
from unconstrain.diagnostics import identifiability
from unconstrain.limit_cycle import LimitCycle, demonstrate
from unconstrain.motion import directions
from unconstrain.policies.base import Policy
from unconstrain.robots import TaskConstraint
from unconstrain.simulation import simulate

Array = np.ndarray

WAYS = ("advised", "random")

TOY_FIRST, TOY_MOST = 2, 24
"""Demonstrations of the limit cycle to begin with, and in the end."""

TOY_POOL = 100
"""Random starts that the next one is chosen from."""

ARM_FIRST, ARM_MOST, ARM_AT_ONCE = 12, 60, 4
"""Demonstrations of the arm to begin with, in the end, and how many are added at a time."""

ARM_POOL, PATH_POINTS = 30, 10
"""Random starts that the next are chosen from, and points at which a movement that is foreseen counts."""

TOY = (TOY_FIRST, TOY_MOST, TOY_POOL)
ARM = (ARM_FIRST, ARM_MOST, ARM_AT_ONCE, ARM_POOL, PATH_POINTS)
LENGTH, RATE = 40, 50.0
"""Samples of a movement around the limit cycle, and samples per second."""


def follow_on_toy(seed: int, way: str) -> list[float]:
    """Add demonstrations of the limit cycle one by one, each with one direction free all the way.

    Parameters
    ----------
    seed : int
        Of everything that is drawn.
    way : str
        How the next is chosen, one of `WAYS`.

    Returns
    -------
    list of float
        nUPE after each demonstration, from `TOY_FIRST` to `TOY_MOST`.
    """
    rng = np.random.default_rng([seed, 3])
    test = demonstrate(random_state=np.random.default_rng([seed, 1]))
    movements = [record_along(*_draw_movement(rng)) for _ in range(TOY_FIRST)]
    errors = []
    while True:
        seen = Demonstrations.concatenate(movements)
        policy = make_policy().fit(seen.states, seen.actions, groups=seen.episodes)
        errors.append(nupe(test, policy.predict(test.states)))
        if len(movements) == TOY_MOST:
            return errors
        if way == "random":
            movements.append(record_along(*_draw_movement(rng)))
            continue
        report = identifiability(policy, seen.states, seen.actions, groups=seen.episodes)
        pool = rng.uniform(-1.0, 1.0, size=(TOY_POOL, 2))
        best = report.next_recordings(1, candidates=pool)[0]
        movements.append(record_along(best.state, best.direction))


def _draw_movement(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    return rng.uniform(-1.0, 1.0, size=2), directions(rng.normal(size=(1, 2)))[0][0]


def record_along(start: Array, direction: Array) -> Demonstrations:
    """Record the limit cycle from a start (2,) with motion along one direction (2,) free, as under one constraint."""
    N = np.outer(direction, direction)[None]
    return simulate(LimitCycle(), start, LENGTH - 1, 1 / RATE, project=lambda k, X, wanted: N)


def follow_on_arm(seed: int, way: str, kinds: tuple[str, ...]) -> list[float]:
    """Add demonstrations of the arm a few at a time, each from a start in a pool under one of the constraints.

    Parameters
    ----------
    seed : int
        Of everything that is drawn.
    way : str
        How the next are chosen, one of `WAYS`.
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
    movements = []
    for _ in range(ARM_FIRST):
        start = arm.draw_starts(1, rng)
        movements.append(arm.follow(constraints[rng.integers(len(constraints))], truth, start))
    errors = []
    while True:
        seen = Demonstrations.concatenate(movements)
        policy = make_local_models().fit(seen.states, seen.actions, groups=seen.episodes)
        errors.append(nupe(test, policy.predict(test.states)))
        if len(movements) >= ARM_MOST:
            return errors
        pool = arm.draw_starts(ARM_POOL, rng)
        if way == "random":
            chosen = [
                (pool[i : i + 1], constraints[rng.integers(len(constraints))]) for i in range(ARM_AT_ONCE)
            ]
        else:
            chosen = _choose_most_telling(policy, seen, pool, constraints)
        movements += [arm.follow(constraint, truth, start) for start, constraint in chosen]


def _choose_most_telling(
    policy: Policy, seen: Demonstrations, pool: Array, constraints: list[TaskConstraint]
) -> list[tuple[Array, TaskConstraint]]:
    """Choose starts and constraints whose movements, as the learnt policy foresees them, would tell most."""
    report = identifiability(policy, seen.states, seen.actions, groups=seen.episodes)
    paths = [foresee(policy, pool, constraint) for constraint in constraints]
    X = np.concatenate([path[0] for path in paths])  # (4 C, points, 7)
    q = np.concatenate([path[1] for path in paths])
    length = seen.states.shape[0] / seen.n_episodes
    candidates = X[:, ::3].reshape(-1, 7)
    planner = report.planner(candidates[:: max(1, len(candidates) // 200)], length / PATH_POINTS)
    chosen: list[int] = []
    for _ in range(ARM_AT_ONCE):
        gains = planner.gains(X.reshape(-1, 7), q.reshape(-1, 7)).reshape(len(X), -1).sum(axis=1)
        gains[chosen] = -np.inf
        chosen.append(int(np.argmax(gains)))
        for x, along in zip(X[chosen[-1]], q[chosen[-1]], strict=True):
            planner.record(x[None], along[None])
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
