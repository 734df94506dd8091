"""Predictions of samples by regressors that have not seen them.

A regressor that can be as wiggly as it likes reproduces the targets of its own samples: completed by what it says of
them, they would stay what they are, and any action would look free. So all samples are dealt out in two halves, and the
regressor that is fitted to one half predicts the other. They are dealt out anew each time, so that what one half knows
reaches all of the other in a few rounds.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone
from sklearn.pipeline import Pipeline

from unconstrain.fitting.foreign import fit_regressor, goes_on, predict_with

Floats = NDArray[np.float64]


@dataclass
class Halves:
    """Fits a regressor to halves of the samples.

    Parameters
    ----------
    regressor : estimator
        That takes several targets. It is cloned, never fitted itself.
    states : ndarray of shape (N, n)
        At least two.
    weights : ndarray of shape (N,), optional
        Of the samples.
    random : Generator
        By which samples are dealt out.
    """

    regressor: Any
    states: Floats
    weights: Floats | None
    random: np.random.Generator
    n_fits: int = 0
    _kept: dict[int, Any] = field(default_factory=dict)
    _first: NDArray[np.bool_] | None = None

    def predict(self, targets: Floats) -> Floats:
        """Predict each sample by a regressor that was fitted to the targets of the other half.

        A regressor that goes on from its last fit keeps its half, or it would remember the other.

        Parameters
        ----------
        targets : ndarray of shape (N, d)
            Of all samples.

        Returns
        -------
        ndarray of shape (N, d)
            Predictions.

        Raises
        ------
        PolicyError
            The regressor cannot be fitted.
        """
        return self._cross(targets, self._deal(len(targets)), self._make)

    def predict_across(self, targets: Floats, is_first: NDArray[np.bool_]) -> Floats:
        """Predict each sample by a regressor that was fitted to the targets of a half that it is not in.

        Parameters
        ----------
        targets : ndarray of shape (N, d)
            Of all samples.
        is_first : ndarray of shape (N,), bool
            Which samples are in the first half.

        Returns
        -------
        ndarray of shape (N, d)
            Predictions.
        """
        return self._cross(targets, is_first, lambda half: clone(self.regressor))

    def finish(self, targets: Floats) -> Any:
        """Fit the regressor to all samples.

        Parameters
        ----------
        targets : ndarray of shape (N, d)
            Of all samples.

        Returns
        -------
        estimator
            Fitted.
        """
        self.n_fits += 1
        return fit_regressor(clone(self.regressor), self.states, targets, self.weights)

    def _cross(self, targets: Floats, is_first: NDArray[np.bool_], make: Callable[[int], Any]) -> Floats:
        P = np.empty_like(targets)
        for half, learns in enumerate((is_first, ~is_first)):
            weights = None if self.weights is None else self.weights[learns]
            fitted = fit_regressor(make(half), self.states[learns], targets[learns], weights)
            P[~learns] = predict_with(fitted, self.states[~learns], targets.shape[1])
            self.n_fits += 1
        return P

    def _deal(self, N: int) -> NDArray[np.bool_]:
        if self._first is not None:
            return self._first
        is_first = self.random.permutation(N) < (N + 1) // 2
        if goes_on(self.regressor):
            self._first = is_first
        return is_first

    def _make(self, half: int) -> Any:
        if not goes_on(self.regressor):
            return clone(self.regressor)
        if half not in self._kept:
            fresh = clone(self.regressor)
            prefix = f"{fresh.steps[-1][0]}__" if isinstance(fresh, Pipeline) else ""
            self._kept[half] = fresh.set_params(**{f"{prefix}warm_start": True})
        return self._kept[half]
