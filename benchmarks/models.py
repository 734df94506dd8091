"""Which kind of policy for which data: errors, time to fit, and time of a step.

`python -m benchmarks models` prints the tables of docs/models.md. Movements are simulated whose true policy is known:

    π_j(x) = -x_j + sin(2 x_{j+1})

Half of their stretches are free, the others lose one direction each, drawn anew. A fit that would take longer than
`LONGEST`, by what a tenth of the rows took, is left out.
"""

import time
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np
from rich.progress import track
from sklearn.ensemble import ExtraTreesRegressor, HistGradientBoostingRegressor
from sklearn.linear_model import Ridge

import unconstrain as uc
from benchmarks.ratio import medians

ROWS, DIMENSIONS = (500, 5_000, 50_000), (2, 7, 27)
NOISE, MUCH_NOISE = 0.03, 0.2
"""Of the rms action."""
LENGTH, STRETCH, DT = 50, 10, 0.05
"""Samples of a movement and of a stretch under one constraint; seconds between samples."""
TESTED, OUTSIDE = 2_000, 1.25
"""States tested on; where those of the extrapolation lie, in units of the box that movements start in."""
LONGEST = 30.0
"""Seconds of a processor, which do not count what others do on the machine."""

KINDS: dict[str, Callable[[], Any]] = {
    "linear": uc.ParametricPolicy,
    "50 RBFs": lambda: uc.ParametricPolicy(uc.NormalizedRBF(n_centers=50)),
    "local models": uc.LocallyLinearPolicy,
    "extra trees": lambda: uc.RegressorPolicy(ExtraTreesRegressor(50, min_samples_leaf=3, random_state=0)),
    "boosting": lambda: uc.RegressorPolicy(HistGradientBoostingRegressor(max_iter=50, random_state=0)),
    "Gaussian process": uc.GaussianProcessPolicy,
    "network": lambda: uc.TorchPolicy(random_state=0),
}
MOST_DIMENSIONS = {"local models": 7}
"""Beyond these a kind is left out: in 27 each local model has 756 parameters, and 500 rows take minutes."""
NEEDS = {"network": "torch"}
"""Kinds that need a package which may not be installed."""


class Data(NamedTuple):
    """States, actions and episodes to learn from; states and true actions to test on, inside and outside."""

    X: np.ndarray
    U: np.ndarray
    episodes: np.ndarray
    inside: np.ndarray
    outside: np.ndarray


class Row(NamedTuple):
    """What was measured; times of a step are ratios to `Ridge.predict` of as many states."""

    kind: str
    rows: int
    dimensions: int
    noise: float
    inside: float
    outside: float
    fit: float
    one: float
    thousand: float


def true_policy(X: np.ndarray) -> np.ndarray:
    """Each action decays its own state and swings with the next one."""
    return -X + np.sin(2 * np.roll(X, -1, axis=1))


def simulate(rows: int, n: int, noise: float, seed: int = 0) -> Data:
    rng = np.random.default_rng(seed)
    episodes = max(2, rows // LENGTH)
    x = rng.uniform(-1, 1, (episodes, n))
    X, U = np.empty((2, episodes, LENGTH, n))
    for k in range(LENGTH):
        if k % STRETCH == 0:
            a = rng.standard_normal((episodes, n))
            a /= np.linalg.norm(a, axis=1, keepdims=True)
            a[rng.random(episodes) < 0.5] = 0.0
        Pi = true_policy(x)
        X[:, k], U[:, k] = x, Pi - a * np.sum(a * Pi, axis=1, keepdims=True)
        x = x + DT * U[:, k]
    X, U = X.reshape(-1, n), U.reshape(-1, n)
    inside = X[rng.choice(len(X), min(TESTED, len(X)), replace=False)]
    inside = inside + 0.05 * rng.standard_normal(inside.shape)
    outside = rng.uniform(-1, 1, (TESTED, n))
    outside *= OUTSIDE / np.abs(outside).max(axis=1, keepdims=True)
    U = U + noise * np.sqrt(np.mean(U**2)) * rng.standard_normal(U.shape)
    return Data(X, U, np.repeat(np.arange(episodes), LENGTH), inside, outside)


def settings() -> Iterator[tuple[int, int, float]]:
    for n in DIMENSIONS:
        for rows in ROWS:
            yield rows, n, NOISE
    yield ROWS[1], DIMENSIONS[1], MUCH_NOISE


def nupe(policy: Any, X: np.ndarray) -> float:
    Pi = true_policy(X)
    return uc.metrics.normalized(uc.metrics.unconstrained_policy_error(Pi, policy.predict(X)), Pi)


def measure(kind: str, rows: int, n: int, noise: float) -> Row:
    X, U, episodes, inside, outside = simulate(rows, n, noise)
    policy, ridge = KINDS[kind](), Ridge().fit(X, U)
    begun = time.process_time()
    policy.fit(X, U, groups=episodes)
    seconds = time.process_time() - begun
    times = []
    for states in (X[:1].copy(), np.resize(X, (1000, n))):
        ours, theirs = medians(
            lambda Z=states: policy.predict(Z), lambda Z=states: ridge.predict(Z), repeats=9
        )
        times.append(ours / theirs)
    return Row(kind, len(X), n, noise, nupe(policy, inside), nupe(policy, outside), seconds, *times)


def list_kinds() -> list[str]:
    return [kind for kind in KINDS if kind not in NEEDS or find_spec(NEEDS[kind]) is not None]


def measure_all() -> Iterator[Row]:
    took: dict[tuple[str, int], tuple[int, float]] = {}
    for rows, n, noise in track(list(settings()), "models", transient=True):
        for kind in list_kinds():
            before, seconds = took.get((kind, n), (rows, 0.0))
            if seconds * rows / before > LONGEST or n > MOST_DIMENSIONS.get(kind, n):
                yield Row(kind, rows, n, noise, *[np.nan] * 5)
                continue
            row = measure(kind, rows, n, noise)
            took[kind, n] = row.rows, row.fit
            yield row


def print_tables() -> None:
    """Print errors and times, a row a data set that was learnt and a column a kind."""
    kinds = list_kinds()
    for kind in set(KINDS) - set(kinds):
        print(f"{kind} is left out: {NEEDS[kind]} is not installed")
    found = {(row.kind, row.rows, row.dimensions, row.noise): row for row in measure_all()}
    for title, write in (
        ("nUPE", lambda row: f"{row.inside:.2g}"),
        ("nUPE outside", lambda row: f"{row.outside:.2g}"),
        ("processor seconds to fit", lambda row: f"{row.fit:.2g}"),
        ("one state / Ridge.predict", lambda row: f"{row.one:.2g}"),
        ("1,000 states / Ridge.predict", lambda row: f"{row.thousand:.2g}"),
    ):
        print(f"\n{title}:\n")
        print(f"| rows | dimensions | noise | {' | '.join(kinds)} |")
        print("| --- " * (3 + len(kinds)) + "|")
        for rows, n, noise in settings():
            cells = [found[kind, rows, n, noise] for kind in kinds]
            if all(np.isnan(row.fit) for row in cells):
                continue
            written = ["-" if np.isnan(row.fit) else write(row) for row in cells]
            print(f"| {rows:,} | {n} | {noise:.0%} | {' | '.join(written)} |")
