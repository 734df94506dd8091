"""How often the truth lies in an adaptive fit's intervals of 90 %, under noise: limit cycle, arm and ten grasps."""

from pathlib import Path

import numpy as np
from sklearn.preprocessing import PolynomialFeatures

from reproduction.adaptive.settings import Part, Reach, Result
from reproduction.adaptive.simulated import draw_noise, name_arm_cell, name_cycle_cell, name_noise
from reproduction.adaptive.ways import ADAPTIVE, Cell, add_noise, learn
from reproduction.arm.trial import CONSTRAINTS, EPISODES, SETTINGS, Recordings, make_local_models
from reproduction.constraints import measured
from reproduction.scores import nupe
from unconstrain import demo
from unconstrain.demonstrations import Demonstrations
from unconstrain.features import NormalizedRBF
from unconstrain.limit_cycle import demonstrate
from unconstrain.policies import ParametricPolicy
from unconstrain.policies.base import Policy

NINETY = 1.6448536269514722
"""Standard deviations on either side that hold 90 % of a Gaussian."""

INSIDE = (0.85, 0.95)
NOISE, FREE, POWERS = (0.02, 0.05), (0.0, 0.5), (1.5, 1.8)
MANY_CENTERS = 60
CYCLE_MODELS = ("cubic", "36 RBFs", f"{MANY_CENTERS} RBFs")
LOCAL = "locally linear"


def run_intervals(
    ways: tuple[str, ...],
    folder: Path | None,
    seed: int,
    movements: int = demo.MOVEMENTS,
    episodes: int = EPISODES,
    grasps: int = measured.GRASPS,
) -> Result:
    """Learn every data set of this number, and compare the policies' deviations with their errors."""
    result: Result = {}
    for free in FREE:
        clean, test = (
            demonstrate(movements, free=free, random_state=np.random.default_rng([seed, k])) for k in (0, 1)
        )
        for noise in NOISE:
            for name, policy in _make_cycle_models().items():
                cell = f"limit cycle, {name}, {name_cycle_cell(free, noise)}"
                result[cell] = compare_intervals(policy, clean, test, noise, draw_noise(seed))
    for p in POWERS:
        for constraint in CONSTRAINTS:
            recordings = Recordings.simulate(p, constraint, seed, episodes)
            for noise in NOISE:
                result[name_arm_cell(p, constraint, LOCAL, noise)] = compare_intervals(
                    make_local_models(), recordings.training, recordings.test, noise, draw_noise(seed)
                )
    clean, test = measured.record_grasps(seed, grasps)
    for noise in NOISE:
        result[f"ten grasps, {name_noise(noise)}"] = compare_intervals(
            measured.make_grasp_model(), clean, test, noise, draw_noise(seed)
        )
    return result


def compare_intervals(
    policy: Policy, clean: Demonstrations, test: Demonstrations, noise: float, rng: np.random.Generator
) -> Cell:
    """Learn by the adaptive risk, and compare deviations with errors.

    Parameters
    ----------
    policy : Policy
        The model.
    clean : Demonstrations
        To learn from.
    test : Demonstrations
        Without noise, with the true policy.
    noise : float
        To be added, as a share of the rms action.
    rng : Generator
        For the noise.

    Returns
    -------
    dict of str to float
        The nUPE; "inside", the share of all actions' true values within the 90 % interval; "width", half of the
        interval's width in the median over these, as a multiple of the root mean square error.
    """
    assert test.policy is not None
    noisy, _ = add_noise(clean, noise, rng)
    P, deviation = learn(policy, ADAPTIVE, noisy).predict(test.states, return_std=True)
    error = np.abs(P - test.policy)
    return {
        ADAPTIVE: nupe(test, P),
        "inside": float(np.mean(error <= NINETY * deviation)),
        "width": float(np.median(NINETY * deviation) / np.sqrt(np.mean(error**2))),
    }


def _make_cycle_models() -> dict[str, Policy]:
    models = (
        ParametricPolicy(PolynomialFeatures(3)),
        demo.make_policy(),
        ParametricPolicy(NormalizedRBF(MANY_CENTERS)),
    )
    return dict(zip(CYCLE_MODELS, models, strict=True))


INTERVALS = {
    "intervals": Part(
        title="Intervals of 90 %",
        measure="nUPE, the share of true actions inside the interval, and half its median width over the rms error",
        run=run_intervals,
        settings={
            **SETTINGS,
            "movements": demo.MOVEMENTS,
            "cycle models": CYCLE_MODELS,
            "free": FREE,
            "noise": NOISE,
            "powers": POWERS,
            "grasps": measured.GRASPS,
            "models": measured.GRASP_MODELS,
        },
        otherwise=Reach(inside=INSIDE),
        needs="sim",
    )
}
"""The part about intervals."""
