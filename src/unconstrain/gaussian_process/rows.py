"""Observations as rows that a Gaussian process is conditioned on.

Whatever a sample says of the policy is quadratic, `(π - y)ᵀ A (π - y)` with a matrix A of information and what it pulls
to, `A y` (`fitting.observation`). With the eigenvectors q of A and its eigenvalues a, that is one number along each,

    √a qᵀπ(x) = qᵀA y / √a + ε,        ε ~ N(0, σ²) for every row alike,

since covariances are linear in directions, and so `√a q` is a direction like any other. A free sample has d rows, a
constrained one has one along û, and one whose projection is known has as many as its rank.
"""

from dataclasses import dataclass

import numpy as np

from unconstrain.fitting.kernels.products import pairs as index_pairs
from unconstrain.fitting.observation import Observation
from unconstrain.gaussian_process.pairs import pair

LEAST_SHARE = 1e-3
"""Of the largest information of a sample, below which it says nothing along a direction."""


@dataclass(frozen=True)
class Rows:
    """What is observed, one number a row.

    Parameters
    ----------
    pairs : ndarray of shape (R, n + d)
        States and directions (x, √a q).
    targets : ndarray of shape (R,)
        What was seen along them, in the unit of the action.
    sample : ndarray of shape (R,), int
        Of which sample each row is.
    """

    pairs: np.ndarray
    targets: np.ndarray
    sample: np.ndarray

    def __len__(self) -> int:
        return len(self.targets)

    @classmethod
    def of(cls, Z: np.ndarray, observation: Observation, weights: np.ndarray | None = None) -> "Rows":
        """Take observations apart.

        Parameters
        ----------
        Z : ndarray of shape (N, n)
            States, as kernels see them.
        observation : Observation
            Of N samples.
        weights : ndarray of shape (N,), optional
            Weight of each sample, 1 by default.

        Returns
        -------
        Rows
            Those of a sample follow each other.
        """
        values, vectors = np.linalg.eigh(_informations(observation, weights))
        pulls = observation.pulls if weights is None else observation.pulls * weights[:, None]
        along = np.einsum("nij,ni->nj", vectors, pulls)
        largest = values[:, -1:]
        sample, which = np.nonzero((values > LEAST_SHARE * largest) & (largest > 0))
        root = np.sqrt(values[sample, which])
        directions = vectors[sample, :, which] * root[:, None]
        return cls(pair(Z[sample], directions), along[sample, which] / root, sample)

    def of_samples(self, chosen: np.ndarray) -> "Rows":
        """Select the rows of some samples.

        Parameters
        ----------
        chosen : ndarray of int
            Numbers of the samples.

        Returns
        -------
        Rows
            Theirs.
        """
        taken = np.isin(self.sample, chosen)
        return Rows(self.pairs[taken], self.targets[taken], self.sample[taken])


def _informations(observation: Observation, weights: np.ndarray | None) -> np.ndarray:
    """Compute `ω A`, (N, d, d)."""
    d = observation.n_actions
    i, j = index_pairs(d)
    A = np.empty((len(observation), d, d))
    A[:, i, j] = A[:, j, i] = observation.products(weights).T
    return A
