"""A large symmetric matrix reduced to few diagonals at the speed of matrix multiplication.

Three diagonals (`tridiagonal`) cost a product of the matrix with a vector for each row, and where a matrix does not fit
into the processor's cache each product costs reading it. `H = Q B Qᵀ` with b diagonals beside the main one costs one
product with b vectors for b rows: each of P/b steps makes zeros below a block of b columns by b reflections

    I - V T Vᵀ,    H ← H - V Xᵀ - X Vᵀ,    X = W - V (Tᵀ Vᵀ W) / 2,    W = H V T,

of which only blocks on and below the diagonal are kept. It is the first half of how eigenvalues are computed in two
stages; the second is not needed, since B + λI has a Cholesky factor of the same b diagonals, at P b² operations a λ.

References
----------
Bischof, Lang, Sun, A framework for symmetric band reduction, ACM Transactions on Mathematical Software 26, 2000.
"""

from dataclasses import dataclass

import numpy as np

BAND = 128
"""Diagonals beside the main one: with fewer, products are narrow; with more, each λ costs more."""


@dataclass(frozen=True)
class Banded:
    """A matrix H, reduced.

    Parameters
    ----------
    bands : ndarray of shape (b + 1, P)
        Diagonals of B, the main one first.
    reflectors : list of tuple of ndarray
        V (n, k) and T (k, k) of each step; n is the number of the last rows, which it acts on.
    """

    bands: np.ndarray
    reflectors: list[tuple[np.ndarray, np.ndarray]]

    @classmethod
    def of(cls, H: np.ndarray, band: int = BAND) -> "Banded":
        """Reduce a matrix.

        Parameters
        ----------
        H : ndarray of shape (P, P)
            Symmetric.
        band : int
            b.

        Returns
        -------
        Banded
            Of it.
        """
        P = len(H)
        # Of each block of columns what is on and below the diagonal, in memory of its own that BLAS writes to.
        columns = [np.array(H[start:, start : start + band], order="C") for start in range(0, P, band)]
        reflectors = []
        for step in range(len(columns) - 1):
            V, T, R = _reflect(columns[step][band:])
            columns[step] = np.concatenate([columns[step][:band], R])
            _update(columns[step + 1 :], V, T, band)
            reflectors.append((V, T))
        return cls(_gather_bands(columns, P, band), reflectors)

    @property
    def is_determined(self) -> bool:
        """Whether no eigenvalue is rounding, as `Spectrum.determined` says: then B less such a one has a factor."""
        from scipy.linalg.lapack import dpbtrf

        lengths = (
            np.sum(self.bands**2, axis=0) ** 0.5
        )  # of no column of a matrix is more than its largest eigenvalue
        lowered = self.bands.copy()
        lowered[0] -= len(lengths) * np.finfo(np.float64).eps * lengths.max()
        return bool(dpbtrf(lowered, lower=1, overwrite_ab=1)[1] == 0)

    def solve(self, decays: np.ndarray, pulls: np.ndarray) -> np.ndarray:
        """Solve `(H + λI) w = y` for several λ, where no eigenvalue is rounding.

        Parameters
        ----------
        decays : ndarray of shape (L,)
            λ, none below zero.
        pulls : ndarray of shape (P, L or 1, K)
            y, for each λ or the same for all.

        Returns
        -------
        ndarray of shape (P, L, K)
            w.
        """
        from scipy.linalg.lapack import dpbsv

        P, L, K = len(pulls), len(decays), pulls.shape[2]
        turned = np.broadcast_to(self._turn(pulls.reshape(P, -1)).reshape(pulls.shape), (P, L, K))
        solved = np.empty((P, L, K))
        for i, decay in enumerate(decays):
            lifted = self.bands.copy()
            lifted[0] += decay
            solved[:, i] = dpbsv(lifted, turned[:, i], lower=1, overwrite_ab=1)[1]
        return self._turn_back(solved.reshape(P, -1)).reshape(solved.shape)

    def _turn(self, columns: np.ndarray) -> np.ndarray:
        """Multiply `Qᵀ` by columns (P, C)."""
        product = columns.copy()
        for V, T in self.reflectors:
            product[-len(V) :] -= V @ (T.T @ (V.T @ product[-len(V) :]))
        return product

    def _turn_back(self, columns: np.ndarray) -> np.ndarray:
        """Multiply Q by columns (P, C)."""
        product = columns.copy()
        for V, T in reversed(self.reflectors):
            product[-len(V) :] -= V @ (T @ (V.T @ product[-len(V) :]))
        return product


def _reflect(panel: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return V (n, k) and T (k, k) of the reflections that turn a panel (n, b) into R (k, b), and that."""
    from scipy.linalg.lapack import dgeqrt

    k = min(panel.shape)
    held, T, _ = dgeqrt(k, np.asfortranarray(panel))
    V = np.tril(held[:, :k], -1)
    np.fill_diagonal(V, 1.0)
    return np.ascontiguousarray(V), np.triu(T[:k]), np.triu(held[:k])


def _update(columns: list[np.ndarray], V: np.ndarray, T: np.ndarray, band: int) -> None:
    """Turn what is left of the matrix, in place."""
    from scipy.linalg.blas import dgemm

    # BLAS adds in place to a matrix that is stored a column after the other, which the transpose of each is here.
    VT, W = V @ T, np.zeros_like(V)
    for place, block in enumerate(columns):
        begin, end = place * band, place * band + block.shape[1]
        dgemm(1.0, VT[begin:end].T, block.T, 1.0, W[begin:].T, overwrite_c=1)
        if len(block) > end - begin:
            dgemm(1.0, VT[end:].T, block[end - begin :].T, 1.0, W[begin:end].T, trans_b=1, overwrite_c=1)
    X = W - 0.5 * V @ (T.T @ (V.T @ W))
    left, right = np.hstack([V, X]), np.hstack([X, V])
    for place, block in enumerate(columns):
        begin, end = place * band, place * band + block.shape[1]
        dgemm(-1.0, right[begin:end].T, left[begin:].T, 1.0, block.T, trans_a=1, overwrite_c=1)


def _gather_bands(columns: list[np.ndarray], P: int, band: int) -> np.ndarray:
    bands = np.zeros((band + 1, P))
    for place, block in enumerate(columns):
        for j in range(block.shape[1]):
            below = block[j : j + band + 1, j]
            bands[: len(below), place * band + j] = below
    return bands
