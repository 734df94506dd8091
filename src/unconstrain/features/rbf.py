"""Normalised Gaussian radial basis functions, `b_i(x) = K(x - c_i) / Σ_j K(x - c_j)`. Source: ICRA 2009, Sec. III-A."""

import numpy as np
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.utils.validation import check_is_fitted

from unconstrain.arrays import check_number, check_states, check_weights
from unconstrain.features.centers import place
from unconstrain.receptive import normalized_activations


class NormalizedRBF(TransformerMixin, BaseEstimator):
    """A scikit-learn transformer from states (N, n) to normalised Gaussian RBFs (N, M), whose rows sum to one.

    n_centers: how many centres to place; for "grid" the most that may be, the same number along each dimension.
    width: σ of `exp(-‖x - c‖² / 2σ²)`, in the states' unit; None takes 1.5 times the centres' mean spacing (for
        "coverage": the width that covers).
    centers: "kmeans", "grid" over the data's range, "coverage", or an array (M, n).
    coverage: for "coverage", the activation that every state has in at least one centre.
    random_state: for "kmeans".

    After `fit`: `centers_` (M, n) and `width_`.

    >>> import numpy as np, unconstrain as uc
    >>> b = uc.NormalizedRBF(n_centers=36, centers="grid").fit(np.random.default_rng(0).uniform(size=(100, 2)))
    >>> b.transform([[0.5, 0.5]]).shape
    (1, 36)
    """

    def __init__(self, n_centers=36, *, width=None, centers="kmeans", coverage=0.7, random_state=0):
        self.n_centers = n_centers
        self.width = width
        self.centers = centers
        self.coverage = coverage
        self.random_state = random_state

    def fit(self, X, y=None, sample_weight=None) -> "NormalizedRBF":
        """Place the centres for states X (N, n), weighted (N,); y is ignored. Raises `DataError` or `PolicyError`."""
        X = check_states(self, X, reset=True)
        weights = check_weights(sample_weight, X)
        X, weights = X[weights > 0], weights[weights > 0]
        self.centers_, self.width_ = place(
            X,
            self.centers,
            n_centers=self.n_centers,
            width=None if self.width is None else check_number(self.width, "width", positive=True),
            coverage=self.coverage,
            sample_weight=weights,
            random_state=self.random_state,
        )
        return self

    def transform(self, X) -> np.ndarray:
        """`b(x)` at states X (N, n): (N, M), finite however far a state is from all centres."""
        check_is_fitted(self)
        return normalized_activations(check_states(self, X), self.centers_, self.width_)

    def get_feature_names_out(self, input_features=None) -> np.ndarray:
        """rbf0, rbf1, ..., one name a centre."""
        check_is_fitted(self)
        return np.array([f"rbf{i}" for i in range(len(self.centers_))], dtype=object)
