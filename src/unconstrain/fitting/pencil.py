"""The noise at which corrected moments leave nothing, and what is observed beyond it.

`H(σ²) = H₀ - σ²B` (`corrected`) is diagonalised for all σ² at once: there are vectors V with

    VᵀBV = diag(β),    VᵀH(σ²)V = diag(h),    h = m(1 - β) - σ²β,    0 <= β <= 1,

if V is normalised by `Vᵀ(H₀/m + B)V = I`, where m is the σ² that would explain all actions by noise. So neither the
basis of the features nor the axes of the actions matter. In each of these directions:

- h is what was observed of the policy. Where all that was recorded is noise its expectation is zero, and what is
  there instead, some share of σ²β to either side, says nothing; its inverse may be anything.
- So where h is not above zero the direction counts as not observed. Elsewhere its part of g is multiplied by
  `ρ = h²/(h² + q²)`, where `q = τσ²β` is the h that noise alone may look like. Without noise ρ is one.
- `τ = 2√(P/n) + P/n`: so far the largest eigenvalue of n samples of noise in P dimensions lies above the mean.

The noise is the smallest σ² at which the risk of the parameters `ρc/h`, c the part of g, is zero,

    s - Σ (2ρ - ρ²) c²/h = 0,

one σ² for all models together.

References
----------
Marchenko, Pastur, Distribution of eigenvalues for some sets of random matrices, Math. USSR Sbornik 1, 1967.
"""

from dataclasses import dataclass, replace

import numpy as np

from unconstrain.fitting.corrected import CorrectedMoments
from unconstrain.fitting.moments import Moments

# Where σ² is searched, as a share of that which would explain all actions by noise, and at how many values.
SMALLEST, N_TRIED = 1e-14, 141


