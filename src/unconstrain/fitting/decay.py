"""Weight decay that does not hang on units, nor invents a policy where the data are silent.

A fit minimises `E(w) + λ h Σ_p d_p (w'_p - t_p)²`, with

- w' the parameters of *standardised* features, `w = B w'`: those of the linear policy belong to states counted from
  their mean in units of their spread. Mean and spread come from the same moments that are solved, so however the
  samples are cut into pieces, and whatever was placed by the first of them, the solution is the same;
- d_p one, and `SHARE` for intercepts: those are what the samples say, but for actions along which next to no sample
  moved, where misfit divided by next to nothing would make policies many times the size of any action;
- h the mean eigenvalue of H over the parameters that are no intercepts. So λ, the `alpha` of every policy, is a pure
  number: the decay's share of what the samples say. Neither units, nor the number of samples, nor the unit of their
  weights is in it;
- t zero for one set of parameters. Local models decay to t = w_0, the same features fitted to all samples together, of
  which they carry the moments along (`Moments.everywhere`): where the data near a model are silent, it says what all
  data say rather than "do not move". All their parameters decay to it, intercepts too. w_0 decays to zero by itself,
  by `SHARE` of λ.

What data leave undetermined even so, where λ is zero, is settled by the least norm of w' (of its distance from t).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from unconstrain.features.base import Decaying, Features, FullBasis
from unconstrain.fitting.moments import Moments

SHARE = 1e-3
"""Of λ by which intercepts decay, and by which the policy of all data does that local models decay to.

