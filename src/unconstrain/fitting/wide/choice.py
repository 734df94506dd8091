"""Choosing λ for held samples, for which every candidate costs passes."""

import warnings

import numpy as np

from unconstrain.errors import DataError
from unconstrain.fitting.solve import INDISTINGUISHABLE, LARGEST, N_ALPHAS, ONE_FOLD, SMALLEST
from unconstrain.fitting.wide.decay import WideDecay
from unconstrain.waiting import within

PRECISION = 1e-7
"""Of predictions at the samples, as a share of the root mean square action. At what was held out they are less precise,
by as much as the samples leave open there: with 1e-3 held-out risks were wrong by half."""

MOST_STEPS = 1_000
"""A λ that is not solved in as many is no candidate, nor are smaller ones."""

FIRST_TRIED = 0.1
"""λ that is tried first."""

NOT_BETTER = 3
"""After so many λ in a row that do not lower the held-out risk noticeably, smaller ones are not tried."""

WORSE = 1.05
"""Nor are they after one with so many times the least held-out risk."""

NEAR = 2
"""Candidates to either side that are near."""


def choose_alpha(decay: WideDecay, near: float | None = None) -> tuple[float, np.ndarray, np.ndarray]:
    """Choose λ by the risk on folds left out one at a time, all of them side by side.

    Candidates are those of `fitting.solve`. Every other one is tried, each from where its neighbour ended: from a
    middling one down until smaller ones have not been better for long, and up if that one was the best; then the two
    beside the best. Features are standardised by all folds together.

    Parameters
    ----------
    decay : WideDecay
        Of several folds.
    near : float, optional
        About where λ is: only candidates up to ten times as large or as small are tried.

    Returns
    -------
    alpha : float
        The chosen λ.
    alphas : ndarray of shape (K,)
        The candidates that were tried, ascending.
    risk : ndarray of shape (K,)
        Their held-out risk per unit of sample weight, in squared units of the action.

    Raises
    ------
    DataError
        Fewer than two folds hold data.
    """
    if decay.n_folds < 2:
        raise DataError(ONE_FOLD)
    grid = np.geomspace(SMALLEST, LARGEST, N_ALPHAS)
    first = int(np.argmin(np.abs(np.log(grid / (near or FIRST_TRIED)))))
    lowest, highest = 0, N_ALPHAS - 1
    if near is not None:
        lowest, highest = max(first - NEAR, lowest), min(first + NEAR, highest)
    trials = Trials(decay, grid)
    with within("choosing λ"):
        trials.walk(first, -2, lowest)
        if trials.best() == first:
            trials.walk(first + 2, 2, highest)
        best = trials.best()
        for beside in (best + 1, best - 1):
            if lowest <= beside <= highest:
                trials.risk(beside, best)
    places = sorted(place for place, risk in trials.risks.items() if np.isfinite(risk))
    if len(places) < len(trials.risks) and trials.best() == min(places, default=trials.best()):
        warnings.warn(
            f"the weight decay may be better smaller than {grid[trials.best()]:.0e}, where this model is not solved in "
            f"{MOST_STEPS:,} passes over the samples: choose fewer centres, or give alpha",
            stacklevel=2,
        )
    risks = np.array([trials.risks[place] for place in places])
    return float(grid[trials.best()]), grid[places], risks / decay.weight


class Trials:
    """Candidates for λ that were tried, by their places in the grid."""

    def __init__(self, decay: WideDecay, grid: np.ndarray):
        self.decay, self.grid = decay, grid
        self.risks: dict[int, float] = {}
        self.left_out = list(range(decay.n_folds))
        self._solutions: dict[int, np.ndarray] = {}
        self._is_solved = True

    def best(self) -> int:
        """Return the place of the largest λ that is as good as any."""
        least = min(self.risks.values())
        return max(place for place, risk in self.risks.items() if risk <= (1 + INDISTINGUISHABLE) * least)

    def walk(self, place: int, stride: int, end: int) -> None:
        """Try candidates from a place on, as long as that may be worth it."""
        idle, before = 0, place
        while (place <= end) if stride > 0 else (place >= end):
            least = min(self.risks.values(), default=np.inf)
            risk = self.risk(place, before)
            idle = 0 if risk < (1 - INDISTINGUISHABLE) * least else idle + 1
            if risk > WORSE * min(least, risk) or idle >= NOT_BETTER or not self._is_solved:
                return
            before, place = place, place + stride

    def risk(self, place: int, beside: int) -> float:
        """Compute the held-out risk of a candidate, beginning from the solutions of another."""
        if place in self.risks:
            return self.risks[place]
        start = self._solutions.get(beside)
        alpha = float(self.grid[place])
        found = self.decay.systems(alpha, self.left_out, start, precision=PRECISION, most_steps=MOST_STEPS)
        self._solutions[place], self._is_solved = found.W, found.is_solved
        held_out = self.decay.passes.held_out_risk(found.W, self.left_out)
        self.risks[place] = float(held_out.sum()) if found.is_solved else np.inf
        return self.risks[place]
