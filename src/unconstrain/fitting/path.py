"""Solutions of moments for many λ, among which λ is chosen by cross-validation.

With eigenvectors of H any λ is one product (`Spectrum`). But all that is needed is an orthogonal basis in which H + λI
is easily solved, and one in which H has few diagonals costs a quarter of eigenvectors (`tridiagonal`, `banded`).

That is so where all directions are determined. Where some are not, but for rounding, H + λI for a small λ is solved
only with them left out, which takes eigenvectors.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from unconstrain.fitting.banded import Banded
from unconstrain.fitting.moments import Moments, Spectrum
from unconstrain.fitting.tridiagonal import SMALL, Tridiagonal

WIDE = 1200
"""Parameters from which on a matrix does not fit into the processor's cache."""

FEW = 4
"""Small matrices up to which their eigenvectors are there before the recursion over P rows, in Python, is done."""


@dataclass(frozen=True)
class Path:
    """Moments with H reduced, of one model or of several along leading axes.

    Parameters
    ----------
    g : ndarray of shape (..., P, K)
        Of the moments.
    reduced : Tridiagonal or list of Banded
        H of models all of whose directions are determined.
    spectrum : Spectrum, optional
        Of the others, and where models are few and small.
    is_reduced : ndarray of shape (S,), bool
        Which models are reduced.
    """

    g: np.ndarray
    reduced: Tridiagonal | list[Banded]
    spectrum: Spectrum | None
    is_reduced: np.ndarray

    @classmethod
    def of(cls, moments: Moments) -> "Path":
        """Reduce moments.

        Parameters
        ----------
        moments : Moments
            Of P parameters.

        Returns
        -------
        Path
            Of them.
        """
        P = moments.H.shape[-1]
        stack = moments.H.reshape(-1, P, P)
        reduced: Any = []
        if P == 1 or (P <= SMALL and len(stack) <= FEW):
            is_reduced = np.zeros(len(stack), dtype=bool)
        elif P < WIDE:
            reduced = Tridiagonal.of(stack)
            is_reduced = reduced.is_determined
            reduced = reduced.select(is_reduced)
        else:
            each = [Banded.of(one) for one in stack]
            is_reduced = np.array([one.is_determined for one in each])
            reduced = [one for one, is_it in zip(each, is_reduced, strict=True) if is_it]
        spectrum = None
        if not is_reduced.all():
            others = moments.g.reshape(-1, *moments.g.shape[-2:])[~is_reduced]
            spectrum = Moments(
                stack[~is_reduced], others, np.zeros(len(others)), np.zeros(len(others))
            ).decompose()
        return cls(moments.g, reduced, spectrum, is_reduced)

    def solve(self, decays: np.ndarray, toward: np.ndarray | None = None) -> np.ndarray:
        """Solve for `w = t + (H + λI)⁻¹ (g - Ht)` for several λ.

        Parameters
        ----------
        decays : ndarray of shape (L,)
            λ, in the unit of H, all above zero.
        toward : ndarray of shape (P, L, K), optional
            Parameters t for each λ; by default zero.

        Returns
        -------
        ndarray of shape (..., P, L, K)
            Parameters for each λ.
        """
        *batch, P, K = self.g.shape
        solved = np.empty((len(self.is_reduced), P, len(decays), K))
        if self.is_reduced.any():
            pulls = self.g.reshape(-1, P, 1, K)[self.is_reduced]
            if toward is not None:
                pulls = pulls + decays[:, None] * toward
            if isinstance(self.reduced, Tridiagonal):
                solved[self.is_reduced] = self.reduced.solve(decays, pulls)
            else:
                for place, one, pull in zip(
                    np.flatnonzero(self.is_reduced), self.reduced, pulls, strict=True
                ):
                    solved[place] = one.solve(decays, pull)
        if self.spectrum is not None:
            solved[~self.is_reduced] = self.spectrum.solve(decays, toward)
        return solved.reshape(*batch, P, len(decays), K)
