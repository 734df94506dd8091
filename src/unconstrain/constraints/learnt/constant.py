"""One constraint for all states: the directions in which nothing ever moved."""

import numpy as np

from unconstrain.arrays import check_weights
from unconstrain.constraints.learnt.base import LearntConstraint
from unconstrain.constraints.learnt.spectrum import count, listed
from unconstrain.fitting.solve import EpisodeFolds

JACKKNIFE_FOLDS = 10


class ConstantConstraint(LearntConstraint):
    """``A u = 0`` with A (k, d) the same at all states: the k smallest singular directions of the actions,

        A = argmin_{A Aᵀ = I} Σ_n ‖A u_n‖²,

    eigenvectors of the moments ``Σ u uᵀ``.

    n_constraints: k. None reads it off the spectrum, at the largest jump between neighbouring shares of motion
        (`spectrum.count`).

    After `fit`: `rows_` (k, d), orthonormal, the largest entry of each positive; `n_constraints_`; `shares_` (d,), the
    share of motion along each direction, ascending; `uncertainty_`, the standard error of the rows' direction in
    radians, by leaving out a tenth of the episodes (or blocks) at a time; `reason_`, why so many rows.

    The Matlab library for these methods (``learn_nhat``) searches a grid of angles, row by row; this is the minimum
    itself, in closed form.

    >>> import numpy as np, unconstrain as uc
    >>> U = np.random.default_rng(0).normal(size=(100, 3)) @ uc.constraints.projection([[0.0, 0.6, 0.8]])
    >>> uc.ConstantConstraint().fit(np.zeros((100, 1)), U).rows_.round(6)
    array([[0. , 0.6, 0.8]])
    """

    def __init__(self, n_constraints=None):
        self.n_constraints = n_constraints

    def fit(self, X, U, *, groups=None, sample_weight=None):
        """Learn from actions U (N, d), d > 1, under one constraint; of states X (N, n) only their number matters.

        groups: episodes (N,), for `uncertainty_`; without them contiguous blocks. sample_weight: (N,).

        Raises `DataError` where the actions span everything, are all zero, or are fewer than d; `PolicyError` for a
        number of constraints that is not between 1 and d - 1.
        """
        X, U, groups = self._checked(X, U, groups)
        asked = self._asked(self.n_constraints)
        weighted = U * np.sqrt(check_weights(sample_weight, X))[:, None]
        fold = EpisodeFolds(JACKKNIFE_FOLDS).assign(groups, len(U))
        parts = np.stack([weighted[fold == k].T @ weighted[fold == k] for k in np.unique(fold)])
        # The singular values of the actions themselves are exact to rounding; those of moments to its square root.
        _, values, right = np.linalg.svd(weighted, full_matrices=False)
        energy = values[::-1] ** 2
        self.shares_ = energy / energy.sum()
        if asked is None:
            self.n_constraints_, self.reason_ = count(self.shares_)
        else:
            self.n_constraints_, self.reason_ = asked, f"as asked; shares of motion {listed(self.shares_)}"
        self.rows_ = _signed(right[::-1][: self.n_constraints_])
        self.uncertainty_ = _jackknife(parts, self.rows_)
        return self

    def _rows(self, X: np.ndarray) -> np.ndarray:
        return np.broadcast_to(self.rows_, (len(X), *self.rows_.shape)).copy()


def _signed(rows: np.ndarray) -> np.ndarray:
    """The rows with their largest entry positive: a row and its negative are the same constraint."""
    largest = np.take_along_axis(rows, np.argmax(np.abs(rows), axis=1)[:, None], axis=1)
    return rows * np.sign(largest)


def _jackknife(parts: np.ndarray, rows: np.ndarray) -> float:
    """Standard error (rad) of the rows (k, d): largest angles to those without one of the parts (F, d, d)."""
    if len(parts) < 2:
        return float("nan")
    _, vectors = np.linalg.eigh(parts.sum(axis=0) - parts)
    others = vectors[:, :, : len(rows)]
    outside = others - rows.T @ (rows @ others)
    sines = np.linalg.norm(outside, ord=2, axis=(1, 2))
    angles = np.arcsin(np.minimum(sines, 1.0))
    return float(np.sqrt((len(parts) - 1) / len(parts) * np.sum(angles**2)))
