"""One data set of the toy: the rows of the table, and both sweeps of Fig. 4."""

import numpy as np
from numpy.typing import NDArray

from unconstrain.demo import FEW, MOVEMENTS, WIDTH, draw_data, learn, measure_errors

WAYS = ("inconsistency", "direct", "oracle")

SHARES = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
"""Of the 40 movements, in Fig. 4 (top). 5 % are two movements, the fewest that can be cross-validated."""

NOISE = (0.0, 0.025, 0.05, 0.075, 0.1, 0.125, 0.15, 0.175, 0.2)
"""Standard deviation of noise on the actions as a share of their scale, in Fig. 4 (bottom)."""

SETTINGS = {"experiment": "toy", "width": WIDTH, "shares": SHARES, "noise": NOISE, "version": 1}
"""What the results depend on besides the seed."""

Result = dict[str, dict[str, float]]
"""nUPE and nCPE by row of the table and by step of the sweeps."""


def run_trial(seed: int) -> Result:
    """Measure the errors on one data set."""
    training, test = draw_data(seed)
    result = {
        f"{way}, {movements} trajectories": measure_errors(learn(training, way, movements), test)
        for way in WAYS
        for movements in (FEW, MOVEMENTS)
    }
    for share in SHARES:
        policy = learn(training, movements=round(share * MOVEMENTS))
        result[f"share {share}"] = measure_errors(policy, test)
    for noise in NOISE:
        noisy, test = draw_data(seed, noise)
        result[f"noise {noise}"] = measure_errors(learn(noisy), test)
    return result


def collect(results: list[Result], row: str, error: str) -> NDArray[np.float64]:
    """Return one error of all data sets, (trials,)."""
    return np.array([result[row][error] for result in results])
