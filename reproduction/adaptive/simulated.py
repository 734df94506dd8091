"""One data set of each plant whose policy and constraints are known, with noise on the recorded actions."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from reproduction.adaptive.settings import Part, Reach, Result
from reproduction.adaptive.ways import compare_recorded, compare_ways, root_mean_square
from reproduction.arm.trial import CONSTRAINTS, EPISODES, SETTINGS, Recordings, make_candidates
from reproduction.constraints import measured
from reproduction.grasp import trial as grasp
from reproduction.plants.robot_choice import OUR_OWN
from reproduction.posture import trial as posture
from unconstrain import demo
from unconstrain.limit_cycle import demonstrate
from unconstrain.policies import ParametricPolicy

NOISE_STREAM = 7
"""Noise of data set k is drawn from the stream (k, this): the same numbers, scaled, at every level of noise."""

# Cycle.
FREE = (0.0, 0.25, 0.5, 0.75, 1.0)
NOISE = (0.0, 0.02, 0.05, 0.1, 0.2)
TIMES_TOLD = (3.5, 3.0, 2.0, 1.7, 1.3)
"""By share of free segments."""
MANY = 400
"""Movements of the large data sets."""

# Arm.
POWERS, MODELS = (1.8, 2.0), ("locally linear", "decoupled, 15 knots")
LITTLE_NOISE = (0.0, 0.02, 0.05)
"""Of the arm and of the ten grasps."""

BODY_NOISE = 0.02
"""Of the posture and of the full grasp."""


def name_cycle_cell(free: float, noise: float) -> str:
    """Name a cell: "25 % free, 5 % noise"."""
    return f"{free:.0%} free, {name_noise(noise)}".replace("%", " %", 1)


def name_noise(noise: float) -> str:
    """Name an amount of noise: "5 % noise"."""
    return f"{100 * noise:g} % noise"


def run_cycle(
    movements: int,
    ways: tuple[str, ...],
    folder: Path | None,
    seed: int,
    test_movements: int = demo.MOVEMENTS,
) -> Result:
    """Learn the limit cycle, at every share of free segments and amount of noise."""
    result: Result = {}
    for free in FREE:
        clean = demonstrate(movements, free=free, random_state=np.random.default_rng([seed, 0]))
        test = demonstrate(test_movements, free=free, random_state=np.random.default_rng([seed, 1]))
        for noise in NOISE:
            result[name_cycle_cell(free, noise)] = compare_ways(
                demo.make_policy(), ways, clean, test, noise, draw_noise(seed)
            )
    return result


def name_arm_cell(p: float, constraint: str, model: str, noise: float) -> str:
    """Name a cell: "p = 1.8, 1-2-3, locally linear, 2 % noise"."""
    return f"p = {p:g}, {constraint}, {model}, {name_noise(noise)}"


def run_arm(ways: tuple[str, ...], folder: Path | None, seed: int, episodes: int = EPISODES) -> Result:
    """Learn the arm of Table I under each constraint, with models that know little and much of the policy."""
    result: Result = {}
    models = make_candidates()
    for p in POWERS:
        for constraint in CONSTRAINTS:
            recordings = Recordings.simulate(p, constraint, seed, episodes)
            for model in MODELS:
                for noise in LITTLE_NOISE:
                    result[name_arm_cell(p, constraint, model, noise)] = compare_ways(
                        models[model], ways, recordings.training, recordings.test, noise, draw_noise(seed)
                    )
    return result


def run_grasp(ways: tuple[str, ...], folder: Path | None, seed: int, grasps: int = measured.GRASPS) -> Result:
    """Learn from ten grasps."""
    clean, test = measured.record_grasps(seed, grasps)
    return {
        name_noise(noise): compare_ways(
            measured.make_grasp_model(), ways, clean, test, noise, draw_noise(seed)
        )
        for noise in LITTLE_NOISE
    }


def run_bodies(ways: tuple[str, ...], folder: Path | None, seed: int, episodes: int = 100) -> Result:
    """Learn the posture, and the grasp of Table II."""
    train, test, _ = posture.record(seed, n_episodes=episodes)
    demonstrator, rng = grasp.make_demonstrator(OUR_OWN), np.random.default_rng(seed)
    grasps, others = (each.demonstrations for each in grasp.record_both(demonstrator, rng, episodes))
    local = grasp.make_model("adaptive")
    assert not isinstance(local, dict)
    return {
        "posture": compare_ways(ParametricPolicy(), ways, train, test, BODY_NOISE, draw_noise(seed)),
        "grasp, Table II": compare_ways(local, ways, grasps, others, BODY_NOISE, draw_noise(seed)),
    }


def run_physics(
    ways: tuple[str, ...], folder: Path | None, seed: int, episodes: int = measured.PHYSICS_EPISODES
) -> Result:
    """Learn the arm that slides on tables in physics; "told" has what a force sensor says."""
    recorded = measured.record_sliding(seed, episodes)
    clean = replace(recorded.train, actions=recorded.ideal)
    # Inertia, encoders and differentiation leave the recorded actions so far from N π.
    deviation = root_mean_square(recorded.train.actions - recorded.ideal)
    models = make_candidates()
    return {
        model: compare_recorded(
            models[model], ways, recorded.train, clean, recorded.test, recorded.known, deviation
        )
        for model in MODELS
    }


def draw_noise(seed: int) -> np.random.Generator:
    """Return what the noise of a data set is drawn from, at every level of noise anew."""
    return np.random.default_rng([seed, NOISE_STREAM])


def _limit_cycle(movements: int) -> Part:
    return Part(
        title=f"Limit cycle, {movements} movements",
        measure="nUPE",
        run=partial(run_cycle, movements),
        settings={"movements": movements, "free": FREE, "noise": NOISE, "width": demo.WIDTH},
        reaches={
            name_cycle_cell(free, noise): Reach(told=times, best=1.1)
            for free, times in zip(FREE, TIMES_TOLD, strict=True)
            for noise in NOISE
        },
    )


SIMULATED = {
    "cycle": _limit_cycle(demo.MOVEMENTS),
    "cycle400": _limit_cycle(MANY),
    "arm": Part(
        title="7-DOF arm (Table I), with noise",
        measure="nUPE on held-out samples",
        run=run_arm,
        settings={**SETTINGS, "powers": POWERS, "models": MODELS, "noise": LITTLE_NOISE},
        reaches={
            name_arm_cell(p, constraint, model, noise): Reach(
                bound=1.3, inconsistency=0.1 if noise == BODY_NOISE else None
            )
            for p in POWERS
            for constraint in CONSTRAINTS
            for model in MODELS
            for noise in LITTLE_NOISE
        },
    ),
    "grasp": Part(
        title=f"{measured.GRASPS} grasps, with noise",
        measure="nUPE on other movements",
        run=run_grasp,
        settings={"grasps": measured.GRASPS, "models": measured.GRASP_MODELS, "noise": LITTLE_NOISE},
        otherwise=Reach(told=1.5, contact=0.97),
        needs="sim",
    ),
    "posture": Part(
        title=f"Posture and grasp (Sec. IV-D and Table II), {name_noise(BODY_NOISE)}",
        measure="nUPE on other movements",
        run=run_bodies,
        settings={"noise": BODY_NOISE},
        otherwise=Reach(told=2.0),
        needs="sim",
    ),
    "physics": Part(
        title="Arm in physics, sliding on tables",
        measure="nUPE from new starts",
        run=run_physics,
        settings={
            "sensor": [measured.SENSOR_NOISE, measured.THRESHOLD, measured.MARGIN],
            "episodes": measured.PHYSICS_EPISODES,
            "models": MODELS,
        },
        otherwise=Reach(told=2.0),
        told="what a force sensor says",
        needs="sim",
    ),
}
"""The parts that need no recordings, in the order of the report."""
