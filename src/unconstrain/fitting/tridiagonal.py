"""Symmetric matrices reduced to three diagonals, after which every λ costs next to nothing.

`H = Q T Qᵀ` with Q orthogonal and T tridiagonal is a quarter of the work of eigenvectors, and solves for many λ too:
`(H + λI)⁻¹ y = Q (T + λI)⁻¹ Qᵀ y`. The middle is one recursion over P rows, for all matrices and all λ side by side.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from unconstrain.fitting.unlocked import sytrd
from unconstrain.parallel import cut_blocks, map_shares

MODELS_IN_PIECE = 8

SMALL = 128
"""Parameters up to which Q is formed: batches of products are then faster than LAPACK's reflections, model by model."""


@dataclass(frozen=True)
class Tridiagonal:
    """Matrices H of S models, reduced.

    Parameters
    ----------
    basis : ndarray of shape (S, P, P), or list of ndarray of shape (P - 1, P - 1)
        Q where P is small; else what LAPACK holds of it, reflectors below the diagonals.
    factors : ndarray of shape (S, P - 1)
        Of the reflectors.
    diagonal : ndarray of shape (S, P)
        Of T.
    beside : ndarray of shape (S, P - 1)
        What stands beside the diagonal.
    """

    basis: np.ndarray | list[np.ndarray]
    factors: np.ndarray
    diagonal: np.ndarray
    beside: np.ndarray

    @classmethod
    def of(cls, H: np.ndarray) -> "Tridiagonal":
        """Reduce matrices.

        Parameters
        ----------
        H : ndarray of shape (S, P, P)
            Symmetric; P is at least two.

        Returns
        -------
        Tridiagonal
            Of them.
        """
        from scipy.linalg.lapack import dorgqr

        S, P = H.shape[:2]
        diagonal, beside, factors = np.empty((S, P)), np.empty((S, P - 1)), np.empty((S, P - 1))
        basis: Any = [None] * S
        if P <= SMALL:
            basis = np.zeros((S, P, P))
            basis[:, 0, 0] = 1.0

        stack = np.array(H, order="C")

        def share(pieces: Sequence[slice]) -> None:
            for piece in pieces:
                sytrd(stack[piece], diagonal[piece], beside[piece], factors[piece])
                for m in range(piece.start, piece.stop):
                    reflectors = stack[m].T[1:, :-1]
                    if P <= SMALL:
                        basis[m, 1:, 1:] = dorgqr(reflectors, factors[m])[0]
                    else:
                        basis[m] = np.asfortranarray(reflectors)

        pieces = cut_blocks(S, MODELS_IN_PIECE)
        if P <= SMALL:  # done before threads have begun
            share(pieces)
        else:
            map_shares(share, pieces)
        return cls(basis, factors, diagonal, beside)

    @property
    def is_determined(self) -> np.ndarray:
        """Whether no eigenvalue (S,) is rounding: `Spectrum.determined` of all eigenvectors.

        So `T - f I` is positive definite for the largest such eigenvalue f, which its pivots tell.
        """
        beside = np.abs(self.beside)
        rows = np.abs(self.diagonal)
        rows[:, 1:] += beside
        rows[:, :-1] += beside
        floor = rows.shape[1] * np.finfo(np.float64).eps * rows.max(axis=1)
        pivots, squares = (self.diagonal - floor[:, None]).T, self.beside.T**2
        with np.errstate(divide="ignore", invalid="ignore"):  # beyond the first that is not above zero
            for i in range(1, len(pivots)):
                pivots[i] -= squares[i - 1] / pivots[i - 1]
        return np.asarray((pivots > 0).all(axis=0))

    def select(self, rows: np.ndarray) -> "Tridiagonal":
        """Select some of the matrices.

        Parameters
        ----------
        rows : ndarray of shape (S,), bool
            Which.

        Returns
        -------
        Tridiagonal
            Of those.
        """
        if rows.all():
            return self
        basis: Any = self.basis[rows] if isinstance(self.basis, np.ndarray) else None
        if basis is None:
            basis = [self.basis[m] for m in np.flatnonzero(rows)]
        return Tridiagonal(basis, self.factors[rows], self.diagonal[rows], self.beside[rows])

    def solve(self, decays: np.ndarray, pulls: np.ndarray) -> np.ndarray:
        """Solve `(H + λI) w = y` for several λ, where no eigenvalue is rounding.

        Parameters
        ----------
        decays : ndarray of shape (L,)
            λ, none below zero.
        pulls : ndarray of shape (S, P, L or 1, K)
            y, for each λ or the same for all.

        Returns
        -------
        ndarray of shape (S, P, L, K)
            w.
        """
        S, P, K = len(pulls), pulls.shape[1], pulls.shape[-1]
        turned = self._multiply("T", pulls.reshape(S, P, -1)).reshape(pulls.shape)
        columns = _solve(self.diagonal, self.beside, decays, turned).reshape(P, S, -1).transpose(1, 0, 2)
        return self._multiply("N", columns).reshape(S, P, len(decays), K)

    def _multiply(self, form: str, columns: np.ndarray) -> np.ndarray:
        """Multiply Q ("N"), or its transpose ("T"), by columns (S, P, C)."""
        from scipy.linalg.lapack import dormqr

        if isinstance(self.basis, np.ndarray):
            return (self.basis if form == "N" else self.basis.swapaxes(1, 2)) @ columns
        basis, C = self.basis, columns.shape[2]
        product = np.empty(columns.shape)
        product[:, 0] = columns[:, 0]

        def share(models: Sequence[int]) -> None:
            for m in models:
                # With the least workspace reflections are applied one by one, which for few columns is faster.
                product[m, 1:] = dormqr("L", form, basis[m], self.factors[m], columns[m, 1:], C)[0]

        map_shares(share, range(len(columns)))
        return product


def _solve(diagonal: np.ndarray, beside: np.ndarray, decays: np.ndarray, pulls: np.ndarray) -> np.ndarray:
    """Solve `(T + λI) x = y` by `LDLᵀ`, (P, S, L, K)."""
    S, P, _, K = pulls.shape
    y = pulls.transpose(1, 0, 2, 3)
    pivots, e = diagonal.T[:, :, None] + decays, beside.T[:, :, None]
    ratios, x = np.empty((P - 1, S, len(decays))), np.empty((P, S, len(decays), K))
    x[0] = y[0]
    for i in range(1, P):
        np.divide(e[i - 1], pivots[i - 1], out=ratios[i - 1])
        pivots[i] -= ratios[i - 1] * e[i - 1]
        np.subtract(y[i], ratios[i - 1, :, :, None] * x[i - 1], out=x[i])
    x /= pivots[..., None]
    for i in range(P - 2, -1, -1):
        x[i] -= ratios[i, :, :, None] * x[i + 1]
    return x
