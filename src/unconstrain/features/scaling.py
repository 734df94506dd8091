"""Where states lie and how far they spread, so that features do not depend on their origin and units.

Features that would otherwise depend on both (those of the linear policy, polynomials, receptive fields without a
width) count states from their mean, in units of each column's spread. What a policy is then penalised for, and how far
one state is from another, is the same in metres and millimetres, and from any origin.
"""

from dataclasses import dataclass

import numpy as np

from unconstrain.arrays import SQUARABLE

NO_SPREAD = 1e-12
"""Share of a column's largest number below which its spread is the rounding of a constant."""


@dataclass(frozen=True)
class Scaling:
    """The map from states to standardised states, `(x - mean) / spread`. It never changes.

    Parameters
    ----------
    mean : ndarray of shape (n,)
        In the unit of each state.
    spread : ndarray of shape (n,)
        Likewise, above zero.
    """

    mean: np.ndarray
    spread: np.ndarray

    @classmethod
    def of(cls, X: np.ndarray, sample_weight: np.ndarray | None = None) -> "Scaling":
        """Take the mean and the standard deviation of states.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        sample_weight : ndarray of shape (N,), optional
            Weight of each sample, 1 by default.

        Returns
        -------
        Scaling
            A column without spread gets its own size as the unit, or one where that is next to zero: nothing hangs on
            it, but what is there afterwards is finite.
        """
        X = np.asarray(X, dtype=np.float64)
        if sample_weight is not None and not np.any(sample_weight):
            sample_weight = None
        # Counted from a sample, so that a far origin costs no digits.
        first = X[0]
        mean = first + np.average(X - first, axis=0, weights=sample_weight)
        away = np.abs(X - mean)
        farthest, largest = away.max(axis=0), np.abs(X).max(axis=0)
        still = farthest <= np.maximum(NO_SPREAD * largest, 1 / SQUARABLE)
        unit = np.where(still, np.where(largest > 1 / SQUARABLE, largest, 1.0), farthest)
        # The largest deviation is taken out: the square of a state may be more than double precision holds.
        share = np.sqrt(np.average((away / unit) ** 2, axis=0, weights=sample_weight))
        # A weight of next to nothing may leave a spread that is next to nothing too.
        return cls(mean, np.where(still | (share <= NO_SPREAD), unit, unit * share))

    def __call__(self, X: np.ndarray) -> np.ndarray:
        """Standardise states.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States, of any precision.

        Returns
        -------
        ndarray of shape (N, n)
            In double precision. Stored a row a state's dimension, along which products are formed.
        """
        rows = np.subtract(X.T, self.mean[:, None], dtype=np.float64)
        rows /= self.spread[:, None]
        return rows.T
