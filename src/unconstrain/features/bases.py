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
