"""One trial: does the report tell the truth? Shares and deviations beside errors."""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.stats import spearmanr

from reproduction.arm.trial import Recordings, make_local_models
from reproduction.scores import nupe
from unconstrain.demo import make_policy
from unconstrain.demonstrations import Demonstrations
from unconstrain.diagnostics import identifiability
from unconstrain.features import DecoupledFeatures
from unconstrain.limit_cycle import demonstrate
from unconstrain.motion import directions
from unconstrain.policies import LocallyLinearPolicy, ParametricPolicy
from unconstrain.policies.base import Policy

POWERS = (1.5, 1.8)
BEST_FIRST = ("2-4-6", "1-3-5", "4-5-6", "1-2-3")
"""Types of constraint, by how far movements under them determine the policy."""

NINETY = 1.6448536269514722
"""Standard deviations on either side that hold 90 % of a Gaussian."""

SETTINGS = {"powers": POWERS, "version": 3}
"""What the results depend on besides the seed."""


def run_trial(seed: int) -> dict[str, Any]:
    """Run everything of one seed."""
    return {
        "arm": {f"{p} {rows}": _run_arm(p, rows, seed) for p in POWERS for rows in BEST_FIRST},
        "calibration": _calibrate(seed),
    }


def compare_deviations(policy: Policy, test: Demonstrations) -> dict[str, float]:
    """Compare the policy's standard deviations with its errors on a test set with the true policy.

    Parameters
    ----------
    policy : Policy
        Fitted.
    test : Demonstrations
        With the true policy.

    Returns
    -------
    dict of str to float
        "nUPE"; "coverage", the share of all actions' true values within the 90 % interval; "correlation", the rank
        correlation over states between predicted deviation and actual error, both over all actions together.
    """
    P, deviation = policy.predict(test.states, return_std=True)
    error = np.abs(P - test.policy)
    ranks = spearmanr(np.linalg.norm(deviation, axis=1), np.linalg.norm(error, axis=1))
    return {
        "nUPE": nupe(test, P),
        "coverage": float(np.mean(error <= NINETY * deviation)),
        "correlation": float(ranks.statistic),
    }


def _run_arm(p: float, rows: str, seed: int) -> dict[str, float]:
    data = Recordings.simulate(p, rows, seed)
    train = data.training
    # λ by the library's rule, on samples held out one by one.
    policy = make_local_models().fit(train.states, train.actions, groups=np.arange(len(train)))
    report = identifiability(policy, train.states, train.actions)
    return compare_deviations(policy, data.test) | {
        "determined": report.determined_share,
        "median": float(np.median(report.spectrum)),
        "bound": report.bound_determined,
    }


def _calibrate(seed: int) -> dict[str, dict[str, float]]:
    result = {}
    test = demonstrate(random_state=np.random.default_rng([seed, 1]))
    models: dict[str, Callable[[], Policy]] = {
        "RBF": make_policy,
        "locally linear": lambda: LocallyLinearPolicy(risk="inconsistency", alpha="cv"),
        "linear (misspecified)": lambda: ParametricPolicy(risk="inconsistency", alpha="cv"),
    }
    for name, model in models.items():
        for noise in (0.0, 0.05, 0.1, 0.2):
            seen = demonstrate(noise=noise, random_state=np.random.default_rng([seed, 0]))
            policy = model().fit(seen.states, seen.actions, groups=seen.episodes)
            result[f"toy, {name}, noise {noise:.0%}"] = compare_deviations(policy, test)
    few = demonstrate(4, random_state=np.random.default_rng([seed, 0]))
    policy = make_policy().fit(few.states, few.actions, groups=few.episodes)
    result["toy, RBF, 4 movements"] = compare_deviations(policy, test)

    # The model holds the truth and the noise is what it assumes: what remains is the arithmetic.
    rng = np.random.default_rng([seed, 2])
    W = rng.normal(size=(2, 2))
    U = np.sum((seen.states @ W) * _along(seen), axis=1, keepdims=True) * _along(seen)
    noisy = U + 0.05 * rng.normal(size=(len(U), 1)) * _along(seen)
    policy = ParametricPolicy(risk="inconsistency", alpha="cv").fit(seen.states, noisy, groups=seen.episodes)
    linear = Demonstrations(states=test.states, actions=test.states @ W, policy=test.states @ W)
    result["linear policy, noise along the motion"] = compare_deviations(policy, linear)

    for p in (1.8, 2.0):
        data = Recordings.simulate(p, "1-3-5", seed)
        seen, policy = data.training, ParametricPolicy(DecoupledFeatures(), risk="inconsistency", alpha="cv")
        policy.fit(seen.states, seen.actions, groups=seen.episodes)
        result[f"arm, 1-3-5, p = {p}, decoupled"] = compare_deviations(policy, data.test)
    data = Recordings.simulate(2.0, "1-2-3", seed)
    policy = make_local_models()
    policy.fit(data.training.states, data.training.actions, groups=data.training.episodes)
    result["arm, 1-2-3, p = 2.0, locally linear"] = compare_deviations(policy, data.test)
    return result


def _along(demos: Demonstrations) -> np.ndarray:
    return directions(demos.actions)[0]
