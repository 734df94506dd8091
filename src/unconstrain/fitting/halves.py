"""Predictions of samples by regressors that have not seen them.

A regressor that can be as wiggly as it likes reproduces the targets of its own samples: completed by what it says of
them, they would stay what they are, and any action would look free. So all samples are dealt out in two halves, and the
regressor that is fitted to one half predicts the other. They are dealt out anew each time, so that what one half knows
reaches all of the other in a few rounds.
"""

import inspect
import warnings
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone
from sklearn.compose import TransformedTargetRegressor
from sklearn.exceptions import ConvergenceWarning
from sklearn.multioutput import MultiOutputRegressor
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import Pipeline
from sklearn.utils import get_tags

from unconstrain.errors import PolicyError

Floats = NDArray[np.float64]

GROWS = {"n_estimators", "max_leaf_nodes"}
"""Parameters of regressors whose warm start adds trees to those of earlier targets, which would be wrong ever after."""


def as_multi_output(regressor: Any, n_actions: int) -> Any:
    """Return a regressor that takes several targets: itself, or one of it for each.

    Parameters
    ----------
    regressor : estimator
        Of scikit-learn's interface.
    n_actions : int
        How many targets.

    Returns
    -------
    estimator
        Not fitted.
    """
    last = regressor[-1] if isinstance(regressor, Pipeline) else regressor
    # Networks take several targets, though their tags do not say so.
    is_network = isinstance(last, MLPRegressor)
    if n_actions == 1 or is_network or get_tags(regressor).target_tags.multi_output:
        return regressor
    return MultiOutputRegressor(regressor)


def find_weight_option(regressor: Any) -> str | None:
    """Find the argument of a regressor's `fit` that takes sample weights.

    Parameters
    ----------
    regressor : estimator
        As `as_multi_output` returns it.

    Returns
    -------
    str or None
        Its name, which in pipelines is that of the last step's; None where there is none.
    """
    prefix, inner = "", regressor
    while isinstance(inner, MultiOutputRegressor | TransformedTargetRegressor | Pipeline):
        if isinstance(inner, Pipeline):
            prefix, inner = f"{prefix}{inner.steps[-1][0]}__", inner.steps[-1][1]
        else:
            inner = inner.estimator if isinstance(inner, MultiOutputRegressor) else inner.regressor
            if isinstance(inner, Pipeline):  # neither of the two hands on what a pipeline would understand
                return None
    takes = "sample_weight" in inspect.signature(inner.fit).parameters
    return f"{prefix}sample_weight" if takes else None


def goes_on(regressor: Any) -> bool:
    """Tell whether a regressor can begin a fit where its last one ended, whatever the targets were then.

    Parameters
    ----------
    regressor : estimator
        Of scikit-learn's interface.

    Returns
    -------
    bool
        True for those that descend and have `warm_start`, such as networks; not for those that would add trees.
    """
    last = regressor[-1] if isinstance(regressor, Pipeline) else regressor
    options = last.get_params(deep=False) if hasattr(last, "get_params") else {}
    return "warm_start" in options and not GROWS & set(options)


def fit_regressor(regressor: Any, Z: Floats, Y: Floats, weights: Floats | None) -> Any:
    """Fit a regressor.

    Parameters
    ----------
    regressor : estimator
        Is fitted itself.
    Z : ndarray of shape (N, n)
        States.
    Y : ndarray of shape (N, d)
        Targets.
    weights : ndarray of shape (N,), optional
        Of the samples.

    Returns
    -------
    estimator
        The regressor.

    Raises
    ------
    PolicyError
        The regressor refuses; its own sentence is passed on.
    """
    targets = Y[:, 0] if Y.shape[1] == 1 else Y
    option = None if weights is None else find_weight_option(regressor)
    options = {} if option is None else {option: weights}
    try:
        with warnings.catch_warnings():
            # A fit that is but a step on the way need not converge, and its regressor warns each time.
            warnings.simplefilter("ignore", ConvergenceWarning)
            regressor.fit(Z, targets, **options)
    except (ValueError, TypeError) as error:
        sentence = " ".join(str(error).split())
        raise PolicyError(f"the {type(regressor).__name__} cannot be fitted: {sentence:.300}") from error
    return regressor


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
        N = len(targets)
        is_first = self._deal(N)
        P = np.empty_like(targets)
        for half, learns in enumerate((is_first, ~is_first)):
            weights = None if self.weights is None else self.weights[learns]
            fitted = fit_regressor(self._make(half), self.states[learns], targets[learns], weights)
            P[~learns] = np.reshape(fitted.predict(self.states[~learns]), (-1, targets.shape[1]))
            self.n_fits += 1
        return P

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
