"""One constraint for all states: the directions in which nothing ever moved."""

from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils.validation import check_is_fitted

from unconstrain.arrays import check_names, check_weights
from unconstrain.constraints.learnt.base import LearntConstraint
from unconstrain.constraints.learnt.lines import equation
from unconstrain.constraints.learnt.spectrum import count_constrained, format_shares
from unconstrain.errors import DataError
from unconstrain.fitting.solve import EpisodeFolds
from unconstrain.undo import undone_on_failure

JACKKNIFE_FOLDS = 10


class ConstantConstraint(LearntConstraint):
    """A constraint ``A u = 0`` that is the same at all states: the directions least moved in.

    Parameters
    ----------
    n_constraints : int, optional
        Number k of rows. By default it is read off the spectrum, at the largest jump between neighbouring shares of
        motion.

    Attributes
    ----------
    rows_ : ndarray of shape (k, d)
        Orthonormal rows, the largest entry of each positive.
    n_constraints_ : int
        Number k of rows.
    shares_ : ndarray of shape (d,)
        Share of motion along each direction, ascending.
    uncertainty_ : float
        Standard error of the rows' direction in radians, by leaving out a tenth of the episodes (or blocks) at a time.
    reason_ : str
        Why so many rows.

    Notes
    -----
    The rows are the k smallest singular directions of the actions,

        A = argmin_{A Aᵀ = I} Σ_n ‖A u_n‖²,

    that is, eigenvectors of the moments ``Σ u uᵀ``. The Matlab library for these methods (``learn_nhat``) searches a
    grid of angles, row by row; this is the minimum itself, in closed form.

    Examples
    --------
    >>> import numpy as np, unconstrain as uc
    >>> U = np.random.default_rng(0).normal(size=(100, 3)) @ uc.constraints.projection([[0.0, 0.6, 0.8]])
    >>> uc.ConstantConstraint().fit(np.zeros((100, 1)), U).rows_.round(6)
    array([[0. , 0.6, 0.8]])
    """

    rows_: np.ndarray
    uncertainty_: float

    def __init__(self, n_constraints: int | None = None):
        self.n_constraints = n_constraints

    @undone_on_failure
    def fit(
        self,
        X: ArrayLike,
        U: ArrayLike,
        *,
        groups: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
    ) -> Self:
        """Learn from actions that were all under one constraint.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States, of which only the number matters.
        U : array_like of shape (N, d)
            Actions, d > 1.
        groups : array_like of shape (N,), optional
            Episodes, for `uncertainty_`; without them contiguous blocks.
        sample_weight : array_like of shape (N,), optional
            Weights of the samples.

        Returns
        -------
        ConstantConstraint
            Itself, fitted.

        Raises
        ------
        DataError
            If the actions span everything, are all zero, or are fewer than d.
        PolicyError
            If the number of constraints is not between 1 and d - 1.
        """
        X, U, groups = self._check_samples(X, U, groups)
        k = self._check_number_of_rows(self.n_constraints)
        weighted = U * np.sqrt(check_weights(sample_weight, X))[:, None]
        if not weighted.any():
            raise DataError(
                "every sample that moves has weight zero: which directions never move cannot be told"
            )
        # Directions do not depend on the unit, so the one in which no square over- or underflows will do.
        weighted = weighted / np.abs(weighted).max()
        fold = EpisodeFolds(JACKKNIFE_FOLDS).assign(groups, len(U))
        parts = np.stack([weighted[fold == part].T @ weighted[fold == part] for part in np.unique(fold)])
        # The singular values of the actions themselves are exact to rounding; those of moments to its square root.
        _, values, right = np.linalg.svd(weighted, full_matrices=False)
        energy = values[::-1] ** 2
        self.shares_ = energy / energy.sum()
        if k is None:
            self.n_constraints_, self.reason_ = count_constrained(self.shares_)
        else:
            self.n_constraints_, self.reason_ = k, f"as asked; shares of motion {format_shares(self.shares_)}"
        self.rows_ = _sign(right[::-1][: self.n_constraints_])
        self.uncertainty_ = _jackknife(parts, self.rows_)
        return self

    def evaluate_rows(self, X: np.ndarray) -> np.ndarray:
        """Repeat the rows for each state.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, k, d)
            Orthonormal rows.
        """
        return np.broadcast_to(self.rows_, (len(X), *self.rows_.shape)).copy()

    def describe(self, X: ArrayLike, action_names: Sequence[str]) -> str:
        """State the rows as equations between the actions, how sure they are, and why there are so many.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States; the rows are the same at all of them.
        action_names : sequence of str
            Names of the d actions.

        Returns
        -------
        str
            Several lines.
        """
        check_is_fitted(self)
        names = check_names(action_names, "action_names", self.n_actions_)
        lines = [f"rows: {self.n_constraints_} ({self.reason_})"]
        lines += [f"  {equation(row, names)}" for row in self.rows_]
        lines.append(f"how sure: standard error of the direction {np.degrees(self.uncertainty_):.2g}°")
        return "\n".join(lines)


def _sign(rows: np.ndarray) -> np.ndarray:
    """Make the largest entry of each row positive: a row and its negative are the same constraint."""
    largest = np.take_along_axis(rows, np.argmax(np.abs(rows), axis=1)[:, None], axis=1)
    return rows * np.sign(largest)


def _jackknife(parts: np.ndarray, rows: np.ndarray) -> float:
    """Compute the standard error (rad) of rows (k, d): largest angles to those without one of the parts (F, d, d)."""
    if len(parts) < 2:
        return float("nan")
    _, vectors = np.linalg.eigh(parts.sum(axis=0) - parts)
    others = vectors[:, :, : len(rows)]
    outside = others - rows.T @ (rows @ others)
    sines = np.linalg.norm(outside, ord=2, axis=(1, 2))
    angles = np.arcsin(np.minimum(sines, 1.0))
    return float(np.sqrt((len(parts) - 1) / len(parts) * np.sum(angles**2)))
