"""What a basis `b(x)`, a transformer, may be able to do besides `transform`.

Each is a method that the transformer has or has not:

| method                   | what for                                                                  |
| ------------------------ | ------------------------------------------------------------------------- |
| `slopes(X, directions)`  | potentials learn from `qᵀ∇b_i(x)`, along one direction a sample            |
| `gradient(X, w)`         | potentials act by `∇ wᵀb(x)`; neither needs the Jacobians of all samples   |
| `compile(W)`             | the policy `W b(x)` for a control loop                                    |
| `compile_descent(w)`     | the policy `-∇ wᵀb(x)` for a control loop                                 |

`NormalizedRBF` has all of them. Two of scikit-learn's transformers have none by themselves; a table gives theirs:
`SplineTransformer`, all of them, unless it is periodic or ends with an error, and `PolynomialFeatures`, the first two.
"""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from sklearn.preprocessing import PolynomialFeatures, SplineTransformer

from unconstrain.errors import PolicyError
from unconstrain.features.polynomials import Polynomials
from unconstrain.features.scaling import Scaling
from unconstrain.features.splines import EXTRAPOLATIONS, Splines

if TYPE_CHECKING:
    from unconstrain.deploy.compiled import CompiledPolicy


@runtime_checkable
class Differentiable(Protocol):
    """A basis whose derivatives are known."""

    def slopes(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Compute `qᵀ∇b_i(x)`.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        directions : ndarray of shape (N, n)
            Directions q, one for each state.

        Returns
        -------
        ndarray of shape (N, M)
            The caller may change it.
        """
        ...

    def gradient(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Compute `∇ wᵀb(x)`.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        w : ndarray of shape (M,)
            Weights of the basis functions.

        Returns
        -------
        ndarray of shape (N, n)
            The gradient at each state.
        """
        ...


@runtime_checkable
class Compilable(Protocol):
    """A basis of which `W b(x)` can be compiled."""

    def compile(self, W: np.ndarray) -> "CompiledPolicy":
        """Compile `W b(x)`.

        Parameters
        ----------
        W : ndarray of shape (d, M)
            Weights of the basis functions, a row for each action.

        Returns
        -------
        CompiledPolicy
            The same policy, as arrays.

        Raises
        ------
        PolicyError
            It cannot be compiled after all.
        """
        ...


@runtime_checkable
class Blending(Protocol):
    """A basis that computes `W b(x)` faster than by way of `b(x)`."""

    def blend(self, X: np.ndarray, W: np.ndarray) -> np.ndarray:
        """Compute `W b(x)`.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        W : ndarray of shape (d, M)
            Weights of the basis functions, a row for each action.

        Returns
        -------
        ndarray of shape (N, d)
            Actions.
        """
        ...


@runtime_checkable
class CompilableDescent(Protocol):
    """A basis of which `-∇ wᵀb(x)` can be compiled."""

    def compile_descent(self, w: np.ndarray) -> "CompiledPolicy":
        """Compile `-∇ wᵀb(x)`.

        Parameters
        ----------
        w : ndarray of shape (M,)
            Weights of the basis functions.

        Returns
        -------
        CompiledPolicy
            The same policy, as arrays.
        """
        ...


def _splines(transformer: SplineTransformer) -> Any:
    return Splines(transformer) if transformer.extrapolation in EXTRAPOLATIONS else transformer


ADAPTERS: Mapping[type, Callable[[Any], Any]] = {
    SplineTransformer: _splines,
    PolynomialFeatures: Polynomials,
}


def adapted(transformer: Any) -> Any:
    """Find the object whose methods say what a transformer can do.

    Parameters
    ----------
    transformer : transformer

    Returns
    -------
    object
        The transformer itself, but for those of scikit-learn's in the table.
    """
    return ADAPTERS.get(type(transformer), lambda itself: itself)(transformer)


def scaling_for(
    transformer: Any, X: np.ndarray, sample_weight: np.ndarray | None = None, *, constant: bool = True
) -> Scaling | None:
    """Choose what a transformer gets in place of the states.

    Polynomials of standardised states are the same policies as polynomials of the states, and do not hang on units.
    `NormalizedRBF` and splines are placed among the states whatever their units, and of any other transformer it is
    not known whether it means the numbers as they are.

    Parameters
    ----------
    transformer : transformer
        Not fitted.
    X : ndarray of shape (N, n)
        States.
    sample_weight : ndarray of shape (N,), optional
        Weight of each sample, 1 by default.
    constant : bool
        Whether a constant matters; it does not to a potential.

    Returns
    -------
    Scaling or None
        None for the states as they are.
    """
    if type(transformer) is not PolynomialFeatures:
        return None
    scaling = Scaling.of(X, sample_weight)
    lowest = 0 if np.ndim(transformer.degree) == 0 else transformer.degree[0]
    if lowest <= 1 and (transformer.include_bias or not constant):
        return scaling
    # Without a constant or linear terms, polynomials of moved states are other policies: the origin is the user's.
    return Scaling(np.zeros_like(scaling.mean), np.hypot(scaling.spread, scaling.mean))


def constant_outputs(transformer: Any) -> np.ndarray:
    """Find the outputs of a fitted transformer that are known to be one at every state.

    Parameters
    ----------
    transformer : transformer
        Fitted.

    Returns
    -------
    ndarray of int
        Their columns. Where functions add up to a constant, as RBFs and splines do, there is none.
    """
    if type(transformer) is not PolynomialFeatures:
        return np.zeros(0, dtype=int)
    return np.flatnonzero(transformer.powers_.sum(axis=1) == 0)


def differentiable(transformer: Any) -> Differentiable:
    """Find the object that knows a transformer's derivatives.

    Parameters
    ----------
    transformer : transformer

    Returns
    -------
    Differentiable

    Raises
    ------
    PolicyError
        Its derivatives are not known.
    """
    found = adapted(transformer)
    if isinstance(found, Differentiable):
        return found
    raise PolicyError(
        "a potential needs the gradient of its basis, known for NormalizedRBF, PolynomialFeatures, SplineTransformer "
        f"(with extrapolation {', '.join(map(repr, EXTRAPOLATIONS))}), and transformers with methods slopes and "
        f"gradient, got {_shown(transformer)}"
    )


def compilation_error(transformer: Any) -> PolicyError:
    """Build the error that says a policy on a transformer cannot be compiled.

    Parameters
    ----------
    transformer : transformer

    Returns
    -------
    PolicyError
    """
    return PolicyError(
        "linear, NormalizedRBF, SplineTransformer (with extrapolation "
        f"{', '.join(map(repr, EXTRAPOLATIONS))}), decoupled, potential (of RBFs or splines) and locally linear "
        f"policies can be compiled, one with {_shown(transformer)} cannot: use predict, or one of those"
    )


def _shown(transformer: Any) -> str:
    return f"{' '.join(repr(transformer).split()):.80}"
