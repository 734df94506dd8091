"""Dealing episodes out to folds, and choosing the weight decay λ from moments by fold."""

from collections.abc import Iterator

import numpy as np

from unconstrain.errors import DataError
from unconstrain.fitting.moments import Moments

N_ALPHAS = 25
# λ from one that flattens the policy to one at the resolution of H, relative to H's largest eigenvalue.
SMALLEST, LARGEST = 1e-12, 1e0
# Candidates whose held-out risk is within this share of the least cannot be told apart, and the largest is taken:
# where no sample shows a direction the risk is flat over many decades of λ, and a small λ would leave there whatever
# slight misfits happen to ask for, many times the policy.
INDISTINGUISHABLE = 0.01


class EpisodeFolds:
    """Deals episodes out to folds: the i-th new episode goes to fold i mod n_folds, and stays there.

    The rule needs no knowledge of what is yet to come, so a stream is dealt out as the whole would be. Samples
    without episodes are cut into contiguous blocks, since neighbouring samples tell too much about each other.
    """

    def __init__(self, n_folds: int = 5):
        self.n_folds = n_folds
        self.fold_of: dict = {}

    def assign(self, groups: np.ndarray | None, n_samples: int) -> np.ndarray:
        """The fold of each sample, (N,), for episode labels `groups` (N,), or None."""
        if groups is None:
            return np.arange(n_samples) * self.n_folds // n_samples
        if not n_samples:
            return np.zeros(0, dtype=int)
        # An episode's samples mostly follow each other, so only where the label changes is it looked at.
        starts = np.concatenate([[True], groups[1:] != groups[:-1]])
        fold_of, deal = self.fold_of, self.n_folds
        folds = [fold_of.setdefault(name, len(fold_of) % deal) for name in groups[starts].tolist()]
        return np.repeat(folds, np.diff(np.flatnonzero(np.append(starts, True))))

    def __getstate__(self) -> dict:
        # An array of labels, in the order they were dealt out, takes a file a thousandth of what a dictionary takes.
        labels = list(self.fold_of)
        kinds = {type(label) for label in labels}
        return {"n_folds": self.n_folds, "labels": np.array(labels) if kinds in ({int}, {str}) else labels}

    def __setstate__(self, state: dict) -> None:
        self.n_folds = state["n_folds"]
        if "fold_of" in state:  # as written by the first release
            self.fold_of = state["fold_of"]
        else:
            labels = state["labels"]
            labels = labels.tolist() if isinstance(labels, np.ndarray) else labels
            self.fold_of = {label: i % self.n_folds for i, label in enumerate(labels)}


def choose_alpha(folds: list[Moments], scale: float) -> tuple[float, np.ndarray, np.ndarray]:
    """The λ with the least risk on folds left out one at a time, or the largest that is as good.

    Each fold costs one eigendecomposition of the others' sum, whatever the number of λ. Local models, stacked in
    each `Moments`, share one λ: their held-out risks, weighted by their receptive fields, are added. `scale` is the
    largest eigenvalue of all folds' H; the candidates are set relative to it.

    Returns λ, the candidates (L,), and their held-out risk per unit of sample weight (L,).
    Raises `DataError` where fewer than two folds hold data.
    """
    folds = [fold for fold in folds if fold.n_samples]
    if len(folds) < 2:
        raise DataError(
            'alpha="cv" needs at least two episodes, or samples without groups, to hold some out: '
            "give a number for alpha, or no groups"
        )
    alphas = np.geomspace(SMALLEST, LARGEST, N_ALPHAS) * (scale or 1.0)
    error = np.zeros(N_ALPHAS)
    for i, held_out in enumerate(folds):
        train = Moments.sum(folds[:i] + folds[i + 1 :])
        candidates = train.decompose().solve(alphas)
        error += held_out.risk(candidates).reshape(-1, N_ALPHAS).sum(axis=0)
    error /= sum(float(fold.weight.sum()) for fold in folds)
    as_good = error <= (1 + INDISTINGUISHABLE) * error.min()
    return float(alphas[as_good].max()), alphas, error


def splits(n_samples: int, groups=None) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Rows to train on and rows to test on, a pair a fold, dealt out as `EpisodeFolds` does.

    groups: episode labels (N,), or None. Raises `DataError` where there is one fold only.
    """
    fold = EpisodeFolds().assign(None if groups is None else np.asarray(groups), n_samples)
    present = np.unique(fold)
    if len(present) < 2:
        raise DataError(
            "cross-validation needs at least two episodes, or samples without groups, to hold some out"
        )
    for k in present:
        yield np.flatnonzero(fold != k), np.flatnonzero(fold == k)
