"""Passes over held samples: products with H, a block of samples at a time.

`H w = Σ ω (I ⊗ b) A (I ⊗ bᵀ) w`, with A = QᵀQ of each sample, is evaluated from the right: predictions, what is
observed of them, and what that says of the parameters. Neither H nor V is ever there. The basis of the samples is
remembered between passes where it fits, and else computed anew in each.

Several systems are solved side by side, one without each fold and one with all: they share the basis, whose numbers are
then fetched once for all of them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from unconstrain.features.base import FullBasis
from unconstrain.fitting.observation import Observation
from unconstrain.fitting.wide.held import HeldSamples, excess
from unconstrain.parallel import cut_blocks, map_shares

NUMBERS_IN_BLOCK = 2**18
"""Of the basis, 2 MiB: what is fetched from memory for one product is still in the cache for the next."""

REMEMBERED = 2**29
"""Bytes that the basis of all samples may take to be remembered."""

FEWEST_ROWS = 128


@dataclass(frozen=True)
class Block:
    """Some samples of one fold.

    Parameters
    ----------
    fold : int
        Which.
    Z : ndarray of shape (N, m)
        States, laid out as features see them.
    observation : Observation
        What they are learnt from by.
    judge : Observation
        What parameters are judged by that were learnt from others.
    weights, judge_weights : ndarray of shape (N,) or None
        Weight of each sample in either; None for 1.
    """

    fold: int
    Z: np.ndarray
    observation: Observation
    judge: Observation
    weights: np.ndarray | None
    judge_weights: np.ndarray | None


class Passes:
    """The samples of some folds, and products with their H.

    Parameters are those that the weight decay acts on as they are: arrays (M, L, d) of L systems, for the M functions
    of the basis and the d actions.

    Parameters
    ----------
    folds : sequence of HeldSamples
        Of one model.
    judges : sequence of HeldSamples, optional
        The same samples, by what parameters are judged by; by default the same observations.
    transform : ndarray of shape (M, M) or (M,), optional
        Which turns the basis b into that of these parameters, `Tᵀb`, or what its functions are multiplied by.
    """

    def __init__(
        self,
        folds: Sequence[HeldSamples],
        judges: Sequence[HeldSamples] | None = None,
        transform: np.ndarray | None = None,
    ):
        self.features: FullBasis = folds[0].features
        self.transform = transform
        self.n_folds = len(folds)
        first = folds[0].pieces[0]
        self.n_actions = first.observation.n_actions
        self.n_functions = self.features.basis(first.Z[:1]).shape[1]
        rows = max(FEWEST_ROWS, NUMBERS_IN_BLOCK // self.n_functions)
        self.blocks: list[Block] = []
        for k, (fold, judge) in enumerate(zip(folds, judges or folds, strict=True)):
            for piece, judged in zip(fold.pieces, judge.pieces, strict=True):
                for part in cut_blocks(len(piece), rows):
                    weights, judge_weights = (
                        None if each.weights is None else each.weights[part] for each in (piece, judged)
                    )
                    self.blocks.append(
                        Block(
                            k,
                            piece.Z[part],
                            piece.observation[part],
                            judged.observation[part],
                            weights,
                            judge_weights,
                        )
                    )
        self.n_samples = sum(len(block.Z) for block in self.blocks)
        self.remembers = 8 * self.n_samples * self.n_functions <= REMEMBERED
        self._bases: dict[int, np.ndarray] = {}
        self.n_passes = 0

    def basis(self, number: int) -> np.ndarray:
        """Compute the basis at the samples of a block, or remember it.

        Parameters
        ----------
        number : int
            Of the block.

        Returns
        -------
        ndarray of shape (N, M)
            `Tᵀb(x)`.
        """
        known = self._bases.get(number)
        if known is not None:
            return known
        B = self.features.basis(self.blocks[number].Z)
        if self.transform is not None:
            B = B @ self.transform if self.transform.ndim == 2 else B * self.transform
        if self.remembers:
            self._bases[number] = B
        return B

    def apply(self, W: np.ndarray, left_out: Sequence[int | None]) -> np.ndarray:
        """Compute `H w` of each system.

        Parameters
        ----------
        W : ndarray of shape (M, L, d)
            Parameters of L systems.
        left_out : sequence of int or None
            The fold that each of them is without; None for none.

        Returns
        -------
        ndarray of shape (M, L, d)
            Of each.
        """
        M, L, d = W.shape
        self.n_passes += 1

        def observe(number: int, total: np.ndarray) -> None:
            block, inside, B = self.blocks[number], self._inside(number, left_out), self.basis(number)
            if not inside:
                return
            some = W if len(inside) == L else W[:, inside]
            P = (B @ some.reshape(M, -1)).reshape(len(B), len(inside), d)
            AP = block.observation.weigh(P)
            if block.weights is not None:
                AP = AP * block.weights[:, None, None]
            says = (B.T @ AP.reshape(len(B), -1)).reshape(M, len(inside), d)
            if len(inside) == L:
                total += says
            else:
                total[:, inside] += says

        return self._sum(observe, (M, L, d))

    def pulls(self, left_out: Sequence[int | None]) -> tuple[np.ndarray, np.ndarray]:
        """Compute g of each system, and s.

        Parameters
        ----------
        left_out : sequence of int or None
            The fold that each of them is without.

        Returns
        -------
        g : ndarray of shape (M, L, d)
            Right-hand sides.
        squares : ndarray of shape (L,)
            Sums of squares.
        """
        M, d = self.n_functions, self.n_actions
        n_folds = self.n_folds

        def observe(number: int, total: np.ndarray) -> None:
            block, B = self.blocks[number], self.basis(number)
            pulls, squares = block.observation.pulls, block.observation.squares
            if block.weights is not None:
                pulls, squares = pulls * block.weights[:, None], squares * block.weights
            total[block.fold, :-1] += B.T @ pulls
            total[block.fold, -1, 0] += squares.sum()

        by_fold = self._sum(observe, (n_folds, M + 1, d))
        sums = np.stack(
            [sum(by_fold[k] for k in range(n_folds) if k != without) for without in left_out], axis=1
        )
        return np.ascontiguousarray(sums[:-1]), sums[-1, :, 0]

    def diagonal(self) -> np.ndarray:
        """Compute `Σ ω tr(A) b²`, the diagonal of H summed over actions.

        Returns
        -------
        ndarray of shape (K, M)
            Of each fold, for each function of the basis.
        """

        def observe(number: int, total: np.ndarray) -> None:
            total[self.blocks[number].fold] += self.traces(number) @ self.basis(number) ** 2

        return self._sum(observe, (self.n_folds, self.n_functions))

    def second(self) -> np.ndarray:
        """Compute `Σ ω tr(A) b bᵀ`.

        Returns
        -------
        ndarray of shape (M, M)
            The diagonal blocks of H, summed over actions.
        """

        def observe(number: int, total: np.ndarray) -> None:
            B = self.basis(number)
            total += (B.T * self.traces(number)) @ B

        return self._sum(observe, (self.n_functions, self.n_functions))

    def held_out_risk(self, W: np.ndarray, left_out: Sequence[int | None]) -> np.ndarray:
        """Compute the risk of each system on the fold it is without.

        Parameters
        ----------
        W : ndarray of shape (M, L, d)
            Parameters of L systems.
        left_out : sequence of int
            The fold that each of them is without.

        Returns
        -------
        ndarray of shape (L,)
            Summed over the samples of that fold, never below zero.
        """

        def observe(number: int, total: np.ndarray) -> None:
            block = self.blocks[number]
            those = [i for i, without in enumerate(left_out) if without == block.fold]
            if not those:
                return
            B = self.basis(number)
            P = (B @ W[:, those].reshape(len(W), -1)).reshape(len(B), len(those), self.n_actions)
            squares = block.judge.squares
            squares = squares if block.judge_weights is None else squares * block.judge_weights
            total[those] += excess(block.judge, P, block.judge_weights) + squares.sum()

        return np.maximum(self._sum(observe, (len(left_out),)), 0.0)

    def traces(self, number: int) -> np.ndarray:
        """Compute `ω tr(A)` of the samples of a block.

        Parameters
        ----------
        number : int
            Of the block.

        Returns
        -------
        ndarray of shape (N,)
            Of each sample.
        """
        block = self.blocks[number]
        return np.asarray(block.observation.products(block.weights)[: self.n_actions].sum(axis=0))

    def _inside(self, number: int, left_out: Sequence[int | None]) -> list[int]:
        fold = self.blocks[number].fold
        return [i for i, without in enumerate(left_out) if without != fold]

    def _sum(self, observe: Callable[[int, np.ndarray], None], shape: tuple[int, ...]) -> np.ndarray:
        def share(numbers: Sequence[int]) -> np.ndarray:
            total = np.zeros(shape)
            for number in numbers:
                observe(number, total)
            return total

        first, *others = map_shares(share, range(len(self.blocks)))
        for other in others:
            first += other
        return first
