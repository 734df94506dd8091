"""A policy that is a fitted regressor beside a trend: the model of any regression technique.

    π(x) = prior(x) + f(x)

The prior is linear in its parameters, and says what the policy is in directions that no sample shows. f is a
regressor of anyone's, which learns what the prior leaves.
"""

from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import PolicyError
from unconstrain.fitting.foreign import name_regressor, predict_with
from unconstrain.fitting.model import LinearModel

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Trend:
    """A policy that is linear in its parameters, as a function.

    Parameters
    ----------
    model : LinearModel
        Fitted places.
    w : ndarray
        Its parameters.
    """

    model: LinearModel
    w: Floats

    def __call__(self, X: Floats) -> Floats:
        """Return the actions (N, d) at states X (N, n)."""
        return self.model.evaluate(X, self.w)


@dataclass(frozen=True)
class Regressed:
    """What a regression has for parameters.

    Parameters
    ----------
    regressor : estimator
        Fitted to what the trend leaves.
    trend : Trend, optional
        The prior; none stands for zero.
    """

    regressor: Any
    trend: Trend | None = None


@dataclass(frozen=True)
class Regression:
    """The model of a regressor; see `Model`.

    Parameters
    ----------
    n_states, n_actions : int
        n and d.
    """

    n_states: int
    n_actions: int

    @property
    def scale(self) -> None:
        """None: actions are in their own unit."""
        return

    @property
    def width(self) -> None:
        """None: there are no receptive fields."""
        return

    def evaluate(self, X: Floats, w: Regressed) -> Floats:
        """Evaluate the policy; see `Model.evaluate`."""
        P = predict_with(w.regressor, np.asarray(X, dtype=np.float64), self.n_actions)
        return P if w.trend is None else P + w.trend(X)

    def lay_out(self, X: Floats) -> Floats:
        """Return states as they are; see `Model.lay_out`."""
        return X

    def compile(self, w: Regressed) -> NoReturn:
        """Raise `PolicyError`: a regressor's own `predict` is all there is."""
        raise PolicyError(
            f"a policy made of a {name_regressor(w.regressor)} cannot be compiled: call predict, or fit a "
            "LocallyLinearPolicy to policy.predict(states) of many states, which can"
        )
