"""What the policies share: scikit-learn's contract, moments by fold, λ, and what a fit reports."""

from abc import ABC, abstractmethod
from copy import copy
from pathlib import Path

import numpy as np
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted

from unconstrain import risk as risks
from unconstrain import selection
from unconstrain.errors import DataError, PolicyError
from unconstrain.moments import Moments
from unconstrain.policies import persistence
from unconstrain.validation import (
    check_actions,
    check_choice,
    check_groups,
    check_number,
    check_projections,
    check_samples,
    check_states,
    check_weights,
)


class Policy(RegressorMixin, BaseEstimator, ABC):
    """Base of the estimators: `u = pi(x)`, linear in its parameters, fitted by adding up moments.

    A subclass says where its models lie (`_place`), how samples add up (`_moments`), and what the solution means
    (`_take_up`); everything else is here and the same for all.
    """

    moments_: list[Moments | None]  # by fold; None where a fold has no samples yet
    n_actions_: int
    longest_action_: float

    def fit(self, X, y, *, groups=None, sample_weight=None, projections=None):
        """Learn from states X (N, n) and actions y (N, d), or (N,) for d = 1.

        groups: episode labels (N,), the folds for `alpha="cv"`; without them contiguous blocks are the folds.
        sample_weight: (N,), multiplies each sample's squared error.
        projections: N (N, d, d), what is known of each sample's constraint, for the risks "auto" and "constrained"; for
            "auto" all NaN where it is not known (see `constraints`).

        Raises `DataError` for bad arrays, and where all actions are zero though the risk needs their direction;
        `PolicyError` for bad options.
        """
        X, y = check_samples(self, X, y, reset=True, min_samples=2)
        return self._add(X, y, groups, sample_weight, projections, first=True)

    def partial_fit(self, X, y, *, groups=None, sample_weight=None, projections=None):
        """Learn from more samples; the result is that of one `fit` on all samples so far.

        That is exact whatever the pieces when λ is a number and nothing is placed by the data (linear features,
        centres given). Centres and other data-dependent features are placed by the first piece and kept; with
        `alpha="cv"` give `groups`, whose episodes stay in their fold from piece to piece.
        """
        first = not hasattr(self, "moments_")
        X, y = check_samples(self, X, y, reset=first, min_samples=2 if first else 1)
        return self._add(X, y, groups, sample_weight, projections, first=first)

    def predict(self, X) -> np.ndarray:
        """Actions (N, d) at states X (N, n); (N,) if the policy was fitted to actions of that shape.

        Raises `DataError` for states that are not finite or not of the dimension learnt.
        """
        check_is_fitted(self)
        actions = self._evaluate(check_states(self, X))
        return actions[:, 0] if self.actions_are_scalars_ else actions

    def score(self, X, y, sample_weight=None) -> float:
        """Share of observed motion explained, `1 - Σ (r - û·pi(x))² / Σ r²`, at most 1.

        Whatever risk the policy was fitted with, so that policies can be compared. X (N, n), y (N, d) or (N,),
        sample_weight (N,). Raises `DataError` where nothing moves.
        """
        U = check_actions(y)
        P = check_actions(self.predict(X), "predictions")
        if sample_weight is not None:
            root = np.sqrt(check_weights(sample_weight, U))[:, None]
            U, P = U * root, P * root
        return selection.explained(U, P)

    def save(self, path: str | Path) -> None:
        """Write the policy to `path` (customarily `.skops`), to be read by `load_policy`. Holds no pickle."""
        check_is_fitted(self)
        persistence.save(self, path)

    def solved(self, *, without: int | None = None):
        """A copy of this fitted policy, solved anew for its `alpha`, leaving out the samples of one fold if asked.

        With `alpha="cv"` λ is chosen anew as well, among the folds left. Costs no pass over the data: it is what
        makes cross-validation of a whole policy cheap. Raises `DataError` where nothing is left to learn from.
        """
        check_is_fitted(self)
        left = copy(self)
        left.moments_ = [None if k == without else part for k, part in enumerate(self.moments_)]
        if not any(part is not None for part in left.moments_):
            raise DataError(
                "all motion lies in one fold, so none is left without it: give more episodes, or no groups"
            )
        left._solve()
        return left

    @abstractmethod
    def _place(self, X: np.ndarray, d: int, weights: np.ndarray) -> None:
        """Fix what depends on data before any sample is added."""

    @abstractmethod
    def _moments(self, X: np.ndarray, seen: risks.Sight, weights: np.ndarray) -> Moments:
        """The samples, added up."""

    @abstractmethod
    def _take_up(self, w: np.ndarray) -> None:
        """Keep the solution w (..., P), in the order of the rows of W, as learnt attributes."""

    @abstractmethod
    def _evaluate(self, X: np.ndarray) -> np.ndarray:
        """Actions (N, d) at checked states X (N, n)."""

    def _add(self, X, y, groups, sample_weight, projections, *, first: bool):
        check_choice(self.risk, "risk", risks.RISKS)
        if isinstance(self.alpha, str):
            check_choice(self.alpha, "alpha, where it is not a number,", ("cv",))
        else:
            check_number(self.alpha, "alpha", positive=False)
        U = check_actions(y)
        weights = check_weights(sample_weight, X)
        groups = check_groups(groups, len(X))
        N = self._checked_projections(projections, U)
        if not first and U.shape[1] != self.n_actions_:
            raise DataError(
                f"actions have {U.shape[1]} dimensions, but this policy has learnt {self.n_actions_}"
            )

        scale = max(np.linalg.norm(U, axis=1).max(), 0.0 if first else self.longest_action_)
        moves = risks.moving(U, scale)
        kept = self._counted(moves, weights, N)
        if not kept.any() and first:
            raise DataError(
                "all actions are zero, and a zero action has no direction to learn from: check the action columns, "
                "or differentiate the states over a longer window"
            )
        fold = self._fold_of_samples(groups, len(X), first)
        if first:
            self._place(X[kept], U.shape[1], weights[kept])
            self.moments_ = [None] * (fold.max(initial=0) + 1)
            self.n_actions_ = U.shape[1]
            self.actions_are_scalars_ = np.ndim(y) == 1
            self.n_samples_seen_, self.n_zero_actions_ = 0, 0
        self.longest_action_ = float(scale)
        self.n_samples_seen_ += len(U)
        self.n_zero_actions_ += int(np.count_nonzero(~moves))

        seen = risks.sight(self.risk, U, N)
        self.moments_ += [None] * (fold.max(initial=0) + 1 - len(self.moments_))
        for k in np.unique(fold[kept]):
            rows = kept & (fold == k)
            index = slice(None) if rows.all() else np.flatnonzero(rows)
            part = self._moments(X[index], seen[index], weights[index])
            self.moments_[k] = part if self.moments_[k] is None else self.moments_[k] + part
        self._solve()
        return self

    def _counted(self, moves: np.ndarray, weights: np.ndarray, projections: np.ndarray | None) -> np.ndarray:
        """Which samples say something, (N,): without motion or a projection there is no direction to say it of."""
        if self.risk == "auto" and projections is not None:
            moves = moves | risks.informative(projections)
        return (moves | (self.risk in ("direct", "constrained"))) & (weights > 0)

    def _checked_projections(self, projections, U: np.ndarray) -> np.ndarray | None:
        if self.risk not in ("auto", "constrained") and projections is not None:
            raise PolicyError(
                f'projections are for risk="auto" and "constrained", and this policy has risk="{self.risk}"'
            )
        if projections is None and self.risk != "constrained":
            return None
        if projections is None:
            raise PolicyError(
                'risk="constrained" needs the projections of the samples: fit(X, U, projections=N)'
            )
        return check_projections(projections, *U.shape, unknown=self.risk == "auto")

    def _fold_of_samples(self, groups, n_samples: int, first: bool) -> np.ndarray:
        if self.alpha != "cv":
            return np.zeros(n_samples, dtype=int)
        if first:
            self.folds_ = selection.EpisodeFolds()
        return self.folds_.assign(groups, n_samples)

    def _solve(self) -> None:
        folds = [fold for fold in self.moments_ if fold is not None]
        spectrum = Moments.sum(folds).decompose()
        if self.alpha == "cv":
            chosen = selection.choose_alpha(folds, float(spectrum.values.max()))
            self.alpha_, self.alphas_, self.held_out_risk_ = chosen
        else:
            self.alpha_ = float(self.alpha)
        w = spectrum.solve([self.alpha_])[..., 0, :]
        self._take_up(w.swapaxes(-1, -2).reshape(*w.shape[:-2], -1))

    def __sklearn_tags__(self):
        tags = super().__sklearn_tags__()
        tags.target_tags.single_output = True
        tags.target_tags.multi_output = True
        return tags
