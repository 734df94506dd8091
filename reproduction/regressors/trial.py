"""One regressor on one data set of every row of a plant's table."""

import time

from reproduction.adaptive.ways import ADAPTIVE, DIRECT, INCONSISTENCY
from reproduction.regressors.kinds import KINDS
from reproduction.regressors.problems import PLANTS, Problem
from reproduction.scores import nupe
from unconstrain.policies import RegressorPolicy

WRAPPED, TOLD, TRUTH = "wrapped", "told", "truth"

WAYS = {DIRECT: DIRECT, WRAPPED: ADAPTIVE, TOLD: INCONSISTENCY, TRUTH: DIRECT}
"""The risk by way to learn. "told" knows the true projection of every sample, "truth" is shown the true policy."""

PRIORS = ("linear", "zero")
"""What the regressor learns the rest of."""

Result = dict[str, dict[str, dict[str, float]]]
"""nUPE by way, fits and seconds of the wrapped one; by prior and by row."""


def run_trial(plant: str, regressor: str, seed: int) -> Result:
    """Learn one data set of each row.

    Parameters
    ----------
    plant : str
        Of `PLANTS`.
    regressor : str
        Of `KINDS`.
    seed : int
        Number of the data set.

    Returns
    -------
    dict
        Row, prior, and the nUPE by way; "fits" and "seconds" are those of the wrapped regressor.
    """
    return {
        row: {prior: measure(regressor, prior, problem) for prior in PRIORS}
        for row, problem in ((row, draw(seed)) for row, draw in PLANTS[plant].items())
    }


def measure(regressor: str, prior: str, problem: Problem) -> dict[str, float]:
    """Learn in every way beside one prior, and measure the nUPE on the test.

    Parameters
    ----------
    regressor : str
        Of `KINDS`.
    prior : str
        Of `PRIORS`.
    problem : Problem
        A data set.

    Returns
    -------
    dict of str to float
        As for `run_trial`.
    """
    training, test = problem
    cell: dict[str, float] = {}
    for way, risk in WAYS.items():
        policy = RegressorPolicy(KINDS[regressor](), risk=risk, prior=prior)
        begun = time.perf_counter()
        policy.fit(
            training.states,
            training.policy if way == TRUTH else training.actions,
            groups=training.episodes,
            projections=training.projections if way == TOLD else None,
        )
        if way == WRAPPED:
            cell |= {"seconds": time.perf_counter() - begun, "fits": policy.n_fits_}
            cell |= {"free": policy.free_share_, "noise": policy.noise_}
        cell[way] = nupe(test, policy.predict(test.states))
    return cell