Both rest on many more samples than what decays in full; were that policy pulled to zero as strongly as local models are
pulled to it, it would say "do not move" again.
"""


@runtime_checkable
class Solutions(Protocol):
    """Moments decomposed so that every λ costs one product."""

    def solve(self, alphas: ArrayLike) -> np.ndarray:
        """Solve for several λ (L,): parameters (..., P, L, K)."""
        ...


@dataclass(frozen=True)
class Decay:
    """What the weight decay acts on, and how strong it is for λ = 1.

    Parameters
    ----------
    scale : float
        h, in the unit of H.
    intercepts : ndarray of shape (M,), bool
        Which parameters of a block of M are intercepts.
    basis : ndarray of shape (M, M), optional
        B, of each block; by default the features are standardised as they are.
    """

    scale: float
    intercepts: np.ndarray
    basis: np.ndarray | None = None

    @classmethod
    def of(cls, moments: Moments, features: Features, n_actions: int) -> "Decay":
        """Take it from moments.

        Parameters
        ----------
        moments : Moments
            Those that are to be solved.
        features : Features
            Fitted.
        n_actions : int
            Dimension of the actions, d.

        Returns
        -------
        Decay
            For these moments.
        """
        whole = moments if moments.everywhere is None else moments.everywhere
        P, K = whole.g.shape[-2:]
        H = whole.H if whole.H.ndim == 2 else whole.H.sum(axis=0)
        basis, intercepts = None, np.zeros(P, dtype=bool)
        if isinstance(features, FullBasis) and isinstance(features, Decaying):
            copies = 1 if K > 1 else n_actions
            blocks = H.reshape(copies, P // copies, copies, P // copies)
            basis, intercepts = features.decay_basis(np.einsum("jajb->ab", blocks))
            H = H if basis is None else _both_sides(H, basis)
        diagonal = np.diagonal(H)[~np.tile(intercepts, P // len(intercepts))]
        scale = float(diagonal.mean()) if len(diagonal) else 0.0
        return cls(scale if scale > 0 else 1.0, intercepts, basis)

    def solve(self, moments: Moments, alpha: float) -> np.ndarray:
        """Solve for one λ.

        Parameters
        ----------
        moments : Moments
            Those that this is for.
        alpha : float
            λ.

        Returns
        -------
        ndarray of shape (..., P, K)
            Parameters w.
        """
        standard = self.standardize(moments)
        return self.restore(self._solve(standard, alpha * self.scale))

    def decompose(self, moments: Moments) -> Solutions:
        """Decompose moments, which solves for every λ at once.

        Parameters
        ----------
        moments : Moments
            Those that this is for.

        Returns
        -------
        Solutions
            With a method `solve(alphas)`.
        """
        return _Restored(self._decompose(self.standardize(moments)), self)

    def used(self, moments: Moments, alpha: float) -> float:
        """Count the parameters that are used, `tr H (H + λ)⁻¹`.

        Parameters
        ----------
        moments : Moments
            Those that this is for, of one model.
        alpha : float
            λ.

        Returns
        -------
        float
            Between zero and P.
        """
        values = np.maximum(np.linalg.eigvalsh(self.standardize(moments).H), 0.0)
        return float(np.sum(values / (values + alpha * self.scale + np.finfo(np.float64).tiny)))

    def standardize(self, moments: Moments) -> Moments:
        """Turn moments of w into moments of w'.

        Parameters
        ----------
        moments : Moments
            Of w.

        Returns
        -------
        Moments
            Of w'.
        """
        if self.basis is None:
            return moments
        whole = moments.everywhere
        return replace(
            moments,
            H=_both_sides(moments.H, self.basis),
            g=_one_side(moments.g, self.basis.T),
            everywhere=None if whole is None else self.standardize(whole),
        )

    def restore(self, w: np.ndarray) -> np.ndarray:
        """Turn w' into w.

        Parameters
        ----------
        w : ndarray of shape (..., P, K)
            w'.

        Returns
        -------
        ndarray of shape (..., P, K)
            w.
        """
        return w if self.basis is None else _one_side(w, self.basis)

    def restore_covariance(self, covariance: np.ndarray) -> np.ndarray:
        """Turn a covariance of w' into one of w.

        Parameters
        ----------
        covariance : ndarray of shape (..., P, P)
            Of w'.

        Returns
        -------
        ndarray of shape (..., P, P)
            Of w.
        """
        return covariance if self.basis is None else _both_sides(covariance, self.basis.T)

    def _solve(self, standard: Moments, decay: float) -> np.ndarray:
        if standard.everywhere is not None:
            w_0 = self._solve(standard.everywhere, SHARE * decay)
            return w_0 + replace(standard, g=standard.g - standard.H @ w_0).solve(decay)
        size = self._sizes(standard)
        return size[:, None] * _resized(standard, size).solve(decay)

    def _decompose(self, standard: Moments) -> Callable[[np.ndarray], np.ndarray]:
        if standard.everywhere is not None:
            of_all, spectrum = self._decompose(standard.everywhere), standard.decompose()
            return lambda decays: spectrum.solve(decays, of_all(SHARE * decays))
        size = self._sizes(standard)
        spectrum = _resized(standard, size).decompose()
        return lambda decays: size[:, None, None] * spectrum.solve(decays)

    def _sizes(self, standard: Moments) -> np.ndarray:
        """Compute how large each parameter (P,) may be beside others for the same decay, `d_p^(-1/2)`."""
        copies = standard.g.shape[-2] // len(self.intercepts)
        return np.tile(np.where(self.intercepts, SHARE**-0.5, 1.0), copies)


@dataclass(frozen=True)
class _Restored:
    """Solutions in w of what is solved in w'."""

    path: Callable[[np.ndarray], np.ndarray]
    decay: Decay

    def solve(self, alphas: ArrayLike) -> np.ndarray:
        w = self.path(np.asarray(alphas, dtype=np.float64) * self.decay.scale)
        *batch, P, L, K = w.shape
        return self.decay.restore(w.reshape(*batch, P, L * K)).reshape(w.shape)


def _resized(moments: Moments, size: np.ndarray) -> Moments:
    """Turn moments of w into those of w / size."""
    return replace(moments, H=moments.H * size * size[:, None], g=moments.g * size[:, None])


def _one_side(g: np.ndarray, A: np.ndarray) -> np.ndarray:
    """Compute `(I ⊗ A) g` for g (..., P, K)."""
    *batch, P, K = g.shape
    return (A @ g.reshape(*batch, P // len(A), len(A), K)).reshape(g.shape)


def _both_sides(H: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Compute `(I ⊗ B)ᵀ H (I ⊗ B)` for H (..., P, P)."""
    half = _one_side(H, B.T)
    return _one_side(half.swapaxes(-1, -2), B.T).swapaxes(-1, -2)
