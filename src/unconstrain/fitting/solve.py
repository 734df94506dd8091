"""Dealing episodes out to folds, and choosing the weight decay λ from moments by fold."""

from collections.abc import Callable, Hashable, Iterator, Sequence
from typing import Any

import numpy as np

from unconstrain.errors import DataError
from unconstrain.fitting.corrected import Part, add_up
from unconstrain.fitting.decay import Decay
from unconstrain.fitting.moments import Moments
from unconstrain.parallel import map_shares
from unconstrain.waiting import each, within

N_FOLDS = 5
N_ALPHAS = 25
# From one at the resolution of H to one that flattens the policy: pure numbers, relative to H's mean eigenvalue.
SMALLEST, LARGEST = 1e-11, 1e1
# Numbers in H from which on a fold is work for a thread: BLAS would share out its many narrow products less well.
SIDE_BY_SIDE = 100_000
# Candidates whose held-out risk is within this share of the least cannot be told apart, and the largest is taken:
# where no sample shows a direction the risk is flat over many decades of λ, and with a small λ slight misfits would
# determine the parameters there, at many times the size of the policy.
INDISTINGUISHABLE = 0.01

ONE_FOLD = (
    'alpha="cv" needs motion in at least two episodes, or without groups in two fifths of the samples, to hold some '
    "out: give more episodes, no groups, or a number for alpha"
)


