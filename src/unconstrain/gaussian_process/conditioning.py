"""Conditioning a process on all samples: exactly where their rows are few, on inducing rows where they are many."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from unconstrain.fitting.global_model import GlobalModel
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import Observation
from unconstrain.gaussian_process.evidence import Evidence
from unconstrain.gaussian_process.held_out import HeldOut, hold_out_exactly, hold_out_of_moments
from unconstrain.gaussian_process.inducing import InducingFeatures, SeparableFeatures, make_features
from unconstrain.gaussian_process.process import Process, condition
from unconstrain.gaussian_process.rows import Rows
from unconstrain.gaussian_process.spreading import choose_spread_out

MOST_EXACT = 4000
"""Rows up to which the posterior is exact."""

INDUCING = 1400
"""Inducing rows beyond."""

CANDIDATES = 20_000
"""Samples that inducing ones are chosen among, at most."""

BLOCK_ROWS = 2048
"""Rows that are added up at a time."""

JUDGING = 2000
"""Samples by which variances are judged, at most."""


class Conditioned(Protocol):
    """A process, and the same without each fold."""

    @property
    def process(self) -> Process:
        """Conditioned on all samples."""
        ...

    def hold_out(self) -> HeldOut:
        """Leave each fold out."""
        ...


@dataclass(frozen=True)
class Exact:
    """A process conditioned on every row.

    Parameters
    ----------
    process : Process
        Exact.
    rows : Rows
        Of all samples.
    fold, follows : ndarray of shape (N,)
        The fold of each sample, and whether it follows the sample before it in its episode.
    """

    process: Process
    rows: Rows
    fold: np.ndarray
    follows: np.ndarray

    def hold_out(self) -> HeldOut:
        """Leave each fold out, without another factorisation."""
        return hold_out_exactly(self.process, self.rows, self.fold, self.follows)


@dataclass(frozen=True)
class OnInducing:
    """A process conditioned on moments of the features of inducing rows.

    Parameters
    ----------
    process : Process
        Of all moments.
    features : InducingFeatures
        Of the inducing rows.
    parts : list of Moments or None
        By fold.
    rows : Rows
        Of the first samples.
    fold, follows : ndarray of shape (N,)
        The fold of each sample, and whether it follows the sample before it in its episode.
    """

    process: Process
    features: InducingFeatures
    parts: list[Moments | None]
    rows: Rows
    fold: np.ndarray
    follows: np.ndarray

    def hold_out(self) -> HeldOut:
        """Leave out the moments of each fold."""
        return hold_out_of_moments(
            self.features,
            self.parts,
            self.rows,
            self.fold,
            self.follows,
            self.process.size,
            self.process.noise,
        )


def place_features(evidence: Evidence, X: np.ndarray, d: int, most: int) -> InducingFeatures:
    """Make the features of inducing rows that lie far from each other.

    Parameters
    ----------
    evidence : Evidence
        Whose kernel they are of.
    X : ndarray of shape (N, n)
        States.
    d : int
        Number of actions.
    most : int
        How many features there may be.

    Returns
    -------
    InducingFeatures
        Fitted.
    """
    Z = evidence.scaling(X[:: max(1, len(X) // CANDIDATES)])
    states = Z[choose_spread_out(Z, max(1, most // d))]
    return make_features(evidence.kernel, evidence.scaling, states, d, most)


def condition_on_all(
    evidence: Evidence,
    X: np.ndarray,
    observation: Observation,
    weights: np.ndarray | None,
    noise: float,
    fold: np.ndarray,
    follows: np.ndarray,
) -> Conditioned:
    """Condition the process on observations.

    Parameters
    ----------
    evidence : Evidence
        Whose kernel it has.
    X : ndarray of shape (N, n)
        States.
    observation : Observation
        Of N samples.
    weights : ndarray of shape (N,) or None
        Weight of each sample.
    noise : float
        Variance of the noise, in squared units of the action.
    fold, follows : ndarray of shape (N,)
        The fold of each sample, and whether it follows the sample before it in its episode.

    Returns
    -------
    Conditioned
        Exact where the rows are few enough.
    """
    size, d = evidence.size, observation.n_actions
    share = noise / size**2
    if len(X) <= MOST_EXACT:
        rows = Rows.of(evidence.scaling(X), observation, weights)
        if len(rows) <= MOST_EXACT:
            process = condition(evidence.kernel, rows, evidence.scaling, size, share)
            return Exact(process, rows, fold, follows)
    features = place_features(evidence, X, d, INDUCING)
    # What inducing rows leave out of a sample's variance counts as its noise, as in the fully independent training
    # conditional: without it few of them are far too sure.
    blocks = [X[start : start + BLOCK_ROWS] for start in range(0, len(X), BLOCK_ROWS)]
    kept = share / (share + np.concatenate([features.missed(block) for block in blocks]))
    kept = kept if weights is None else kept * weights
    parts: list[Moments | None] = [None] * (int(fold.max()) + 1)
    for k in np.unique(fold).tolist():
        inside = np.flatnonzero(fold == k)
        parts[k] = _add_up(features, X[inside], observation[inside], kept[inside])
    total = Moments.sum(part for part in parts if part is not None)
    judged = np.arange(min(len(X), JUDGING))
    rows = Rows.of(evidence.scaling(X[judged]), observation[judged], None)
    return OnInducing(
        features.process(total, size, share), features, parts, rows, fold[judged], follows[judged]
    )


def _add_up(
    features: InducingFeatures, X: np.ndarray, observation: Observation, weights: np.ndarray
) -> Moments:
    """Sum samples up: by the fast sums where actions share a basis, and else by their rows, which are fewer."""
    if isinstance(features, SeparableFeatures):
        return GlobalModel(features, X.shape[1], observation.n_actions).moments(X, observation, weights)
    rows = Rows.of(features.scaling(X), observation, weights)
    P = features.whitener.shape[1]
    total = Moments.zeros((), P, 1)
    for start in range(0, len(rows), BLOCK_ROWS):
        V = features.along_rows(rows.pairs[start : start + BLOCK_ROWS])
        total.H += V.T @ V
        total.g[:, 0] += V.T @ rows.targets[start : start + BLOCK_ROWS]
    total.weight, total.n_samples = np.asarray(weights.sum()), len(X)
    return total
