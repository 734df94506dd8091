"""Samples that are held in place of their moments."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from unconstrain.features.base import FullBasis
from unconstrain.fitting.kernels import parametric
from unconstrain.fitting.model import LinearModel
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import Observation

WIDE = 6_000
"""Parameters from which on samples are held, where λ is a number. With as many and 20,000 samples, conjugate gradients
took 2.8 s and moments 8.0."""

WIDE_FOR_CHOICE = 9_000
"""The same where λ is chosen, of which each candidate costs passes: with 6,000 it took 208 s, and by moments 96 s, but
5.7 GB in place of 0.6. Moments grow with the square, and are solved with the cube."""

ROWS = 2**12


@dataclass(frozen=True)
class Piece:
    """Some samples as they were observed.

    Parameters
    ----------
    Z : ndarray of shape (N, m)
        States, laid out as features see them.
    observation : Observation
        Of N samples.
    weights : ndarray of shape (N,) or None
        Weight of each sample; None for 1.
    """

    Z: np.ndarray
    observation: Observation
    weights: np.ndarray | None

    def __len__(self) -> int:
        return len(self.Z)


@dataclass(frozen=True)
class HeldSamples:
    """Samples of a model with one basis for all actions, in place of their `Moments`. They add.

    Parameters
    ----------
    features : FullBasis
        Fitted.
    pieces : tuple of Piece
        The samples.
    """

    features: FullBasis
    pieces: tuple[Piece, ...]
    everywhere: ClassVar[None] = None
    n_targets: ClassVar[int] = 1

    @classmethod
    def of(
        cls, model: LinearModel, X: np.ndarray, observation: Observation, weights: np.ndarray | None = None
    ) -> "HeldSamples":
        """Hold samples.

        Parameters
        ----------
        model : LinearModel
            Whose features have a basis.
        X : ndarray of shape (N, n)
            States.
        observation : Observation
            Of N samples.
        weights : ndarray of shape (N,), optional
            Weight of each sample, 1 by default.

        Returns
        -------
        HeldSamples
            Of N samples.
        """
        assert isinstance(model.features, FullBasis)
        return cls(model.features, (Piece(model.lay_out(X), observation, weights),))

    def __add__(self, other: "HeldSamples") -> "HeldSamples":
        return HeldSamples(self.features, self.pieces + other.pieces)

    @property
    def n_samples(self) -> int:
        """How many samples were added."""
        return sum(len(piece) for piece in self.pieces)

    @property
    def nbytes(self) -> int:
        """Bytes of memory that they take."""
        arrays = [
            each
            for piece in self.pieces
            for each in (piece.Z, piece.weights, *vars(piece.observation).values())
            if isinstance(each, np.ndarray)
        ]
        return sum(each.nbytes for each in arrays)

    @property
    def weight(self) -> np.ndarray:
        """`Σ ω_n`."""
        return np.asarray(
            sum(
                float(len(piece)) if piece.weights is None else float(piece.weights.sum())
                for piece in self.pieces
            )
        )

    @property
    def squares(self) -> np.ndarray:
        """Sum s, in squared units of the action."""
        return np.asarray(sum(float(_weigh(piece.observation.squares, piece).sum()) for piece in self.pieces))

    def risk(self, w: np.ndarray) -> np.ndarray:
        """Compute the risk of candidates, summed over samples; see `Moments.risk`.

        Parameters
        ----------
        w : ndarray of shape (P, L, 1)
            L candidates.

        Returns
        -------
        ndarray of shape (L,)
            Never below zero.
        """
        d, L = self.pieces[0].observation.n_actions, w.shape[1]
        W = w.reshape(d, -1, L).transpose(1, 2, 0)
        total = np.zeros(L)
        for piece in self.pieces:
            for start in range(0, len(piece), ROWS):
                rows = slice(start, start + ROWS)
                B = self.features.basis(piece.Z[rows])
                P = (B @ W.reshape(len(W), -1)).reshape(len(B), L, d)
                total += excess(
                    piece.observation[rows], P, None if piece.weights is None else piece.weights[rows]
                )
        return np.maximum(total + self.squares, 0.0)

    def summed(self) -> Moments:
        """Sum the samples up after all.

        Returns
        -------
        Moments
            Of them.

        Raises
        ------
        DataError
            They do not fit into memory.
        """
        return Moments.sum(
            parametric.moments(self.features, piece.Z, piece.observation, piece.weights)
            for piece in self.pieces
        )


def excess(observation: Observation, P: np.ndarray, weights: np.ndarray | None) -> np.ndarray:
    """Compute what predictions add to the sum of squares, `Σ ω (pᵀA p - 2 pᵀA u)`.

    Parameters
    ----------
    observation : Observation
        Of N samples.
    P : ndarray of shape (N, L, d)
        L predictions for each.
    weights : ndarray of shape (N,) or None
        Weight of each sample; None for 1.

    Returns
    -------
    ndarray of shape (L,)
        In squared units of the action.
    """
    each = np.einsum("nld,nld->nl", P, observation.weigh(P) - 2 * observation.pulls[:, None])
    return each.sum(axis=0) if weights is None else weights @ each


def is_wide(model: LinearModel, x: np.ndarray, *, whole: bool, chooses_alpha: bool) -> bool:
    """Whether samples are better held than summed up.

    Parameters
    ----------
    model : LinearModel
        With everything placed.
    x : ndarray of shape (1, n)
        A state.
    whole : bool
        Whether whole actions are observed, whose dimensions share one H.
    chooses_alpha : bool
        Whether λ is chosen by cross-validation.

    Returns
    -------
    bool
        False for local models, and for features without a basis.
    """
    if model.n_models > 1 or not isinstance(model.features, FullBasis):
        return False
    n_functions = model.features.basis(model.lay_out(x)).shape[1]
    limit = WIDE_FOR_CHOICE if chooses_alpha else WIDE
    return n_functions * (1 if whole else model.n_actions) > limit


def _weigh(each: np.ndarray, piece: Piece) -> np.ndarray:
    return each if piece.weights is None else each * piece.weights