class EpisodeFolds:
    """Deals episodes out to folds: the i-th new episode goes to fold i mod n_folds, and stays there.

    The rule needs no knowledge of what is yet to come, so a stream is dealt out as the whole would be. Samples
    without episodes are cut into contiguous blocks, since neighbouring samples are too much alike.

    Parameters
    ----------
    n_folds : int
        Number of folds.
    known : dict, optional
        Folds of episodes that were dealt out elsewhere.

    Attributes
    ----------
    fold_of : dict
        The fold of every episode so far, by its label.
    n_dealt : int
        How many episodes were dealt out here.
    """

    def __init__(self, n_folds: int = N_FOLDS, known: dict[Hashable, int] | None = None):
        self.n_folds = n_folds
        self.fold_of: dict[Hashable, int] = dict(known or {})
        self.n_dealt = 0

    def assign(self, groups: np.ndarray | None, n_samples: int) -> np.ndarray:
        """Deal out the episodes of some samples that are new.

        Parameters
        ----------
        groups : ndarray of shape (N,) or None
            Episode labels.
        n_samples : int
            N.

        Returns
        -------
        ndarray of shape (N,), int
            The fold of each sample.
        """
        if groups is None:
            return np.arange(n_samples) * self.n_folds // n_samples
        if not n_samples:
            return np.zeros(0, dtype=int)
        # An episode's samples mostly follow each other, so labels are looked up only where they change.
        starts = np.concatenate([[True], groups[1:] != groups[:-1]])
        folds = [self._fold(label) for label in groups[starts].tolist()]
        return np.repeat(folds, np.diff(np.flatnonzero(np.append(starts, True))))

    def deal_unnamed(self, n_episodes: int) -> None:
        """Count episodes that were dealt out elsewhere, after those here, and whose labels are not kept.

        Parameters
        ----------
        n_episodes : int
            How many.
        """
        self.n_dealt += n_episodes

    def copy(self) -> "EpisodeFolds":
        """Copy the folds, to deal to them independently.

        Returns
        -------
        EpisodeFolds
            With the same episodes.
        """
        other = EpisodeFolds(self.n_folds, self.fold_of)
        other.n_dealt = self.n_dealt
        return other

    def _fold(self, label: Hashable) -> int:
        fold = self.fold_of.get(label)
        if fold is None:
            fold = self.fold_of[label] = self.n_dealt % self.n_folds
            self.n_dealt += 1
        return fold

    def __getstate__(self) -> dict[str, Any]:
        # Arrays of labels and folds take a file a thousandth of what a dictionary takes.
        labels = list(self.fold_of)
        kinds = {type(label) for label in labels}
        return {
            "n_folds": self.n_folds,
            "n_dealt": self.n_dealt,
            "labels": np.array(labels) if kinds in ({int}, {str}) else labels,
            "folds": np.fromiter(self.fold_of.values(), dtype=np.int64, count=len(labels)),
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        labels = state["labels"]
        labels = labels.tolist() if isinstance(labels, np.ndarray) else labels
        self.n_folds, self.n_dealt = state["n_folds"], state["n_dealt"]
        self.fold_of = dict(zip(labels, state["folds"].tolist(), strict=True))


def _as_it_is(part: Moments) -> Moments:
    return part


def choose_alpha(
    folds: Sequence[Part],
    decay_of: Callable[[Moments], Decay],
    judges: Sequence[Moments] | None = None,
    observed: Callable[[Any], Moments] = _as_it_is,
) -> tuple[float, np.ndarray, np.ndarray]:
    """Choose the λ with the least risk on folds left out one at a time, or the largest that is as good.

    Each fold costs one reduction of the others' sum (`path`), whatever the number of λ. Local models, stacked in
    each `Moments`, share one λ: their held-out risks, weighted by their receptive fields, are added.

    Parameters
    ----------
    folds : sequence of Moments or CorrectedMoments
        One for each fold.
    decay_of : callable
        Says what the decay acts on where moments are solved; see `Model.decay`.
    judges : sequence of Moments, optional
        One for each fold: the risk that parameters are judged by which were learnt from the others. By default the risk
        that they were learnt by.
    observed : callable, optional
        Says what parameters are solved from, given the sum of some folds; by default that sum.

    Returns
    -------
    alpha : float
        The chosen λ.
    alphas : ndarray of shape (L,)
        The candidates.
    risk : ndarray of shape (L,)
        Their held-out risk per unit of sample weight, in squared units of the action.

    Raises
    ------
    DataError
        Fewer than two folds hold data.
    """
    judges = judges or [observed(fold) for fold in folds]
    judges = [judge for judge, fold in zip(judges, folds, strict=True) if fold.n_samples]
    folds = [fold for fold in folds if fold.n_samples]
    if len(folds) < 2:
        raise DataError(ONE_FOLD)
    alphas = np.geomspace(SMALLEST, LARGEST, N_ALPHAS)

    def judge(held_out: Moments, others: Any) -> np.ndarray:
        train = observed(others)
        candidates = decay_of(train).decompose(train).solve(alphas)
        return held_out.risk(candidates).reshape(-1, N_ALPHAS).sum(axis=0)

    def judge_share(places: Sequence[int]) -> np.ndarray:
        return np.sum([judge(judges[i], add_up(folds[:i] + folds[i + 1 :])) for i in places], axis=0)

    if judges[0].H.size >= SIDE_BY_SIDE:
        with within("choosing λ"):
            error = np.sum(map_shares(judge_share, range(len(folds))), axis=0)
    else:
        pairs = zip(judges, _leave_one_out(folds), strict=True)
        progress = each(pairs, "choosing λ", len(judges), unit="folds")
        error = np.sum([judge(*pair) for pair in progress], axis=0)
    error /= sum(float(fold.weight.sum()) for fold in folds)
    as_good = error <= (1 + INDISTINGUISHABLE) * error.min()
    return float(alphas[as_good].max()), alphas, error


def _leave_one_out(folds: Sequence[Any]) -> Iterator[Any]:
    """Add up all folds but one at a time; two sums more than folds, where each by itself would be their square."""
    after: list[Any] = [folds[-1]]
    for fold in reversed(folds[1:-1]):
        after.append(fold + after[-1])
    yield after.pop()
    before = folds[0]
    for fold in folds[1:-1]:
        yield before + after.pop()
        before = before + fold
    yield before


def splits(n_samples: int, groups: np.ndarray | None = None) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Split rows into those to train on and those to test on, as `EpisodeFolds` deals them out.

    Parameters
    ----------
    n_samples : int
        N.
    groups : ndarray of shape (N,), optional
        Episode labels.

    Yields
    ------
    train, test : ndarray of int
        One pair for each fold.

    Raises
    ------
    DataError
        There is one fold only.
    """
    fold = EpisodeFolds().assign(None if groups is None else np.asarray(groups), n_samples)
    present = np.unique(fold)
    if len(present) < 2:
        raise DataError(
            "cross-validation needs at least two episodes, or samples without groups, to hold some out"
        )
    for k in present:
        yield np.flatnonzero(fold != k), np.flatnonzero(fold == k)
