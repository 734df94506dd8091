"""One data set of the toy: the rows of the table, and both sweeps of Fig. 4."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from unconstrain.demo import FEW, MOVEMENTS, WIDTH, draw_data, learn, measure_errors

ORACLE = "oracle"
"""Regression on the true policy itself, which no sweep needs."""

WAYS = ("inconsistency", "direct", ORACLE)

SHARES = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
"""Of the 40 movements, in Fig. 4 (top). 5 % are two movements, the fewest that can be cross-validated."""

NOISE = (0.0, 0.025, 0.05, 0.075, 0.1, 0.125, 0.15, 0.175, 0.2)
"""Standard deviation of noise on the actions as a share of their scale, in Fig. 4 (bottom)."""

SETTINGS = {"experiment": "toy", "width": WIDTH, "shares": SHARES, "noise": NOISE, "version": 2}
"""What the results depend on besides the seed."""

Result = dict[str, dict[str, float]]
"""nUPE and nCPE by row of the table and by step of the sweeps."""


def name_row(way: str, movements: int) -> str:
    """Name a row of the table: "direct, 40 trajectories"."""
    return f"{way}, {movements} trajectories"


def name_share(way: str, share: float) -> str:
    """Name a step of the sweep over the size of the data set: "direct, share 0.5"."""
    return f"{way}, share {share}"


def name_noise(way: str, noise: float) -> str:
    """Name a step of the sweep over noise: "direct, noise 0.1"."""
    return f"{way}, noise {noise}"


def run_trial(seed: int, ways: Sequence[str] = WAYS) -> Result:
    """Measure the errors on one data set, of each way to learn."""
    training, test = draw_data(seed)
    result: Result = {}
    for way in ways:
        for movements in (FEW, MOVEMENTS):
            result[name_row(way, movements)] = measure_errors(learn(training, way, movements), test)
        if way == ORACLE:
            continue
        for share in SHARES:
            policy = learn(training, way, round(share * MOVEMENTS))
            result[name_share(way, share)] = measure_errors(policy, test)
        for noise in NOISE:
            noisy, _ = draw_data(seed, noise)
            result[name_noise(way, noise)] = measure_errors(learn(noisy, way), test)
    return result


def collect(results: list[Result], row: str, error: str) -> NDArray[np.float64]:
    """Return one error of all data sets, (trials,)."""
    return np.array([result[row][error] for result in results])
