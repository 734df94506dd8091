"""What is asked of a regressor of anyone's, and what becomes of its errors: one sentence that names it."""

import inspect
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.compose import TransformedTargetRegressor
from sklearn.exceptions import ConvergenceWarning
from sklearn.linear_model import LinearRegression
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
            is_each = isinstance(inner, MultiOutputRegressor)
            inner = inner.estimator if is_each else inner.regressor or LinearRegression()
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
            # It may work in place.
            regressor.fit(Z.copy(), targets.copy(), **options)
    except Exception as error:  # of any kind: the regressor may be anyone's
        raise PolicyError(
            f"the {name_regressor(regressor)} cannot be fitted to {len(Z)} samples: {_shorten(error)}"
        ) from error
    return regressor


def predict_with(regressor: Any, Z: Floats, n_actions: int) -> Floats:
    """Predict by a fitted regressor.

    Parameters
    ----------
    regressor : estimator
        Fitted.
    Z : ndarray of shape (N, n)
        States; they stay as they are.
    n_actions : int
        d.

    Returns
    -------
    ndarray of shape (N, d)
        Finite.

    Raises
    ------
    PolicyError
        The regressor refuses, or predicts something else.
    """
    name = name_regressor(regressor)
    try:
        P = np.asarray(regressor.predict(Z.copy()), dtype=np.float64)
    except Exception as error:
        raise PolicyError(f"the {name} cannot predict {len(Z)} samples: {_shorten(error)}") from error
    if P.shape not in ((len(Z), n_actions), (len(Z),) if n_actions == 1 else ()):
        raise PolicyError(f"the {name} predicts an array of shape {P.shape}, not {(len(Z), n_actions)}")
    P = P.reshape(len(Z), n_actions)
    wrong = int(np.sum(~np.isfinite(P).all(axis=1)))
    if wrong:
        raise PolicyError(f"the {name} predicts NaN or infinity for {wrong} of {len(Z)} samples")
    return P


def name_regressor(regressor: Any) -> str:
    """Return the name of the class that the user gave.

    Parameters
    ----------
    regressor : estimator
        As `as_multi_output` returns it.

    Returns
    -------
    str
        Without the wrapper of those that take a single target.
    """
    inner = regressor.estimator if isinstance(regressor, MultiOutputRegressor) else regressor
    return type(inner).__name__


def _shorten(error: Exception) -> str:
    return f"{' '.join(str(error).split()):.300}"
