"""The protocol: a policy that is linear in its parameters is a feature map seen along a direction.

For any policy `pi(x) = Φ(x) w`, with `Φ` the d x P matrix of features, an observer who looks along a
direction q sees `qᵀ pi(x) = v(x, q)ᵀ w` with `v = Φᵀ q`. Learning needs nothing but `v`; full, decoupled and
potential features differ in nothing else.
"""

from typing import Protocol, runtime_checkable

import numpy as np
from sklearn.base import clone
from sklearn.utils.validation import has_fit_parameter

from unconstrain.errors import PolicyError


@runtime_checkable
class PolicyFeatures(Protocol):
    """Features of a policy that is linear in its P parameters."""

    n_parameters_: int
    """P, known once fitted."""

    def fit(self, X: np.ndarray, d: int, sample_weight: np.ndarray | None = None) -> "PolicyFeatures":
        """Fix what depends on data (centres, knots) from states X (N, n), for actions of dimension d."""
        ...

    def along(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """`v(x, q)` for states X (N, n) and one direction each (N, d): an array V (N, P) with `V w = qᵀ pi(x)`."""
        ...

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """The policy itself, `pi(x) = Φ(x) w`: actions (N, d) at states X (N, n) for parameters w (P,)."""
        ...


def is_policy_features(candidate) -> bool:
    """Whether `candidate`, fitted or not, speaks the protocol; the number of parameters is known only once fitted."""
    named = all(callable(getattr(candidate, name, None)) for name in ("fit", "along", "evaluate"))
    return named and not isinstance(candidate, type)


def fitted(transformer, X: np.ndarray, sample_weight: np.ndarray | None):
    """A copy of a scikit-learn transformer, fitted to states X (N, n), with weights (N,) where it takes them."""
    weighted = sample_weight is not None and has_fit_parameter(transformer, "sample_weight")
    return clone(transformer).fit(X, **({"sample_weight": sample_weight} if weighted else {}))


def check_square(name: str, X: np.ndarray, d: int) -> None:
    """Raise a `PolicyError` where states X (N, n) and actions of dimension d do not pair up."""
    if X.shape[1] != d:
        raise PolicyError(
            f"{name} needs as many actions as states, in the same order, got {X.shape[1]} states and {d} actions: "
            "give the columns that belong together, or choose other features"
        )
