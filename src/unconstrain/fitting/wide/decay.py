"""Solving held samples for one λ, and counting the parameters that are used.

The equations are those of `fitting.decay`: λ acts on standardised features, intercepts hardly decay, and λ is relative
to the mean of what samples say. Only how they are solved differs.
"""

import warnings
from collections.abc import Sequence

import numpy as np

from unconstrain.features.base import Decaying
from unconstrain.fitting.decay import SHARE
from unconstrain.fitting.wide.conjugate import Solved, solve
from unconstrain.fitting.wide.held import HeldSamples
from unconstrain.fitting.wide.passes import Passes
from unconstrain.fitting.wide.preconditioner import Subset
from unconstrain.waiting import within

PRECISION = 1e-8
"""Of predictions at the samples, as a share of the root mean square action."""

MOST_STEPS = 3_000

SMALLEST_INVERTED = 1e-9
"""λ that the subset is inverted with at least: below it rounding decides."""

PROBES, OF_PROBES = 4, 1e-2


class WideDecay:
    """Held samples, and what the weight decay acts on.

    Parameters
    ----------
    folds : sequence of HeldSamples
        By fold.
    judges : sequence of HeldSamples, optional
        The same samples, by what parameters are judged by that were learnt from other folds.

    Attributes
    ----------
    scale : float
        h, in the unit of H: what λ is relative to.
    """

    def __init__(self, folds: Sequence[HeldSamples], judges: Sequence[HeldSamples] | None = None):
        passes = Passes(folds, judges)
        features, M = passes.features, passes.n_functions
        self.transform: np.ndarray | None = None
        intercepts = np.zeros(M, dtype=bool)
        if isinstance(features, Decaying):
            # Where no basis is asked for, no samples are needed to learn which functions are constant; M² numbers of
            # as many functions as there may be here would be too many.
            basis, intercepts = features.decay_basis(np.broadcast_to(0.0, (M, M)))
            if basis is not None:
                basis, intercepts = features.decay_basis(passes.second())
            if basis is not None or intercepts.any():
                sizes = np.where(intercepts, SHARE**-0.5, 1.0)
                self.transform = sizes if basis is None else basis * sizes
                passes = Passes(folds, judges, self.transform)
        self.passes = passes
        self.n_folds = len(folds)
        self.weight = sum(float(fold.weight) for fold in folds)
        counted = ~intercepts
        n_counted = passes.n_actions * max(int(counted.sum()), 1)
        self._scales = passes.diagonal()[:, counted].sum(axis=1) / n_counted
        self.scale = self._scale(None)
        self._subset: Subset | None = None
        self._pulls: dict[tuple[int | None, ...], tuple[np.ndarray, np.ndarray]] = {}

    def solve(self, alpha: float, near: np.ndarray | None = None) -> np.ndarray:
        """Solve for one λ with all samples.

        Parameters
        ----------
        alpha : float
            λ.
        near : ndarray of shape (P,), optional
            Parameters from which to begin.

        Returns
        -------
        ndarray of shape (P, 1)
            Parameters w.

        Warns
        -----
        UserWarning
            They are not as exact as they should be.
        """
        start = None
        if near is not None and self.transform is None:
            start = near.reshape(self.passes.n_actions, 1, -1).transpose(2, 1, 0)
        found = self.systems(alpha, [None], start)
        if not found.is_solved:
            warnings.warn(
                f"the {found.W.size:,} parameters of this model were not found exactly in {found.n_steps:,} passes "
                f"over the samples: predictions are right to {np.sqrt(found.error[0]):.0e} of an action; give a larger "
                "alpha, or fewer centres",
                stacklevel=2,
            )
        return self._restore(found.W)[:, 0]

    def used(self, alpha: float) -> float:
        """Estimate how many parameters are used, `tr H (H + λ)⁻¹`, by random probes.

        Parameters
        ----------
        alpha : float
            λ.

        Returns
        -------
        float
            Between zero and P.
        """
        passes = self.passes
        shape = (passes.n_functions, PROBES, passes.n_actions)
        probes = np.random.default_rng(0).choice([-1.0, 1.0], size=shape)
        decay = alpha * self.scale
        left_out = [None] * PROBES
        P = shape[0] * shape[2]
        found = solve(
            lambda W, those: passes.apply(W, left_out[: len(those)]) + decay * W,
            probes,
            np.full(PROBES, P / decay),
            self._subset_of_all().factorize(max(decay, SMALLEST_INVERTED * self.scale)),
            np.zeros(shape),
            precision=OF_PROBES,
            most_steps=MOST_STEPS,
        )
        unused = decay * np.einsum("mld,mld->l", probes, found.W).mean()
        return float(np.clip(P - unused, 0.0, P))

    def systems(
        self,
        alpha: float,
        left_out: Sequence[int | None],
        start: np.ndarray | None = None,
        *,
        precision: float = PRECISION,
        most_steps: int = MOST_STEPS,
    ) -> Solved:
        """Solve for one λ, without a fold each.

        Parameters
        ----------
        alpha : float
            λ.
        left_out : sequence of int or None
            The fold that each system is without; None for none.
        start : ndarray of shape (M, L, d), optional
            Where to begin; by default at zero.
        precision, most_steps
            See `conjugate.solve`.

        Returns
        -------
        Solved
            Of parameters that the decay acts on as they are.
        """
        decays, key = alpha * np.array([self._scale(without) for without in left_out]), tuple(left_out)
        if key not in self._pulls:
            self._pulls[key] = self.passes.pulls(left_out)
        g, squares = self._pulls[key]
        with within("solving by conjugate gradients", unit="passes") as report:
            begun = self.passes.n_passes

            def apply(W: np.ndarray, those: np.ndarray) -> np.ndarray:
                product = self.passes.apply(W, [left_out[i] for i in those]) + decays[those, None] * W
                report(self.passes.n_passes - begun)
                return product

            return solve(
                apply,
                g,
                squares,
                self._subset_of_all().factorize(max(alpha, SMALLEST_INVERTED) * self.scale),
                np.zeros_like(g) if start is None else start,
                precision=precision,
                most_steps=most_steps,
            )

    def _scale(self, without: int | None) -> float:
        """Return h of all folds but one."""
        scale = float(sum(each for k, each in enumerate(self._scales) if k != without))
        return scale if scale > 0 else 1.0

    def _subset_of_all(self) -> Subset:
        if self._subset is None:
            self._subset = Subset(self.passes)
        return self._subset

    def _restore(self, W: np.ndarray) -> np.ndarray:
        """Turn arrays (M, L, d) into parameters w (P, L, 1)."""
        M, L, d = W.shape
        if self.transform is not None:
            W = (
                (self.transform @ W.reshape(M, -1)).reshape(W.shape)
                if self.transform.ndim == 2
                else (self.transform[:, None, None] * W)
            )
        return W.transpose(2, 0, 1).reshape(d * M, L, 1)
