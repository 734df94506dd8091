"""Does the report tell the truth? One trial: shares and spreads beside errors, and advice followed."""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.stats import spearmanr

from reproduction import arm_trials
from reproduction.errors import nupe
from reproduction.plants import arm
from unconstrain import demo
from unconstrain import limit_cycle as toy
from unconstrain.demonstrations import Demonstrations
from unconstrain.diagnostics import identifiability
from unconstrain.features import DecoupledFeatures
from unconstrain.motion import directions
from unconstrain.policies import LocallyLinearPolicy, ParametricPolicy
from unconstrain.policies.base import Policy
from unconstrain.robots import TaskConstraint

POWERS = (1.5, 1.8)
BEST_FIRST = ("2-4-6", "1-3-5", "4-5-6", "1-2-3")

NINETY = 1.6448536269514722
"""Standard deviations on either side that hold 90 % of a Gaussian."""

TOY_FIRST, TOY_MOST = 2, 24
"""Demonstrations to begin with, and in the end."""
TOY_POOL = 100
ARM_FIRST, ARM_MOST, ARM_AT_ONCE = 12, 60, 4
ARM_POOL, PATH_POINTS = 30, 10

SETTINGS = {
    "powers": POWERS,
    "toy": (TOY_FIRST, TOY_MOST, TOY_POOL),
    "arm": (ARM_FIRST, ARM_MOST, ARM_AT_ONCE, ARM_POOL, PATH_POINTS),
    "version": 1,
}


def trial(seed: int) -> dict[str, Any]:
    """Everything of one seed."""
    return {
        "arm": {f"{p} {rows}": _arm(p, rows, seed) for p in POWERS for rows in BEST_FIRST},
        "calibration": _calibration(seed),
        "advice, toy": {way: _toy_advised(seed, way) for way in ("advised", "random")},
        "advice, arm": {way: _arm_advised(seed, way) for way in ("advised", "random")},
    }


def told(policy: Policy, test: Demonstrations) -> dict[str, float]:
    """What the standard deviations say of the errors on a test set with the true policy.

    nUPE; coverage: share of all actions' true values within the 90 % interval; correlation: rank correlation over
    states between predicted deviation and actual error, both over all actions together.
    """
    P, deviation = policy.predict(test.states, return_std=True)
    error = np.abs(P - test.policy)
    ranks = spearmanr(np.linalg.norm(deviation, axis=1), np.linalg.norm(error, axis=1))
    return {
        "nUPE": nupe(test, P),
        "coverage": float(np.mean(error <= NINETY * deviation)),
        "correlation": float(ranks.statistic),
    }


def _arm(p: float, rows: str, seed: int) -> dict[str, float]:
    data = arm_trials.Recordings.simulate(p, rows, seed)
    seen = data.training
    # λ is chosen as for Table I.
    policy = arm_trials.local_models().fit(seen.states, seen.actions, groups=np.arange(len(seen)))
    report = identifiability(policy, seen.states, seen.actions)
    return told(policy, data.test) | {
        "determined": report.determined_share,
        "median": float(np.median(report.spectrum)),
        "bound": report.bound_determined,
    }


def _calibration(seed: int) -> dict[str, dict[str, float]]:
    result = {}
    test = toy.demonstrate(random_state=np.random.default_rng([seed, 1]))
    models: dict[str, Callable[[], Policy]] = {
        "RBF": demo.make_policy,
        "locally linear": lambda: LocallyLinearPolicy(alpha="cv"),
        "linear (misspecified)": lambda: ParametricPolicy(alpha="cv"),
    }
    for name, model in models.items():
        for noise in (0.0, 0.05, 0.1, 0.2):
            seen = toy.demonstrate(noise=noise, random_state=np.random.default_rng([seed, 0]))
            policy = model().fit(seen.states, seen.actions, groups=seen.episodes)
            result[f"toy, {name}, noise {noise:.0%}"] = told(policy, test)
    few = toy.demonstrate(4, random_state=np.random.default_rng([seed, 0]))
    policy = demo.make_policy().fit(few.states, few.actions, groups=few.episodes)
    result["toy, RBF, 4 movements"] = told(policy, test)

    # The model holds the truth and the noise is what it assumes: what remains is the arithmetic.
    rng = np.random.default_rng([seed, 2])
    W = rng.normal(size=(2, 2))
    U = np.sum((seen.states @ W) * _along(seen), axis=1, keepdims=True) * _along(seen)
    noisy = U + 0.05 * rng.normal(size=(len(U), 1)) * _along(seen)
    policy = ParametricPolicy(alpha="cv").fit(seen.states, noisy, groups=seen.episodes)
    linear = Demonstrations(states=test.states, actions=test.states @ W, policy=test.states @ W)
    result["linear policy, noise along the motion"] = told(policy, linear)

    for p in (1.8, 2.0):
        data = arm_trials.Recordings.simulate(p, "1-3-5", seed)
        seen, policy = data.training, ParametricPolicy(DecoupledFeatures(), alpha="cv")
        policy.fit(seen.states, seen.actions, groups=seen.episodes)
        result[f"arm, 1-3-5, p = {p}, decoupled"] = told(policy, data.test)
    data = arm_trials.Recordings.simulate(2.0, "1-2-3", seed)
    policy = arm_trials.local_models()
    policy.fit(data.training.states, data.training.actions, groups=data.training.episodes)
    result["arm, 1-2-3, p = 2.0, locally linear"] = told(policy, data.test)
    return result


