"""By what candidates are compared on episodes that none of them has learnt from: one measure for all.

Which samples were free decides what a recording shows of a policy, so candidates are compared by one belief in that,
not each by its own. With the probability γ that a sample was free, its action u and a held-out prediction p, the
error is

    γ ‖u - p‖² + (1 - γ) (uᵀ(u - p))² / s,        s = mean ‖u‖²,

less what noise adds to the second term that hangs on p (`fitting.contact.Found.judge`): an action that is short beside
the noise points anywhere, and a candidate that follows it would seem the better for it. Where a projection N is known
the error is `‖N (u - p)‖²`.

Candidates that share one of the other risks share what it assumes, and are compared by that: no sample free, which is
the paper's inconsistency, corrected for noise if their risk is, or all of them.
"""

from dataclasses import dataclass

import numpy as np

from unconstrain.motion import directions

INCONSISTENCY = "held-out inconsistency"
CORRECTED = "held-out inconsistency, corrected for noise"
OF_WHAT_IS_KNOWN = "held-out error of what is known"
OF_WHOLE_ACTIONS = "held-out error of whole actions"
OF_WHAT_IS_SHOWN = "held-out error of what is shown"


@dataclass(frozen=True)
class Judge:
    """What is taken of held-out samples when candidates are compared.

    Parameters
    ----------
    measure : str
        Its name, as a heading.
    free : ndarray of shape (N,)
        Probability γ that nothing was in the way of a sample.
    projections : ndarray of shape (N, d, d), optional
        Those that are known, NaN where one is not.
    noise : float, optional
        Variance of the actions that the error is corrected for; without it the error along the motion is the
        inconsistency, `(r - ûᵀp)²`.
    """

    measure: str
    free: np.ndarray
    projections: np.ndarray | None = None
    noise: float | None = None

    def errors(self, U: np.ndarray, P: np.ndarray) -> np.ndarray:
        """Compute the error of each sample.

        Parameters
        ----------
        U : ndarray of shape (N, d)
            Recorded actions.
        P : ndarray of shape (N, d)
            Predictions by policies that have not learnt from them.

        Returns
        -------
        ndarray of shape (N,)
            In squared units of the action. Corrected for noise, some may be below zero.
        """
        along = self._along_motion(U, P) if self.noise is None else self._corrected(U, P, self.noise)
        return self._mixed(U, P, along)

    def unexplained(self, U: np.ndarray, P: np.ndarray) -> np.ndarray:
        """Compute what each sample shows and a prediction misses, as recorded.

        Parameters
        ----------
        U : ndarray of shape (N, d)
            Recorded actions.
        P : ndarray of shape (N, d)
            Predictions.

        Returns
        -------
        ndarray of shape (N,)
            `γ ‖u - p‖² + (1 - γ) (r - ûᵀp)²`, or `‖N (u - p)‖²` where N is known.
        """
        return self._mixed(U, P, self._along_motion(U, P))

    def _mixed(self, U: np.ndarray, P: np.ndarray, along: np.ndarray) -> np.ndarray:
        errors = self.free * _squares(U - P) + (1 - self.free) * along
        if self.projections is not None:
            known = ~np.isnan(self.projections).any(axis=(1, 2))
            errors[known] = _squares(np.einsum("nij,nj->ni", self.projections[known], U[known] - P[known]))
        return errors

    def _along_motion(self, U: np.ndarray, P: np.ndarray) -> np.ndarray:
        unit, r = directions(U)
        return (r - np.einsum("nd,nd->n", unit, P)) ** 2

    def _corrected(self, U: np.ndarray, P: np.ndarray, v: float) -> np.ndarray:
        d, y, up = U.shape[1], _squares(U), np.einsum("nd,nd->n", U, P)
        error = (
            (y - up) ** 2 - (2 * d + 4) * v * y + d * (d + 2) * v**2 + 2 * (d + 2) * v * up - v * _squares(P)
        )
        # What noise adds whatever the prediction is stays, so that small differences are seen beside it.
        return (error + v * y) / np.mean(y)


def _squares(E: np.ndarray) -> np.ndarray:
    return np.einsum("nd,nd->n", E, E)
