"""Covariances of policies, as kernels of scikit-learn.

A Gaussian process over policies says how `qᵀπ(x)` and `q'ᵀπ(x')` vary together: a kernel on pairs (x, q) of a state and
a direction. Its inputs are rows `(x, q)`, the state's columns first, so any `GaussianProcessRegressor` learns from
observations along directions as it does from others: sums, products and powers of kernels, their hyperparameters and
gradients are scikit-learn's own.

| kernel                | cov(qᵀπ(x), q'ᵀπ(x')), `Δ = x - x'`           | policies                           |
| --------------------- | --------------------------------------------- | ---------------------------------- |
| `Separable(k)`        | `qᵀq' k(x, x')`                               | each action like any other         |
| `CurlFree(ℓ)`         | `qᵀ (I - Δ Δᵀ / ℓ²) q' exp(-‖Δ‖² / 2ℓ²)`      | gradients of a smooth potential    |
| `CurlFreeQuadratic()` | `(qᵀq') (xᵀx') + (qᵀx') (xᵀq')`               | gradients of a quadratic potential |

The last two are `∂²k / ∂x ∂x'` seen along q and q', of a kernel k of potentials: `ℓ² exp(-‖x - x'‖² / 2ℓ²)` and
`(xᵀx')² / 2`.

References
----------
Alvarez, Rosasco, Lawrence, Kernels for vector-valued functions: a review, Foundations and Trends in Machine Learning
4, 2012. Macêdo, Castro, Learning divergence-free and curl-free vector fields with matrix-valued kernels, IMPA, 2010.
"""

from typing import Any

import numpy as np
from sklearn.gaussian_process.kernels import Hyperparameter, Kernel

from unconstrain.gaussian_process.pairs import split

Array = np.ndarray


