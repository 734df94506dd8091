"""Normalised Gaussian radial basis functions, `b_i(x) = K(x - c_i) / Σ_j K(x - c_j)`.

References
----------
Howard et al., ICRA 2009, Sec. III-A.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.utils.validation import check_is_fitted

from unconstrain.arrays import check_states, check_weights
from unconstrain.deploy.compiled import Potential, RadialBasis
from unconstrain.features.centers import place_centers
from unconstrain.receptive import blend, normalized_activations
from unconstrain.undo import undone_on_failure


class NormalizedRBF(TransformerMixin, BaseEstimator):
    """A scikit-learn transformer from states (N, n) to normalised Gaussian RBFs (N, M), whose rows sum to one.

    Parameters
    ----------
    n_centers : int
        How many centres to place; for "grid" the most that may be, the same number along each dimension.
    width : float or array_like of shape (n,), optional
        Width σ of `exp(-‖x - c‖² / 2σ²)`, in the states' unit: one for all dimensions, or one for each. None takes 1.5
        times the centres' mean spacing (for "coverage": the width that covers), with distances in units of each
        dimension's spread.
    centers : {"kmeans", "grid", "coverage"} or array_like of shape (M, n)
        "grid" spans the data's range.
    coverage : float
        For "coverage", the activation that every state has in at least one centre.
    random_state : int, optional
        For "kmeans".

    Attributes
    ----------
    centers_ : ndarray of shape (M, n)
        The centres.
    width_ : ndarray of shape (n,)
        The width σ along each dimension, in its unit.

    Examples
    --------
    >>> import numpy as np, unconstrain as uc
    >>> b = uc.NormalizedRBF(n_centers=36, centers="grid").fit(np.random.default_rng(0).uniform(size=(100, 2)))
    >>> b.transform([[0.5, 0.5]]).shape
    (1, 36)
    """

    def __init__(
        self,
        n_centers: int = 36,
        *,
        width: Any = None,
        centers: Any = "kmeans",
        coverage: float = 0.7,
        random_state: int | None = 0,
    ):
        self.n_centers = n_centers
        self.width = width
        self.centers = centers
        self.coverage = coverage
        self.random_state = random_state

    @undone_on_failure
    def fit(self, X: ArrayLike, y: None = None, sample_weight: ArrayLike | None = None) -> "NormalizedRBF":
        """Place the centres.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.
        y : None
            Ignored.
        sample_weight : array_like of shape (N,), optional
            Weight of each sample, 1 by default.

        Returns
        -------
        self
            Fitted.

        Raises
        ------
        DataError
            The states or weights are not arrays of finite numbers of these shapes.
        PolicyError
            The options place no centres.
        """
        X = check_states(self, X, reset=True)
        weights = check_weights(sample_weight, X)
        X, weights = X[weights > 0], weights[weights > 0]
        self.centers_, self.width_ = place_centers(
            X,
            self.centers,
            n_centers=self.n_centers,
            width=self.width,
            coverage=self.coverage,
            sample_weight=weights,
            random_state=self.random_state,
        )
        return self

    def transform(self, X: ArrayLike) -> np.ndarray:
        """Compute the basis functions at states, finite however far a state is from all centres.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, M)
            `b(x)`.
        """
        check_is_fitted(self)
        return normalized_activations(check_states(self, X), self.centers_, self.width_)

    def blend(self, X: np.ndarray, W: np.ndarray) -> np.ndarray:
        """Compute `W b(x)`, without the basis functions themselves.

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
        actions = np.empty((len(X), len(W)))
        for block, sums, total in blend(X, self.centers_, self.width_, W.T):
            np.divide(sums.T, total[:, None], out=actions[block])
        return actions

    def slopes(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Compute the slopes of all basis functions, `b_i (qᵀc_i - Σ_j b_j qᵀc_j)`, with q and c divided by σ.

        The state drops out, since `∇ log K_i = (c_i - x) / σ²`.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        directions : ndarray of shape (N, n)
            Directions q, one for each state.

        Returns
        -------
        ndarray of shape (N, M)
            `qᵀ∇b_i(x)`.
        """
        B = normalized_activations(X, self.centers_, self.width_)
        # Each is divided by σ: σ² may be more or less than double precision holds.
        pulls = (directions / self.width_) @ self._away.T
        pulls -= np.einsum("nm,nm->n", B, pulls)[:, None]
        B *= pulls
        return B

    def gradient(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Compute the gradient of `wᵀb(x)`.

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
        B = normalized_activations(X, self.centers_, self.width_)
        heights = B @ w
        return ((B * (w - heights[:, None])) @ self._away) / self.width_

    def compile(self, W: np.ndarray) -> RadialBasis:
        """Compile the policy `W b(x)`.

        Parameters
        ----------
        W : ndarray of shape (d, M)
            Weights of the basis functions, a row for each action.

        Returns
        -------
        RadialBasis
            The same policy, as arrays.
        """
        return RadialBasis(centers=self.centers_, width=self.width_, weights=W)

    def compile_descent(self, w: np.ndarray) -> Potential:
        """Compile the policy `-∇ wᵀb(x)`.

        Parameters
        ----------
        w : ndarray of shape (M,)
            Weights of the basis functions.

        Returns
        -------
        Potential
            The same policy, as arrays.
        """
        return Potential(centers=self.centers_, width=self.width_, weights=w)

    @property
    def _away(self) -> np.ndarray:
        """The centres, counted from their mean in units of σ: a far origin would cost digits."""
        return (self.centers_ - self.centers_.mean(axis=0)) / self.width_

    def get_feature_names_out(self, input_features: Any = None) -> np.ndarray:
        """Name the outputs rbf0, rbf1, ..., one for each centre.

        Parameters
        ----------
        input_features : None
            Ignored.

        Returns
        -------
        ndarray of shape (M,), str
            Names.
        """
        check_is_fitted(self)
        return np.array([f"rbf{i}" for i in range(len(self.centers_))], dtype=object)
