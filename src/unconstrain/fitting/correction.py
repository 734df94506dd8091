"""By how much moments are corrected for noise: found from all samples together, and the same for every part of them."""

from dataclasses import dataclass, replace

import numpy as np

from unconstrain.fitting.corrected import CorrectedMoments
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.pencil import Pencil
from unconstrain.fitting.plausible import check_scale, is_plausible

LARGEST_SHARE = 0.5
"""Share of the mean squared action that noise may be. With more, what is left of the policy hangs on its exact size."""

NO_MORE, NOTHING = 1.5, 1e-4
"""What ordinary regression leaves of free actions: at most that many times the noise, or that share of all."""

ADVICE = "try the adaptive risk, or a model that fits better"


@dataclass(frozen=True)
class Correction:
    """The noise, and what follows from it.

    Parameters
    ----------
    variance : float
        σ², in squared units of the action.
    scale : float
        Mean squared length of the actions, in the same.
    is_root : bool
        Whether that much noise explains all that the policy does not.
    looks_free : bool
        Whether ordinary regression explains all of every action but for that noise. If so, each action shows only
        itself, or the noise is misfit.
    """

    variance: float
    scale: float
    is_root: bool
    looks_free: bool = False

    @classmethod
    def of(cls, total: CorrectedMoments, known: float = 0.0) -> "Correction":
        """Find the noise.

        Parameters
        ----------
        total : CorrectedMoments
            Of all samples.
        known : float
            The variance of the noise where it is known beforehand, in squared units of the action; 0 where it is not.
            What more would explain the actions is then misfit.

        Returns
        -------
        Correction
            For these and for parts of them.

        Raises
        ------
        DataError
            The actions are so large or small that their powers are no numbers.
        """
        check_scale(total.scale, "corrected")
        variance, is_root = Pencil.of(total, total.scale).find_variance()
        variance = min(variance, known) if known > 0 else variance
        return cls(variance, total.scale, is_root, _looks_free(total, variance))

    def observed(self, part: CorrectedMoments) -> Moments:
        """Compute the moments that parameters are solved from.

        Parameters
        ----------
        part : CorrectedMoments
            Of some samples.

        Returns
        -------
        Moments
            Of what they show beyond the noise.
        """
        found = Pencil.of(part, self.scale).at(self.variance)
        return found if part.everywhere is None else replace(found, everywhere=self.observed(part.everywhere))

    def judge(self, part: CorrectedMoments) -> Moments:
        """Compute the moments by which parameters are judged that were learnt from other samples.

        Their risk is least, in expectation, at the true policy. What noise leaves of any policy is added, `σ²y`: beside
        next to nothing any difference would be a large share.

        Parameters
        ----------
        part : CorrectedMoments
            Of some samples.

        Returns
        -------
        Moments
            Without those of all samples that local models decay to.
        """
        found = part.at(self.variance, self.scale)
        left = self.variance * part.whole.squares / self.scale
        return replace(found, squares=found.squares + left, everywhere=None)

    def size(self, total: CorrectedMoments, w: np.ndarray) -> float:
        """Compute how many times larger a policy is than what is recorded, root mean square.

        Parameters
        ----------
        total : CorrectedMoments
            Of all samples.
        w : ndarray of shape (..., P, 1)
            Parameters, a solution of the moments.

        Returns
        -------
        float
            Where the projection is not known; 0 if it is everywhere.
        """
        meant = np.sum(w * (total.correction.H @ w))
        shown = float(np.sum(total.whole.squares))
        return float(np.sqrt(max(meant, 0.0) / shown)) if shown > 0 else 0.0

    def residual(self, n_actions: int, size: float) -> float:
        """Compute the variance of what one sample shows about the policy.

        Parameters
        ----------
        n_actions : int
            Dimension of the actions, d.
        size : float
            As `size` returned it.

        Returns
        -------
        float
            `Var(y - uᵀπ) = σ² ‖π‖² + 2dσ⁴`, by the scale, and not less than σ²: in squared units of the action.
        """
        return self.variance * max(size**2 + 2 * n_actions * self.variance / self.scale, 1.0)

    def doubt(self, n_actions: int, size: float) -> str:
        """Say why the result may be wrong.

        Parameters
        ----------
        n_actions : int
            Dimension of the actions, d.
        size : float
            As `size` returned it.

        Returns
        -------
        str
            A sentence; empty where there is no reason.
        """
        if not self.is_root:
            return (
                "no amount of noise explains what the policy leaves of these actions, so what the corrected risk has "
                f"learnt is a guess: {ADVICE}"
            )
        if self.variance * n_actions > LARGEST_SHARE * self.scale:
            return (
                f"{self.variance * n_actions / self.scale:.0%} of the mean squared action is taken for noise, so the "
                f"corrected risk has little left to learn from: {ADVICE}"
            )
        if self.looks_free:
            return (
                "ordinary regression leaves of these actions no more than the noise that the corrected risk has found, "
                f"so nothing was in the way, or what the model misses is taken for noise: {ADVICE}"
            )
        if not is_plausible(size, n_actions):
            return (
                f"the policy learnt by the corrected risk is {size:.3g} times larger than what is recorded, "
                f"which is not plausible: {ADVICE}"
            )
        return ""


def _looks_free(total: CorrectedMoments, variance: float) -> bool:
    whole, d = replace(total.whole, everywhere=None), total.n_actions
    if d == 1 or not whole.n_samples:
        return False
    left = float(np.sum(whole.risk(whole.decompose().solve([0.0]))))
    noise = d * variance * float(np.sum(whole.weight))
    return left <= max(NO_MORE * noise, NOTHING * float(np.sum(whole.squares)))