@dataclass(frozen=True)
class Pencil:
    """Corrected moments, diagonalised for all σ².

    Parameters
    ----------
    moments : CorrectedMoments
        Of one model, or of several along a leading axis.
    scale : float
        What squared residuals are divided by; see `CorrectedMoments.at`.
    largest : float
        m, in squared units of the action.
    shares : ndarray of shape (..., P)
        β.
    observed : ndarray of shape (..., P), bool
        Which directions there are; others are those in which features do not vary.
    dual : ndarray of shape (..., P, P)
        `V⁻ᵀ`.
    pull, correction : ndarray of shape (..., P)
        `Vᵀg` without noise, and what σ² times is added to it.
    reach : ndarray of shape (..., 1)
        τ.
    """

    moments: CorrectedMoments
    scale: float
    largest: float
    shares: np.ndarray
    observed: np.ndarray
    dual: np.ndarray
    pull: np.ndarray
    correction: np.ndarray
    reach: np.ndarray

    @classmethod
    def of(cls, moments: CorrectedMoments, scale: float) -> "Pencil":
        """Diagonalise corrected moments.

        Parameters
        ----------
        moments : CorrectedMoments
            Of samples.
        scale : float
            What squared residuals are divided by.

        Returns
        -------
        Pencil
            Of these moments.
        """
        largest = _largest_variance(moments, scale)
        without, whole = moments.at(0.0, scale), moments.correction
        per_variance = whole.H / scale
        P = without.H.shape[-1]
        both = without.H / largest + per_variance
        diagonal = np.einsum("...pp->...p", both)
        # Parameters in units of their own, so that those of the states do not decide what is rounding.
        units = np.where(diagonal > 0, np.where(diagonal > 0, diagonal, 1.0) ** -0.5, 0.0)
        values, vectors = np.linalg.eigh(both * units[..., :, None] * units[..., None, :])
        is_there = values > P * np.finfo(np.float64).eps * values[..., -1:]
        inverse_roots = np.where(is_there, np.where(is_there, values, 1.0) ** -0.5, 0.0)
        white = units[..., :, None] * vectors * inverse_roots[..., None, :]
        B = white.swapaxes(-1, -2) @ per_variance @ white
        place = np.arange(P)
        # Directions that are not there get a share that no other has, so that they stay apart.
        B[..., place, place] = np.where(is_there, B[..., place, place], -1.0)
        shares, turn = np.linalg.eigh(B)
        V = white @ turn
        pull = (V.swapaxes(-1, -2) @ without.g)[..., 0]
        correction = -(moments.n_actions + 2) / scale * (V.swapaxes(-1, -2) @ whole.g)[..., 0]
        return cls(
            moments,
            scale,
            largest,
            shares,
            shares > -0.5,
            both @ V,
            pull,
            correction,
            _reach_of_noise(moments, P),
        )

    def left(self, variance: float) -> float:
        """Compute what is left of the corrected risk, summed over models.

        Parameters
        ----------
        variance : float
            σ².

        Returns
        -------
        float
            In squared units of the action, summed over samples.
        """
        _, h, c, rho = self._along(variance)
        explained = np.where(h > 0, (2 * rho - rho**2) * c**2 / np.where(h > 0, h, 1.0), 0.0)
        return float(np.sum(self.moments.squares_at(variance, self.scale) - explained.sum(axis=-1)))

    def at(self, variance: float) -> Moments:
        """Compute the corrected moments of what was observed beyond the noise.

        Parameters
        ----------
        variance : float
            σ².

        Returns
        -------
        Moments
            H has no eigenvalue below zero, but for rounding.
        """
        found = self.moments.at(variance, self.scale)
        raw, h, c, rho = self._along(variance)
        return replace(
            found,
            H=found.H + (self.dual * (h - raw)[..., None, :]) @ self.dual.swapaxes(-1, -2),
            g=found.g + self.dual @ ((rho - 1) * c)[..., None],
        )

    def find_variance(self) -> tuple[float, bool]:
        """Find the smallest σ² that leaves nothing.

        Returns
        -------
        variance : float
            σ², in squared units of the action. If there is none, that which leaves least.
        is_root : bool
            Whether it leaves nothing.
        """
        from scipy.optimize import brentq

        tried = np.concatenate([[0.0], np.geomspace(SMALLEST, 1.0, N_TRIED) * self.largest])
        left = np.array([self.left(float(each)) for each in tried])
        if not (left <= 0).any():
            return float(tried[np.argmin(left)]), False
        first = int(np.argmax(left <= 0))
        if first == 0:
            return 0.0, True
        return float(brentq(self.left, tried[first - 1], tried[first], xtol=1e-300, rtol=1e-12)), True

    def _along(self, variance: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Compute h as it is, h where it says something and else zero, c, and ρ, each (..., P)."""
        raw = np.where(self.observed, self.largest * (1 - self.shares) - variance * self.shares, 0.0)
        floor = self.shares.shape[-1] * np.finfo(np.float64).eps * self.largest
        h = np.where(raw > floor, raw, 0.0)
        c = np.where(self.observed, self.pull + variance * self.correction, 0.0)
        square = h**2 + (self.reach * variance * self.shares) ** 2
        rho = np.where(h > 0, h**2 / np.where(h > 0, square, 1.0), 0.0)
        return raw, h, c, rho


def _largest_variance(moments: CorrectedMoments, scale: float) -> float:
    """Compute the σ² that would explain all actions by noise."""
    shown = float(np.sum(moments.whole.squares))
    n_numbers = moments.n_actions * float(np.sum(moments.whole.weight)) + float(np.sum(moments.n_numbers))
    if moments.known is not None:
        shown += float(np.sum(moments.known.squares))
    return shown / n_numbers if shown > 0 and n_numbers > 0 else scale / moments.n_actions


def _reach_of_noise(moments: CorrectedMoments, P: int) -> np.ndarray:
    """Compute τ, (..., 1), by how many samples reach each model."""
    share = np.asarray(moments.whole.weight) / (moments.total_weight or 1.0)
    n = np.maximum(share * moments.along.n_samples, 1.0)
    return np.asarray(2 * np.sqrt(P / n) + P / n)[..., None]