def _along(demos: Demonstrations) -> np.ndarray:
    return directions(demos.actions)[0]


def _toy_advised(seed: int, way: str) -> list[float]:
    """nUPE after each demonstration, from `TOY_FIRST` to `TOY_MOST`, each along one free direction all the way."""
    rng = np.random.default_rng([seed, 3])
    test = toy.demonstrate(random_state=np.random.default_rng([seed, 1]))
    movements = [_free_along(*_toy_drawn(rng)) for _ in range(TOY_FIRST)]
    errors = []
    while True:
        seen = Demonstrations.concatenate(movements)
        policy = demo.make_policy().fit(seen.states, seen.actions, groups=seen.episodes)
        errors.append(nupe(test, policy.predict(test.states)))
        if len(movements) == TOY_MOST:
            return errors
        if way == "random":
            movements.append(_free_along(*_toy_drawn(rng)))
            continue
        report = identifiability(policy, seen.states, seen.actions, groups=seen.episodes)
        pool = rng.uniform(-1.0, 1.0, size=(TOY_POOL, 2))
        best = report.next_recordings(1, candidates=pool)[0]
        movements.append(_free_along(best.state, best.direction))


def _toy_drawn(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    return rng.uniform(-1.0, 1.0, size=2), directions(rng.normal(size=(1, 2)))[0][0]


def _free_along(x: np.ndarray, direction: np.ndarray, length: int = 40, rate: float = 50.0) -> Demonstrations:
    """The limit cycle with motion along one direction free, as the toy's movements under one constraint."""
    policy, N = toy.LimitCycle(), np.outer(direction, direction)
    states, actions = np.empty((length, 2)), np.empty((length, 2))
    for k in range(length):
        states[k] = x
        actions[k] = N @ policy(x[None])[0]
        x = x + actions[k] / rate
    return Demonstrations(states=states, actions=actions)


def _arm_advised(seed: int, way: str) -> list[float]:
    """nUPE after every `ARM_AT_ONCE` demonstrations, each from a start in a pool under one of four constraints."""
    rng = np.random.default_rng([seed, 4])
    truth = arm.PowerPolicy(1.8)
    constraints = [TaskConstraint.parse(rows) for rows in BEST_FIRST]
    tests = [
        arm.demonstrate(one, truth, 8, random_state=np.random.default_rng([seed, 5])) for one in constraints
    ]
    test = Demonstrations.concatenate(tests)
    movements = [
        _arm_movement(truth, arm.starts(1, rng), constraints[rng.integers(4)]) for _ in range(ARM_FIRST)
    ]
    errors = []
    while True:
        seen = Demonstrations.concatenate(movements)
        policy = arm_trials.local_models().fit(seen.states, seen.actions, groups=seen.episodes)
        errors.append(nupe(test, policy.predict(test.states)))
        if len(movements) >= ARM_MOST:
            return errors
        pool = arm.starts(ARM_POOL, rng)
        if way == "random":
            chosen = [(pool[i : i + 1], constraints[rng.integers(4)]) for i in range(ARM_AT_ONCE)]
        else:
            chosen = _most_telling(policy, seen, pool, constraints)
        movements += [_arm_movement(truth, x, constraint) for x, constraint in chosen]


def _most_telling(policy, seen: Demonstrations, pool: np.ndarray, constraints: list) -> list:
    """Starts and constraints whose movements, as the learnt policy foresees them, would tell most."""
    report = identifiability(policy, seen.states, seen.actions, groups=seen.episodes)
    paths = [_foreseen(policy, pool, constraint) for constraint in constraints]
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


def _foreseen(policy, pool: np.ndarray, constraint, length: int = 100) -> tuple[np.ndarray, np.ndarray]:
    """States (C, points, 7) and directions of motion there, where the learnt policy would lead under a constraint."""
    x, states, along = pool, [], []
    for k in range(length):
        N = constraint.projections(arm.jacobian(x))
        u = np.einsum("cij,cj->ci", N, policy.predict(x))
        if k % (length // PATH_POINTS) == 0:
            states.append(x)
            along.append(directions(u)[0])
        x = np.clip(x + u, -arm.LIMITS, arm.LIMITS)
    return np.stack(states, axis=1), np.stack(along, axis=1)


def _arm_movement(policy, x: np.ndarray, constraint, length: int = 100) -> Demonstrations:
    states, actions = np.empty((length, 7)), np.empty((length, 7))
    for k in range(length):
        N = constraint.projections(arm.jacobian(x))[0]
        states[k] = x[0]
        actions[k] = N @ policy(x)[0]
        x = x + actions[k]
    return Demonstrations(states=states, actions=actions)
