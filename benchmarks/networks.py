"""What networks reach beside models that are linear in their parameters, where policy and constraints are known.

`python -m benchmarks.networks` prints the table of docs/networks.md. Every figure is the nUPE on held-out samples
(arm) or movements (grasp, posture). "told" learns by the inconsistency from all true projections, "truth" from the true
policy's own actions. It needs the extras `torch` and `sim`, and an hour; `--data` and `--noise` make less of it.
"""

import argparse
import time
import warnings
from collections.abc import Callable

import numpy as np
from rich.progress import track
from sklearn.base import clone

import unconstrain as uc
from reproduction.adaptive.ways import add_noise
from reproduction.arm.trial import Recordings, make_local_models
from reproduction.grasp import trial as grasp
from reproduction.plants.robot_choice import OUR_OWN
from reproduction.posture import trial as posture
from reproduction.scores import nupe

FIRST_SEED = 0
"""What the network's defaults were chosen on is seed 100 of the arm at p = 1.8 under 2-4-6, and of the limit cycle."""

NOISE = (0.0, 0.02)
"""As a share of the root mean square action."""

Sets = tuple[uc.Demonstrations, uc.Demonstrations]


def record_arm(p: float, constraint: str, seed: int) -> Sets:
    """Samples to learn from and to test on."""
    recordings = Recordings.simulate(p, constraint, seed)
    return recordings.training, recordings.test


def record_grasp(seed: int) -> Sets:
    """Movements to learn from and to test on."""
    demonstrator, rng = grasp.make_demonstrator(OUR_OWN), np.random.default_rng(seed)
    train, test = grasp.record_both(demonstrator, rng)
    return train.demonstrations, test.demonstrations


def record_posture(seed: int) -> Sets:
    """Movements to learn from and to test on."""
    train, test, _ = posture.record(seed)
    return train, test


def make_grasp_model():
    """The model of Table II, that decays to the linear policy."""
    return grasp.make_model("adaptive")


DATA: dict[str, tuple[Callable[[int], Sets], Callable[[], uc.LocallyLinearPolicy]]] = {
    **{
        f"arm, p = {p}, {constraint}": (
            lambda seed, p=p, constraint=constraint: record_arm(p, constraint, seed),
            make_local_models,
        )
        for p in (1.5, 1.8)
        for constraint in ("1-2-3", "2-4-6")
    },
    "grasp": (record_grasp, make_grasp_model),
    "posture, 27-D": (record_posture, lambda: uc.ParametricPolicy()),
}


def measure(policy, risk: str, demos: uc.Demonstrations, test: uc.Demonstrations, **known) -> float:
    """Learn and return the nUPE."""
    actions = known.pop("actions", demos.actions)
    learnt = clone(policy).set_params(risk=risk).fit(demos.states, actions, groups=demos.episodes, **known)
    return nupe(test, learnt.predict(test.states))


def compare(name: str, noise: float, seed: int, policy: uc.TorchPolicy) -> tuple[dict[str, float], float]:
    """All columns of a row, and how many seconds the adaptive fit of the network took."""
    record, make_linear = DATA[name]
    clean, test = record(seed)
    demos, _ = add_noise(clean, noise, np.random.default_rng([seed, 7]))
    told = {"projections": clean.projections}
    found = {"direct": measure(policy, "direct", demos, test)}
    begun = time.perf_counter()
    found["adaptive"] = measure(policy, "adaptive", demos, test)
    seconds = time.perf_counter() - begun
    found["told"] = measure(policy, "inconsistency", demos, test, **told)
    found["truth"] = measure(policy, "direct", demos, test, actions=clean.policy)
    linear = make_linear()
    found["linear adaptive"] = measure(linear, "adaptive", demos, test)
    found["linear told"] = measure(linear, "inconsistency", demos, test, **told)
    return found, seconds


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.networks", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--data", nargs="*", choices=tuple(DATA), default=list(DATA))
    parser.add_argument("--noise", nargs="*", type=float, default=NOISE)
    parser.add_argument("--trials", type=int, default=1)
    parser.add_argument("--ensemble", type=int, default=1)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    rows = [(name, noise) for name in given.data for noise in given.noise]
    print(
        "| data | noise | direct | adaptive | told | truth | adaptive / told | seconds | linear: adaptive | told | "
        "ratio |"
    )
    print("| --- " * 11 + "|")
    for name, noise in track(rows, "networks", transient=True):
        found, seconds = [], []
        for seed in range(FIRST_SEED, FIRST_SEED + given.trials):
            policy = uc.TorchPolicy(n_ensemble=given.ensemble, random_state=seed)
            cells, took = compare(name, noise, seed, policy)
            found.append(list(cells.values()))
            seconds.append(took)
        direct, adaptive, told, truth, linear, linear_told = np.mean(found, axis=0)
        print(
            f"| {name} | {noise:.0%} | {direct:.2g} | {adaptive:.2g} | {told:.2g} | {truth:.2g} | "
            f"{adaptive / told:.2g} | {np.mean(seconds):.0f} | {linear:.2g} | {linear_told:.2g} | "
            f"{linear / linear_told:.2g} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
