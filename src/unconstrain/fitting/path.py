"""Solutions of moments for many λ, among which λ is chosen by cross-validation.

With eigenvectors of H any λ is one product (`Spectrum`). But all that is needed is an orthogonal basis in which H + λI
is easily solved, and one in which H has few diagonals costs a quarter of eigenvectors (`tridiagonal`, `banded`).

Directions that no sample shows, but for rounding, are not told apart from others here: they decay to t as any other,
and what rounding leaves of g is divided by λ. λ is chosen among values of at least 1e-11 of the mean eigenvalue, where
that is a hundred thousandth of the policy.
"""

from dataclasses import dataclass

import numpy as np

from unconstrain.fitting.banded import Banded
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.tridiagonal import Tridiagonal

WIDE = 1200
"""Parameters from which on a matrix does not fit into the processor's cache."""


@dataclass(frozen=True)
class Path:
    """Moments with H reduced, of one model or of several along leading axes.

    Parameters
    ----------
    g : ndarray of shape (..., P, K)
        Of the moments.
    reduced : Tridiagonal or list of Banded
        H of all models.
    """

    g: np.ndarray
    reduced: Tridiagonal | list[Banded]

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
        return cls(moments.g, Tridiagonal.of(stack) if 1 < P < WIDE else [Banded.of(one) for one in stack])

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
        pulls = self.g.reshape(-1, P, 1, K)
        if toward is not None:
            pulls = pulls + decays[:, None] * toward
        if isinstance(self.reduced, Tridiagonal):
            solved = self.reduced.solve(decays, pulls)
        else:
            solved = np.stack(
                [one.solve(decays, pull) for one, pull in zip(self.reduced, pulls, strict=True)]
            )
        return solved.reshape(*batch, P, len(decays), K)
