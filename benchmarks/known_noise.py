"""What it helps a policy to know the noise of its velocities, and to learn from those over the window that is found.

`python -m benchmarks.known_noise` prints the table of docs/velocities.md; with --risk adaptive it takes some minutes.
"""

import argparse
import warnings
from collections.abc import Callable

import numpy as np
from rich.progress import track

import unconstrain as uc
from unconstrain.constraints import projection
from unconstrain.limit_cycle import LimitCycle
from unconstrain.recordings import differentiate
from unconstrain.recordings.smoothing import find_smoothing

RATE, STEPS_BETWEEN = 50, 10
NOISE = (1e-4, 1e-3, 5e-3, 2e-2)
FREE = (0.0, 0.4)
USUAL = 0.2

Law = Callable[[np.ndarray], np.ndarray]


def move(policy: Law, start: np.ndarray, N: np.ndarray) -> np.ndarray:
    """Positions (T, d) of a movement by `N(t) π(x)`, at `RATE`."""
    x, path = start, []
    for own in N:
        path.append(x)
        for _ in range(STEPS_BETWEEN):
            x = x + own @ policy(x[None])[0] / (RATE * STEPS_BETWEEN)
    return np.array(path)


def record(kind: str, free: float, seed: int) -> tuple[Law, list[np.ndarray]]:
    """A policy, and movements each third of which has a constraint of its own or, by chance, none."""
    rng = np.random.default_rng(seed)
    d, count, length = (2, 30, 100) if kind == "limit cycle" else (6, 40, 75)
    slopes = np.random.default_rng(5).normal(size=(d, d)) * 0.3 - np.eye(d)
    policy = LimitCycle() if kind == "limit cycle" else lambda X: X @ slopes.T
    movements = []
    for _ in range(count):
        start = rng.uniform(-1, 1, d) if kind == "limit cycle" else rng.normal(size=d)
        thirds = []
        for _ in range(3):
            A = rng.normal(size=(1 if d == 2 else rng.integers(1, 4), d))
            thirds.append(np.eye(d) if rng.random() < free else projection(A[None])[0])
        movements.append(move(policy, start, np.repeat(thirds, length // 3 + 1, axis=0)[:length]))
    return policy, movements


def errors(kind: str, free: float, noise: float, risk: str, seed: int) -> list[float]:
    """The nUPE over the usual window without the noise, over the one found without, and with it."""
    policy, movements = record(kind, free, seed)
    rng = np.random.default_rng(1000 + seed)
    seen = [X + noise * rng.standard_normal(X.shape) for X in movements]
    states, t = np.concatenate(seen), np.arange(len(seen[0])) / RATE
    episodes = np.repeat(np.arange(len(seen)), len(t))
    smoothing = find_smoothing(states, np.tile(t, len(seen)), episodes)
    assert smoothing is not None
    X = np.concatenate(movements)
    true = policy(X)
    found = []
    for window, known in (
        (USUAL, None),
        (smoothing.window, None),
        (smoothing.window, smoothing.velocity_noise),
    ):
        actions = np.concatenate([differentiate(each, t, window=window) for each in seen])
        features = uc.NormalizedRBF(n_centers=36, random_state=0) if kind == "limit cycle" else None
        learnt = uc.ParametricPolicy(features, risk=risk, noise=known).fit(states, actions, groups=episodes)
        error = uc.metrics.unconstrained_policy_error(true, learnt.predict(X))
        found.append(float(uc.metrics.normalized(error, true)))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.known_noise", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--risk", choices=("adaptive", "corrected"), default="corrected")
    parser.add_argument("--trials", type=int, default=5)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    rows = [
        (kind, free, noise) for kind in ("limit cycle", "linear, 6-D") for free in FREE for noise in NOISE
    ]
    print(
        "| policy | free | noise of positions | nUPE over 0.2 s | over the window found | and its noise known |"
    )
    print("| --- | --- | --- | --- | --- | --- |")
    for kind, free, noise in track(rows, given.risk, transient=True):
        found = [errors(kind, free, noise, given.risk, seed) for seed in range(100, 100 + given.trials)]
        cells = " | ".join(f"{value:.2g}" for value in np.exp(np.mean(np.log(found), axis=0)))
        print(f"| {kind} | {free:.0%} | {noise:g} | {cells} |")


if __name__ == "__main__":
    main()
