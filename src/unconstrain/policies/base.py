"""What the policies share: scikit-learn's contract, moments by fold, λ, and what a fit reports."""

import math
from abc import ABC, abstractmethod
from copy import copy
from pathlib import Path

import numpy as np
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted

from unconstrain import metrics
from unconstrain.arrays import (
    check_actions,
    check_choice,
    check_groups,
    check_number,
    check_projections,
    check_samples,
    check_states,
    check_weights,
)
from unconstrain.deploy import compilation, onnx
from unconstrain.deploy.compiled import CompiledPolicy
from unconstrain.errors import DataError, PolicyError
from unconstrain.fitting import solve as selection
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import RISKS, Sight, informative, sight, unknown
from unconstrain.fitting.posterior import Posterior
from unconstrain.fitting.tally import Tally
from unconstrain.motion import NO_MOTION, lengths, moving
from unconstrain.storage import Kind, save_object

NO_DIRECTION = (
    "all actions are zero, and a zero action has no direction to learn from: check the action columns, "
    "or differentiate the states over a longer window"
)

ADDED_UP = ("moments_", "folds_")
"""What only learning on, uncertainty and solving anew need: sums over samples, and the folds of episodes."""
LARGEST_DIMENSION = 10**6


class Policy(RegressorMixin, BaseEstimator, ABC):
    """Base of the estimators: `u = pi(x)`, linear in its parameters, fitted by adding up moments.

    A subclass says where its models lie (`_place`), how samples add up (`_moments`), and what the solution means
    (`_take_up`); everything else is here and the same for all.
    """

    moments_: list[Moments | None]  # by fold; None where a fold has no samples yet
    folds_: selection.EpisodeFolds  # with alpha="cv"
    n_actions_: int
    n_samples_seen_: int
    n_zero_actions_: int
    n_known_constraints_: int
    longest_action_: float
    shortest_action_: float

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

    def predict(self, X, return_std: bool = False, return_cov: bool = False):
        """Actions (N, d) at states X (N, n); (N,) if the policy was fitted to actions of that shape.

        return_std: also how far the policy may be from that, as standard deviations of the actions' shape.
        return_cov: also the covariances (N, d, d) of all actions; (N,) for actions (N,). Not both. See `uncertainty`.

        Raises `DataError` for states that are not finite or not of the dimension learnt, `PolicyError` for both.
        """
        check_is_fitted(self)
        if return_std and return_cov:
            raise PolicyError(
                "ask for return_std or return_cov, not both: the deviations are the roots of the covariance's diagonal"
            )
        X = check_states(self, X)
        actions = self._evaluate(X)
        if not (return_std or return_cov):
            return actions[:, 0] if self.actions_are_scalars_ else actions
        covariance = self._deviation(X, actions, self.posterior())
        spread = covariance if return_cov else np.sqrt(np.maximum(np.einsum("njj->nj", covariance), 0.0))
        if self.actions_are_scalars_:
            return actions[:, 0], spread.reshape(len(X))
        return actions, spread

    def posterior(self) -> Posterior:
        """What the samples say of the parameters and of their own noise: see `uncertainty`. Costs a decomposition.

        Each sample is taken to show one number, or d where nothing is projected. One whose projection is known may show
        more, which moments do not count; the noise is then overestimated, and deviations err on the side of caution.
        """
        check_is_fitted(self)
        seen = Moments.sum([fold for fold in self.moments_ if fold is not None])
        return Posterior.of(seen, self.n_actions_ if self.risk == "direct" else 1)

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
        return metrics.explained(U, P)

    def save(self, path: str | Path, *, resumable: bool = False) -> None:
        """Write the policy to a file that `load_policy` reads. Nothing in it is code.

        Parameters
        ----------
        path : path
            Customarily it ends in ``.skops``. An existing file is replaced.
        resumable : bool
            Keep the moments too. Without them the file is small, and the policy that is read back predicts, but cannot
            learn on (`partial_fit`), tell how sure it is (`return_std`), or be solved anew (`solved`).

        Raises
        ------
        UnconstrainError
            The place cannot be written to, or the policy holds something that cannot be saved, such as a lambda.
        """
        check_is_fitted(self)
        kept = copy(self)
        if not resumable:
            for name in ADDED_UP:
                kept.__dict__.pop(name, None)
        save_object(path, Kind.POLICY, kept, check_usable)

    def __getattr__(self, name: str):
        if name in ADDED_UP and "n_samples_seen_" in vars(self):
            raise PolicyError(
                "this policy was saved without its moments, which learning on, uncertainty and solving anew need: "
                "save it with save(path, resumable=True)"
            )
        raise AttributeError(f"{type(self).__name__} has no attribute {name!r}", name=name, obj=self)

    def compile(self) -> CompiledPolicy:
        """The fitted policy for a control loop: `step = policy.compile()`; `step(x)` for states (n,) or (N, n).

        A small immutable callable that does not need scikit-learn and agrees with `predict` to 1e-12 of the largest
        term either adds up, which is checked here. See `CompiledPolicy`. Raises `PolicyError` for features that
        cannot be compiled.
        """
        return compilation.compile_policy(self)

    def to_onnx(self, path: str | Path) -> None:
        """Write the policy to `path` as an ONNX model: input "x" (batch, n), output "u" (batch, d), float64.

        Needs the extra `onnx`. Raises `PolicyError` without it, and for policies that are neither linear, nor of
        normalised RBFs, nor locally linear.
        """
        onnx.save(self.compile(), path)

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

    def _placed_by_data(self) -> bool:
        """Whether `_place` depends on where the states lie, and not just on their dimension."""
        return True

    @abstractmethod
    def _moments(self, X: np.ndarray, seen: Sight, weights: np.ndarray | None = None) -> Moments:
        """The samples, added up, whatever precision they come in."""

    @abstractmethod
    def _take_up(self, w: np.ndarray) -> None:
        """Keep the solution w (..., P), in the order of the rows of W, as learnt attributes."""

    @abstractmethod
    def _parameters(self) -> np.ndarray:
        """What `_take_up` took up: w (..., P), in the order of the rows of W."""

    @abstractmethod
    def _evaluate(self, X: np.ndarray) -> np.ndarray:
        """Actions (N, d) at checked states X (N, n)."""

    @abstractmethod
    def _deviation(self, X: np.ndarray, P: np.ndarray, posterior: Posterior) -> np.ndarray:
        """Second moments (N, d, d) of what separates the policy from predictions P (N, d), at checked states."""

    def _add(self, X, y, groups, sample_weight, projections, *, first: bool):
        self._check_options()
        U = check_actions(y)
        weights = check_weights(sample_weight, X)
        groups = check_groups(groups, len(X))
        N = self._checked_projections(projections, U)
        if not first and U.shape[1] != self.n_actions_:
            raise DataError(
                f"actions have {U.shape[1]} dimensions, but this policy has learnt {self.n_actions_}"
            )
        longest = max(np.linalg.norm(U, axis=1).max(), 0.0 if first else self.longest_action_)
        if first:
            counted = self._counted(moving(U, longest), weights, N)
            if not counted.any():
                raise DataError(NO_DIRECTION)
            self._begin(X[counted], U.shape[1], weights[counted], scalars=np.ndim(y) == 1)
        fold = self.folds_.assign(groups, len(X)) if self.alpha == "cv" else None
        self._include(self._tally(X, U, fold, weights, N, longest))
        self._solve()
        return self

    def _check_options(self) -> None:
        check_choice(self.risk, "risk", RISKS)
        if isinstance(self.alpha, str):
            check_choice(self.alpha, "alpha, where it is not a number,", ("cv",))
        else:
            check_number(self.alpha, "alpha", positive=False)

    def _begin(self, X: np.ndarray, d: int, weights: np.ndarray, *, scalars: bool) -> None:
        """Place what depends on data by states X (N, n), weighted (N,), and forget what was added before."""
        self._place(X, d, weights)
        self.moments_ = []
        self.n_actions_ = d
        self.actions_are_scalars_ = scalars
        self.n_samples_seen_, self.n_zero_actions_, self.n_known_constraints_ = 0, 0, 0
        self.longest_action_, self.shortest_action_ = 0.0, math.inf
        if self.alpha == "cv":
            self.folds_ = selection.EpisodeFolds()

    def _tally(
        self,
        X: np.ndarray,
        U: np.ndarray,
        fold: np.ndarray | None = None,
        weights: np.ndarray | None = None,
        projections: np.ndarray | None = None,
        longest: float = 0.0,
    ) -> Tally:
        """What checked samples add, by fold (N,), once all is placed. Changes nothing here, so threads may share it.

        `longest`: the longest action known so far, if that is not among these.
        """
        r = lengths(U)
        longest = max(float(r.max(initial=0.0)), longest)
        moves = r > NO_MOTION * longest
        counted = self._counted(moves, weights, projections)
        seen = sight(self.risk, U, projections, np.where(moves, r, 0.0))
        moments: list[Moments | None] = [None] * (1 if fold is None else 1 + int(fold.max(initial=0)))
        for k in [0] if fold is None else np.unique(fold[counted]):
            rows = counted if fold is None else counted & (fold == k)
            if not rows.any():
                continue
            if rows.all():
                moments[k] = self._moments(X, seen, weights)
            else:
                index = np.flatnonzero(rows)
                taken = None if weights is None else weights[index]
                # Stored a row a dimension, along which sums run.
                moments[k] = self._moments(X.T.take(index, axis=1).T, seen[index], taken)
        return Tally(
            tuple(moments),
            n_samples=len(U),
            n_zero=len(U) - int(np.count_nonzero(moves)),
            longest=longest,
            shortest=float(r.min(initial=math.inf, where=moves)),
            n_known=0 if projections is None else int(np.count_nonzero(~unknown(projections))),
        )

    def _counted(
        self, moves: np.ndarray, weights: np.ndarray | None, projections: np.ndarray | None
    ) -> np.ndarray:
        """Which samples say something, (N,): without motion or a projection there is no direction to say it of."""
        if self.risk == "auto" and projections is not None:
            moves = moves | informative(projections)
        counted = np.ones_like(moves) if self.risk in ("direct", "constrained") else moves
        return counted if weights is None else counted & (weights > 0)

    def _include(self, tally: Tally) -> None:
        total = Tally(
            tuple(self.moments_),
            n_samples=self.n_samples_seen_,
            n_zero=self.n_zero_actions_,
            longest=self.longest_action_,
            # Policies saved before these were kept know no shorter one than any, and of no constraint.
            shortest=getattr(self, "shortest_action_", math.inf),
            n_known=getattr(self, "n_known_constraints_", 0),
        )
        total += tally
        self.moments_ = list(total.moments)
        self.n_samples_seen_, self.n_zero_actions_ = total.n_samples, total.n_zero
        self.longest_action_, self.shortest_action_ = total.longest, total.shortest
        self.n_known_constraints_ = total.n_known

    def _check_uses_projections(self) -> None:
        if self.risk not in ("auto", "constrained"):
            raise PolicyError(
                f'projections are for risk="auto" and "constrained", and this policy has risk="{self.risk}"'
            )

    def _checked_projections(self, projections, U: np.ndarray) -> np.ndarray | None:
        if projections is None:
            if self.risk == "constrained":
                raise PolicyError(
                    'risk="constrained" needs the projections of the samples: fit(X, U, projections=N)'
                )
            return None
        self._check_uses_projections()
        return check_projections(projections, *U.shape, unknown=self.risk == "auto")

    def _solve(self) -> None:
        folds = [fold for fold in self.moments_ if fold is not None]
        total = Moments.sum(folds)
        if self.alpha == "cv":
            spectrum = total.decompose()
            chosen = selection.choose_alpha(folds, float(spectrum.values.max()))
            self.alpha_, self.alphas_, self.held_out_risk_ = chosen
            w = spectrum.solve([self.alpha_])[..., 0, :]
        else:
            self.alpha_ = float(self.alpha)
            w = total.solve(self.alpha_)
        self._take_up(w.swapaxes(-1, -2).reshape(*w.shape[:-2], -1))

    def __sklearn_tags__(self):
        tags = super().__sklearn_tags__()
        tags.target_tags.single_output = True
        tags.target_tags.multi_output = True
        return tags


def check_usable(policy: Policy) -> None:
    """Check that a policy is fitted and acts at the origin.

    Parameters
    ----------
    policy : Policy

    Raises
    ------
    ValueError
        It does not act there, and something else where it cannot act at all.
    """
    check_is_fitted(policy)
    n, d = policy.n_features_in_, policy.n_actions_
    if not all(isinstance(each, int) and 0 < each <= LARGEST_DIMENSION for each in (n, d)):
        raise TypeError("it has no dimensions")
    actions = policy.predict(np.zeros((1, n)))
    if actions.reshape(1, -1).shape != (1, d) or (actions.ndim == 1) != policy.actions_are_scalars_:
        raise TypeError(f"its actions have shape {actions.shape}")
    if not np.isfinite(actions).all():
        raise ValueError("its actions are not finite")
