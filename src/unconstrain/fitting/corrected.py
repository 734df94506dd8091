"""Moments of the inconsistency corrected for noise, from one pass over the data.

Let `u = Nπ + ε` with noise `ε ~ N(0, σ²I)`. The true policy has `(Nπ)ᵀ(Nπ - π) = 0`, so with `y = uᵀu` the residual
`y - uᵀπ` is noise. Its square has a bias that is known, and the moments without it are

    H(σ²) = Σ ω (Φᵀu uᵀΦ - σ² ΦᵀΦ),
    g(σ²) = Σ ω Φᵀu (y - (d+2)σ²),
    s(σ²) = Σ ω (y² - (2d+4)σ² y + d(d+2)σ⁴).

At the true policy and the true σ² the expectation of the risk `s - 2gᵀw + wᵀHw` is zero, and so is that of its
gradient. Divided by the mean of y the risk is in squared units of the action. Where the projection is known,
`‖N(u - π)‖²` counts instead, less the σ² that noise adds to each of the rank N numbers that it shows.

All of that is in two moments that σ² is no part of: those of the inconsistency, each sample weighted by y, and those of
direct regression on the same samples. They add up. So σ² can be found once all samples are added up (`pencil`).

References
----------
Kukush, Markovsky, Van Huffel, Consistent estimation in an implicit quadratic measurement error model, Computational
Statistics and Data Analysis 47, 2004.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add
from typing import Any

import numpy as np

from unconstrain.fitting.model import LinearModel
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import observe, unknown
from unconstrain.fitting.plausible import check_scale
from unconstrain.fitting.wide.held import HeldSamples
from unconstrain.motion import lengths
from unconstrain.samples import Samples


@dataclass(frozen=True)
class CorrectedMoments:
    """What the corrected moments follow from for any σ². They add.

    Parameters
    ----------
    along : Moments
        Of the inconsistency of samples whose projection is not known, each weighted by y.
    whole : Moments
        Of direct regression on these samples.
    total_weight : float
        `Σ ω` of these samples, however far a local model reaches.
    known : Moments, optional
        Of the samples whose projection is known, behind it.
    n_numbers : ndarray of shape (...,)
        `Σ ω rank N` of the latter, for each model.
    n_actions : int
        Dimension of the actions, d.
    """

    along: Moments
    whole: Moments
    total_weight: float
    known: Moments | None
    n_numbers: np.ndarray
    n_actions: int

    @classmethod
    def of(cls, model: LinearModel, samples: Samples) -> "CorrectedMoments":
        """Sum samples up.

        Parameters
        ----------
        model : LinearModel
            With everything placed.
        samples : Samples
            Checked.

        Returns
        -------
        CorrectedMoments
            Of these samples.

        Raises
        ------
        DataError
            The actions are so large that their powers are no numbers.
        """
        N = samples.projections
        hidden = np.ones(len(samples.states), dtype=bool) if N is None else unknown(N)
        if not hidden.any():
            none = cls.of(
                model, samples.select(np.array([0]))._replace(projections=None, weights=np.zeros(1))
            )
            return _with_known(_without_samples(none), model, samples)
        others = samples if hidden.all() else samples.select(np.flatnonzero(hidden))
        X, U, weights = others.states, others.actions, others.weights
        y = lengths(U) ** 2
        check_scale(max(float(np.mean(y)), 1.0) if len(y) else 1.0, "corrected")
        along = model.moments(X, observe("inconsistency", U), y if weights is None else y * weights)
        whole = model.moments(X, observe("direct", U), weights)
        total_weight = float(len(X) if weights is None else weights.sum())
        found = cls(along, whole, total_weight, None, np.zeros(along.squares.shape), U.shape[1])
        if hidden.all():
            return found
        return _with_known(found, model, samples.select(np.flatnonzero(~hidden)))

    def __add__(self, other: "CorrectedMoments") -> "CorrectedMoments":
        here, there = self.known, other.known
        known = there if here is None else here if there is None else here + there
        return CorrectedMoments(
            self.along + other.along,
            self.whole + other.whole,
            self.total_weight + other.total_weight,
            known,
            np.asarray(self.n_numbers + other.n_numbers),
            self.n_actions,
        )

    @property
    def n_samples(self) -> int:
        """How many samples were added."""
        return self.along.n_samples + (0 if self.known is None else self.known.n_samples)

    @property
    def weight(self) -> np.ndarray:
        """`Σ ω` of all samples, for each model."""
        return self.whole.weight if self.known is None else self.whole.weight + self.known.weight

    @property
    def scale(self) -> float:
        """Mean of y where the projection is not known, in squared units of the action; 1 where there is none such."""
        weight = float(np.sum(self.whole.weight))
        scale = float(np.sum(self.whole.squares)) / weight if weight > 0 else 0.0
        return scale if scale > 0 else 1.0

    @property
    def everywhere(self) -> "CorrectedMoments | None":
        """Beside those of local models, the same of every sample in full."""
        if self.along.everywhere is None or self.whole.everywhere is None:
            return None
        known = None if self.known is None else self.known.everywhere
        return CorrectedMoments(
            self.along.everywhere,
            self.whole.everywhere,
            self.total_weight,
            known,
            np.zeros(()),
            self.n_actions,
        )

    def at(self, variance: float, scale: float) -> Moments:
        """Compute the moments that are corrected for noise.

        Parameters
        ----------
        variance : float
            σ², in squared units of the action.
        scale : float
            What the squares `(y - uᵀπ)²` are divided by.

        Returns
        -------
        Moments
            Of which H need not be positive.
        """
        everywhere = None if self.everywhere is None else self.everywhere.at(variance, scale)
        along, whole = self.along, self.correction
        H = (along.H - variance * whole.H) / scale
        g = (along.g - (self.n_actions + 2) * variance * whole.g) / scale
        if self.known is not None:
            H, g = H + self.known.H, g + self.known.g
        return Moments(H, g, self.squares_at(variance, scale), self.weight, self.n_samples, everywhere)

    def squares_at(self, variance: float, scale: float) -> np.ndarray:
        """Compute s of the moments that are corrected for noise.

        Parameters
        ----------
        variance : float
            σ², in squared units of the action.
        scale : float
            What the squares `(y - uᵀπ)²` are divided by.

        Returns
        -------
        ndarray of shape (...,)
            In squared units of the action, summed over samples.
        """
        d, v, whole = self.n_actions, variance, self.whole
        s = self.along.squares - (2 * d + 4) * v * whole.squares + d * (d + 2) * v**2 * whole.weight
        s = np.asarray(s / scale)
        return s if self.known is None else s + self.known.squares - v * self.n_numbers

    @property
    def correction(self) -> Moments:
        """Those of direct regression, of all d P parameters also where the dimensions of the action share a block."""
        whole, d = self.whole, self.n_actions
        if whole.H.shape == self.along.H.shape:
            return whole
        *batch, M, _ = whole.H.shape
        H = np.einsum("ij,...ab->...iajb", np.eye(d), whole.H).reshape(*batch, d * M, d * M)
        g = whole.g.swapaxes(-1, -2).reshape(*batch, d * M, 1)
        return Moments(H, g, whole.squares, whole.weight, whole.n_samples)


Part = Moments | CorrectedMoments | HeldSamples
"""What a fold has added up, by any risk."""


def add_up(parts: Sequence[Part]) -> Any:
    """Add up what folds have.

    Parameters
    ----------
    parts : sequence of Moments, CorrectedMoments or HeldSamples
        One at least, all of a kind.

    Returns
    -------
    Moments, CorrectedMoments or HeldSamples
        Of that kind.
    """
    return reduce(add, parts)


def _with_known(found: CorrectedMoments, model: LinearModel, samples: Samples) -> CorrectedMoments:
    """Add samples whose projection is known to moments that have none such."""
    X, U, N, weights = samples.states, samples.actions, samples.projections, samples.weights
    assert N is not None
    known = model.moments(X, observe("whole", U, N), weights)
    ranks = np.einsum("nii->n", N)
    n_numbers = (ranks if weights is None else ranks * weights) @ model.reach(X)
    return replace(found, known=known, n_numbers=n_numbers.reshape(known.squares.shape))


def _without_samples(found: CorrectedMoments) -> CorrectedMoments:
    """Count no samples, where they all have the weight zero."""

    def emptied(part: Moments) -> Moments:
        everywhere = None if part.everywhere is None else emptied(part.everywhere)
        return replace(part, n_samples=0, everywhere=everywhere)

    return replace(found, along=emptied(found.along), whole=emptied(found.whole))