class Separable(Kernel):
    """The covariance `qᵀq' k(x, x')`: all actions vary alike, and apart from each other.

    Parameters
    ----------
    kernel : Kernel
        Any of scikit-learn's over states, k.
    n_actions : int, optional
        How many of the last columns are the direction; by default half of them. A policy sets it.

    Examples
    --------
    >>> import numpy as np
    >>> from sklearn.gaussian_process.kernels import RBF
    >>> import unconstrain as uc
    >>> rows = np.array([[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.6, 0.8]])     # one state, two directions
    >>> uc.kernels.Separable(RBF())(rows).round(2).tolist()
    [[1.0, 0.6], [0.6, 1.0]]
    """

    def __init__(self, kernel: Kernel, n_actions: int | None = None):
        self.kernel = kernel
        self.n_actions = n_actions

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Return the parameters, those of k by the name `kernel__...`; see scikit-learn.

        Parameters
        ----------
        deep : bool
            Whether to return those of k.

        Returns
        -------
        dict of str to object
            Values by name.
        """
        own = {"kernel": self.kernel, "n_actions": self.n_actions}
        if deep:
            own |= {f"kernel__{name}": value for name, value in self.kernel.get_params().items()}
        return own

    @property
    def hyperparameters(self) -> list[Hyperparameter]:
        """Those of k."""
        return [
            Hyperparameter(f"kernel__{each.name}", each.value_type, each.bounds, each.n_elements)
            for each in self.kernel.hyperparameters
        ]

    @property
    def theta(self) -> Array:
        """Logarithms of the hyperparameters that are not fixed."""
        return self.kernel.theta

    @theta.setter
    def theta(self, theta: Array) -> None:
        self.kernel.theta = theta

    @property
    def bounds(self) -> Array:
        """Between which they are searched, as logarithms."""
        return self.kernel.bounds

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self.kernel == other.kernel and self.n_actions == other.n_actions

    def __call__(self, X: Array, Y: Array | None = None, eval_gradient: bool = False) -> Any:
        """Compute covariances of rows with others, and their gradient by `theta`.

        Parameters
        ----------
        X : ndarray of shape (N, n + d)
            Rows (x, q).
        Y : ndarray of shape (M, n + d), optional
            Others; by default the same.
        eval_gradient : bool
            Whether to return the gradient too, with respect to `theta`.

        Returns
        -------
        K : ndarray of shape (N, M)
            Covariances.
        gradient : ndarray of shape (N, N, p)
            Where asked for.
        """
        x, q = split(X, self.n_actions)
        y, p = (x, q) if Y is None else split(Y, self.n_actions)
        along = q @ p.T
        if not eval_gradient:
            return along * self.kernel(x, None if Y is None else y)
        value, gradient = self.kernel(x, eval_gradient=True)
        return along * value, along[:, :, None] * gradient

    def diag(self, X: Array) -> Array:
        """Compute the variances of rows.

        Parameters
        ----------
        X : ndarray of shape (N, n + d)
            Rows (x, q).

        Returns
        -------
        ndarray of shape (N,)
            Variances.
        """
        x, q = split(X, self.n_actions)
        return np.einsum("nd,nd->n", q, q) * self.kernel.diag(x)

    def is_stationary(self) -> bool:
        """Return False: what a row varies by hangs on its direction.

        Returns
        -------
        bool
            False.
        """
        return False

    def __repr__(self) -> str:
        return f"Separable({self.kernel!r})"


class CurlFree(Kernel):
    """The covariance of gradients of a smooth potential, `qᵀ (I - Δ Δᵀ / ℓ²) q' exp(-‖Δ‖² / 2ℓ²)`.

    Actions belong to states here, one to each in the same order.

    Parameters
    ----------
    length_scale : float
        Width ℓ, in the unit of the states.
    length_scale_bounds : pair of float, or "fixed"
        Between which it is searched.
    """

    def __init__(
        self, length_scale: float = 1.0, length_scale_bounds: tuple[float, float] | str = (1e-2, 1e2)
    ):
        self.length_scale = length_scale
        self.length_scale_bounds = length_scale_bounds

    @property
    def hyperparameter_length_scale(self) -> Hyperparameter:
        """The width ℓ, as scikit-learn sees it."""
        return Hyperparameter("length_scale", "numeric", self.length_scale_bounds)

    def __call__(self, X: Array, Y: Array | None = None, eval_gradient: bool = False) -> Any:
        """Compute covariances of rows with others, and their gradient by `log ℓ`.

        Parameters
        ----------
        X : ndarray of shape (N, 2n)
            Rows (x, q).
        Y : ndarray of shape (M, 2n), optional
            Others; by default the same.
        eval_gradient : bool
            Whether to return the gradient too, with respect to `theta`.

        Returns
        -------
        K : ndarray of shape (N, M)
            Covariances.
        gradient : ndarray of shape (N, N, p)
            Where asked for.
        """
        x, q = split(X, None)
        y, p = (x, q) if Y is None else split(Y, None)
        square = _squared_distances(x, y) / self.length_scale**2
        decay = np.exp(-0.5 * square)
        ahead = np.einsum("nd,nd->n", q, x)[:, None] - q @ y.T
        behind = x @ p.T - np.einsum("nd,nd->n", y, p)
        turned = ahead * behind / self.length_scale**2
        value = decay * (q @ p.T - turned)
        if not eval_gradient:
            return value
        if self.hyperparameter_length_scale.fixed:
            return value, np.empty((*value.shape, 0))
        return value, (square * value + 2 * decay * turned)[:, :, None]

    def diag(self, X: Array) -> Array:
        """Compute the variances of rows.

        Parameters
        ----------
        X : ndarray of shape (N, 2n)
            Rows (x, q).

        Returns
        -------
        ndarray of shape (N,)
            Variances.
        """
        _, q = split(X, None)
        return np.einsum("nd,nd->n", q, q)

    def is_stationary(self) -> bool:
        """Return False: what a row varies by hangs on its direction.

        Returns
        -------
        bool
            False.
        """
        return False

    def __repr__(self) -> str:
        return f"CurlFree(length_scale={self.length_scale:.3g})"


class CurlFreeQuadratic(Kernel):
    """The covariance of `π(x) = S x` with a symmetric S, `(qᵀq') (xᵀx') + (qᵀx') (xᵀq')`. It has no hyperparameters."""

    def __init__(self) -> None:
        # Kernels list their parameters by the signature, and that of `object` takes anything.
        pass

    def __getstate__(self) -> dict[str, Any]:
        # Of an object without attributes the default is None, which files do not take for a state.
        return {}

    def __call__(self, X: Array, Y: Array | None = None, eval_gradient: bool = False) -> Any:
        """Compute covariances of rows with others; the gradient has no columns.

        Parameters
        ----------
        X : ndarray of shape (N, 2n)
            Rows (x, q).
        Y : ndarray of shape (M, 2n), optional
            Others; by default the same.
        eval_gradient : bool
            Whether to return the gradient too, with respect to `theta`.

        Returns
        -------
        K : ndarray of shape (N, M)
            Covariances.
        gradient : ndarray of shape (N, N, p)
            Where asked for.
        """
        x, q = split(X, None)
        y, p = (x, q) if Y is None else split(Y, None)
        value = (q @ p.T) * (x @ y.T) + (q @ y.T) * (x @ p.T)
        return (value, np.empty((*value.shape, 0))) if eval_gradient else value

    def diag(self, X: Array) -> Array:
        """Compute the variances of rows.

        Parameters
        ----------
        X : ndarray of shape (N, 2n)
            Rows (x, q).

        Returns
        -------
        ndarray of shape (N,)
            Variances.
        """
        x, q = split(X, None)
        squares = np.einsum("nd,nd->n", q, q) * np.einsum("nd,nd->n", x, x)
        return squares + np.einsum("nd,nd->n", q, x) ** 2

    def is_stationary(self) -> bool:
        """Return False: policies grow with the state.

        Returns
        -------
        bool
            False.
        """
        return False

    def __repr__(self) -> str:
        return "CurlFreeQuadratic()"


def _squared_distances(x: Array, y: Array) -> Array:
    from scipy.spatial.distance import cdist

    return cdist(x, y, "sqeuclidean")
