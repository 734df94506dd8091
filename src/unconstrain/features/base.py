"""The protocol: a policy that is linear in its parameters is a feature map taken along a direction.

For any policy `π(x) = Φ(x) w`, with `Φ` the d x P matrix of features, an observation along a direction q is
`qᵀπ(x) = v(x, q)ᵀ w` with `v = Φᵀ q`. Learning needs only `v`, and only in `v` do full, decoupled and potential
features differ.

A feature map has three methods, and may have more. Each further method is a capability, which is there or is not:

| method                          | needed | who calls it                                                            |
| ------------------------------- | ------ | ------------------------------------------------------------------------ |
| `fit(X, d)`                     | yes    | a policy, once, before any sample is added                                |
| `along(X, directions)`          | yes    | everything that adds up samples or measures uncertainty                   |
| `evaluate(X, w)`                | yes    | `predict`                                                                 |
| `basis(X)`                      | no     | the fast kernels: it says that `π(x) = W b(x)` with W free      |
| `decay_basis(second)`           | no     | the weight decay: how a basis is standardised, its intercepts            |
| `linear(w)`                     | no     | `coef_` and `intercept_`, and compiling local models                      |
| `compile(w)`                    | no     | `policy.compile()`, for the control loop                                  |

`fit` may take `sample_weight` as a third argument.
"""

from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from sklearn.base import clone
from sklearn.utils.validation import has_fit_parameter

from unconstrain.errors import PolicyError

if TYPE_CHECKING:
    from unconstrain.deploy.compiled import CompiledPolicy


@runtime_checkable
class Features(Protocol):
    """A feature map of P parameters, in the order in which `along` returns them."""

    def fit(self, X: np.ndarray, d: int) -> Any:
        """Fix what depends on data, such as centres and knots.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        d : int
            Dimension of the actions.

        Returns
        -------
        self
            Fitted.
        """
        ...

    def along(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Compute the features along one direction at each state.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        directions : ndarray of shape (N, d)
            Of any length.

        Returns
        -------
        ndarray of shape (N, P)
            V, with `V w = qᵀπ(x)`.
        """
        ...

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Evaluate the policy.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        w : ndarray of shape (P,)
            Parameters.

        Returns
        -------
        ndarray of shape (N, d)
            `π(x) = Φ(x) w`.
        """
        ...


@runtime_checkable
class FullBasis(Features, Protocol):
    """A feature map whose policy is `π(x) = W b(x)`, W (d, M) free, with parameters in the order of W's rows."""

    def basis(self, X: np.ndarray) -> np.ndarray:
        """Compute the basis that all actions share.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States, of any precision.

        Returns
        -------
        ndarray of shape (N, M)
            `b(x)`, in double precision.
        """
        ...


@runtime_checkable
class Decaying(Protocol):
    """A basis of which not every combination decays alike. Without this method every parameter does."""

    def decay_basis(self, second: np.ndarray) -> tuple[np.ndarray | None, np.ndarray]:
        """Say which combinations of the basis functions the weight decay acts on.

        Parameters
        ----------
        second : ndarray of shape (M, M)
            Sum of `b(x) b(x)ᵀ` over the samples.

        Returns
        -------
        basis : ndarray of shape (M, M) or None
            B: in each row of W the decay acts on w' with `w = B w'`. None for the identity.
        intercepts : ndarray of shape (M,), bool
            Which w' are intercepts, that hardly decay.
        """
        ...


@runtime_checkable
class LinearInState(Protocol):
    """A feature map whose policy is `W x + t`."""

    def linear(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Split parameters into slopes and intercepts, in the units of the user's states.

        Parameters
        ----------
        w : ndarray of shape (..., P)
            Parameters.

        Returns
        -------
        tuple of ndarray of shape (..., d, n) and ndarray of shape (..., d), or None
            None where the policy is not linear in the state after all.
        """
        ...


@runtime_checkable
class Compilable(Protocol):
    """A feature map that can be compiled for a control loop."""

    def compile(self, w: np.ndarray) -> "CompiledPolicy":
        """Turn the policy with these parameters into arrays.

        Parameters
        ----------
        w : ndarray of shape (P,)
            Parameters.

        Returns
        -------
        CompiledPolicy
            That agrees with `evaluate`.

        Raises
        ------
        PolicyError
            These features cannot be compiled.
        """
        ...


def is_feature_map(candidate: object) -> bool:
    """Whether an object, fitted or not, has the three methods of a feature map.

    Parameters
    ----------
    candidate : object
        Any.

    Returns
    -------
    bool
        False for classes.
    """
    return isinstance(candidate, Features) and not isinstance(candidate, type)


def fit_features(features: Any, X: np.ndarray, d: int, sample_weight: np.ndarray | None = None) -> Features:
    """Fit a copy of a feature map.

    Parameters
    ----------
    features : Features
        Left as it is.
    X : ndarray of shape (N, n)
        States.
    d : int
        Dimension of the actions.
    sample_weight : ndarray of shape (N,), optional
        Passed on where `fit` takes it.

    Returns
    -------
    Features
        The fitted copy.
    """
    copy = clone(features, safe=False)
    weighted = sample_weight is not None and has_fit_parameter(copy, "sample_weight")
    copy.fit(X, d, **({"sample_weight": sample_weight} if weighted else {}))
    return copy


def fit_transformer(transformer: Any, X: np.ndarray, sample_weight: np.ndarray | None = None) -> Any:
    """Fit a copy of a scikit-learn transformer.

    Parameters
    ----------
    transformer : transformer
        Left as it is.
    X : ndarray of shape (N, n)
        States.
    sample_weight : ndarray of shape (N,), optional
        Passed on where `fit` takes it.

    Returns
    -------
    transformer
        The fitted copy.
    """
    weighted = sample_weight is not None and has_fit_parameter(transformer, "sample_weight")
    return clone(transformer).fit(X, **({"sample_weight": sample_weight} if weighted else {}))


def check_square(name: str, X: np.ndarray, d: int) -> None:
    """Refuse states and actions that do not pair up.

    Parameters
    ----------
    name : str
        Of the features, for the sentence.
    X : ndarray of shape (N, n)
        States.
    d : int
        Dimension of the actions.

    Raises
    ------
    PolicyError
        d is not n.
    """
    if X.shape[1] != d:
        raise PolicyError(
            f"{name} needs as many actions as states, in the same order, got {X.shape[1]} states and {d} actions: "
            "give the columns that belong together, or choose other features"
        )
