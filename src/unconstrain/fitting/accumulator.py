"""The object that every fit drives: it adds samples up, merges with others, and solves.

A fit in memory adds all samples at once. A stream adds them block by block, computing the sums of several blocks at a
time in threads. A cluster gives each worker an empty copy, and merges what comes back. The result is the same.
"""

import math
import operator
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial, reduce
from typing import Any

import numpy as np

from unconstrain.arrays import check_lets_through
from unconstrain.errors import DataError
from unconstrain.fitting.contact import Belief, Tally, episode_starts, infer, judge
from unconstrain.fitting.corrected import CorrectedMoments, Part, add_up
from unconstrain.fitting.correction import Correction
from unconstrain.fitting.in_space import in_units
from unconstrain.fitting.model import LinearModel
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import Observation, informative, observe, unknown
from unconstrain.fitting.region import Region
from unconstrain.fitting.solve import EpisodeFolds, choose_alpha
from unconstrain.fitting.sums import Sums
from unconstrain.fitting.wide.choice import choose_alpha as choose_alpha_of_held
from unconstrain.fitting.wide.decay import WideDecay
from unconstrain.fitting.wide.held import HeldSamples, is_wide
from unconstrain.motion import NO_MOTION, lengths
from unconstrain.samples import Samples

OUT_OF_REACH = (
    "every sample is so far from all centres that it counts for none of them: place the centres among the states, or "
    "give a larger width"
)
NO_DIRECTION = (
    "no action moves, and without motion there is no direction to learn from: check the action columns, or "
    "differentiate the states over a longer window"
)

# An action that leaves so few others as motion is a mistake in the data: in a recording of one, rounding is not that
# common.
LEAST_MOVING_SHARE, LEAST_MOVING = 0.01, 1


@dataclass(frozen=True)
class Solution:
    """The parameters that moments determine, and what their choice was based on.

    Parameters
    ----------
    w : ndarray of shape (P,) or (S, P), or object
        Parameters of the model, or of each of S models; of a regression, the fitted regressor.
    alpha : float
        The weight decay λ, a pure number; see `fitting.decay`. NaN where there is none.
    alphas, held_out_risk : ndarray of shape (L,), optional
        The candidates for λ and their held-out risk in squared units of the action, where λ was chosen.
    n_samples, n_zero, n_known : int
        How many samples were added, how many of them do not move, and of how many the projection is known.
    belief : Belief, optional
        What was inferred of contact and noise, with these parameters.
    free_share : float
        Share of samples that were free, as inferred.
    evidence : float
        How many independent samples one is worth, by its residuals.
    record : Record
        How that was found.
    regions : tuple of Region or None
        By fold: where the samples lie.
    usual_speed : float
        Root mean square length of the actions, where no sums are kept that tell it.
    noise, residual : float
        For "corrected": variance of the noise, and of what one sample shows about the policy (`Correction.residual`),
        in squared units of the action; else NaN.
    doubt : str
        For "corrected": why that may be wrong, in a sentence.
    """

    w: Any
    alpha: float = math.nan
    alphas: np.ndarray | None = None
    held_out_risk: np.ndarray | None = None
    n_samples: int = 0
    n_zero: int = 0
    n_known: int = 0
    belief: Belief | None = None
    free_share: float = math.nan
    evidence: float = 1.0
    record: "Record" = field(default_factory=lambda: Record())
    regions: tuple[Region | None, ...] = ()
    usual_speed: float = math.nan
    noise: float = math.nan
    residual: float = math.nan
    doubt: str = ""


@dataclass(frozen=True)
class Record:
    """How contact was inferred.

    Parameters
    ----------
    log_likelihoods : dict of str to float
        Held-out log-likelihood of a sample, by what was assumed; the first is what was chosen.
    history : tuple of dict
        One for each pass: what was assumed, log-likelihood, noise, and share of free samples.
    repeated : float
        Mean product of held-out residuals that follow each other, ε², in squared units of the action; see
        `fitting.calibration`.
    regression : Solution, optional
        Ordinary regression by the same model to the same samples, where inference began with it.
    n_anew : int
        How many samples there were when contact was last inferred anew, and not from a policy at hand.
    beginning : str
        Where a policy was given to go on from: whether it was, and if not, why.
    """

    log_likelihoods: dict[str, float] = field(default_factory=dict)
    history: tuple[dict[str, Any], ...] = ()
    repeated: float = 0.0
    regression: Solution | None = None
    n_anew: int = 0
    beginning: str = ""


class Accumulator:
    """Sums of samples under a model, from which its parameters are solved.

    Parameters
    ----------
    model : LinearModel
        What samples are summed under.
    risk : {"adaptive", "corrected", "inconsistency", "direct", "whole"}
        What a sample says of the policy; "whole" is direct where nothing is known of the projection.
    alpha : float or "cv"
        The weight decay λ; "cv" chooses it by held-out risk, which keeps the sums of each fold apart.
    longest : float
        Length of the longest action known beforehand, beside which others have no motion.
    folds : EpisodeFolds, optional
        Folds to go on dealing to.
    belief : Belief, optional
        For "adaptive": what is inferred from.
    scale : float
        For "adaptive": mean squared length of the actions, in squared units of the action.
    record : Record
        For "adaptive": how the belief was found.
    noise : float
        Variance of the actions' noise that is known beforehand, in squared units of the action; 0 where nothing is. For
        "adaptive" the noise that is inferred is not below it; for "corrected" no more is taken away.
    unit : ndarray of shape (m,), optional
        Along each dimension of the states as features see them: in what distances from the samples are counted.

    Attributes
    ----------
    folds : EpisodeFolds or None
        None where λ is a number.
    total : Sums
        What was added so far.
    is_judged : bool
        For "adaptive": whether the sums that λ is chosen by are kept too.
    finds_region : bool
        Whether it is kept where samples lie.
    holds : bool
        Whether samples are held instead of summed up, since the model is wide (`fitting.wide`).
    compared : tuple of tuple of Belief
        For "adaptive": beliefs whose likelihood is summed up, instead of moments; each one for all samples, or one for
        each fold.
    predict : callable or None
        For "adaptive": predicts the actions that samples are judged by, from states (N, n); None for the model with the
        belief's parameters.
    """

    def __init__(
        self,
        model: LinearModel,
        risk: str = "inconsistency",
        alpha: float | str = "cv",
        longest: float = 0.0,
        folds: EpisodeFolds | None = None,
        belief: Belief | None = None,
        scale: float = 1.0,
        record: Record | None = None,
        noise: float = 0.0,
        unit: np.ndarray | None = None,
    ):
        self.model = model
        self.risk = risk
        self.alpha = alpha
        self.longest = longest
        self.folds = (folds or EpisodeFolds()) if alpha == "cv" else None
        self.belief = belief
        self.scale = scale
        self.record = record or Record()
        self.noise = noise
        self.unit = unit
        self.finds_region = unit is not None
        self.is_judged = alpha == "cv"
        self.compared: tuple[tuple[Belief, ...], ...] = ()
        self.holds = False
        self.predict: Callable[[np.ndarray], np.ndarray] | None = None
        self.total = Sums()
        # By fold, how coarse the boxes of earlier samples became: those of later ones need not begin finer.
        self._coarseness: list[int] = []

    def add(self, samples: Samples) -> None:
        """Add samples up.

        Parameters
        ----------
        samples : Samples
            Checked: finite, of the model's dimensions, in their own units.

        Raises
        ------
        DataError
            An action is so long that hardly any other is motion beside it.
        """
        self.include(self.sums(samples, self.deal(samples)))

    def deal(self, samples: Samples) -> np.ndarray | None:
        """Deal new episodes out to folds.

        Parameters
        ----------
        samples : Samples
            Checked.

        Returns
        -------
        ndarray of shape (N,), int or None
            The fold of each sample; None where λ is a number.
        """
        return None if self.folds is None else self.folds.assign(samples.groups, len(samples.states))

    def sums(self, samples: Samples, fold: np.ndarray | None = None) -> Sums:
        """Compute what samples add.

        The accumulator stays as it is, so threads may call this side by side.

        Parameters
        ----------
        samples : Samples
            Checked.
        fold : ndarray of shape (N,), int, optional
            From `deal`.

        Returns
        -------
        Sums
            Moments by fold, and counts.

        Raises
        ------
        DataError
            An action is so long that hardly any other is motion beside it, or a known projection does not let its
            sample's own action through.
        """
        samples = in_units(self.model.scale, samples)
        U = samples.actions
        r = lengths(U)
        longest = max(float(r.max(initial=0.0)), self.longest)
        moves = r > NO_MOTION * longest
        _check_outlier(r, moves)
        if samples.projections is not None:
            check_lets_through(samples.projections, U)
        counted = find_informative_samples(self.risk, samples, moves)
        counts = Sums(
            n_samples=len(U),
            n_zero=len(U) - int(np.count_nonzero(moves)),
            n_known=0 if samples.projections is None else int(np.sum(~unknown(samples.projections))),
            longest=longest,
            regions=self._find_regions(samples, fold),
        )
        if self.risk == "adaptive" and samples.weights is not None and not samples.weights.all():
            # Left out here, so that they do not speak for their neighbours either.
            rows = np.flatnonzero(samples.weights)
            samples, counted = samples.select(rows), counted[rows]
            fold = None if fold is None else fold[rows]
        if not len(samples.states) and self.risk == "adaptive":
            return counts
        if self.compared:
            return replace(
                counts, tallies=tuple(self._compare(each, samples, fold) for each in self.compared)
            )
        if self.risk == "corrected":
            by_fold = _apart(counted, fold, lambda rows: self._corrected(samples, rows))
            return replace(counts, moments=by_fold)
        if self.risk != "adaptive":
            observation = observe(self.risk, U, samples.projections, np.where(moves, r, 0.0))
            moments = self._by_fold(samples, observation, counted, fold)
            return replace(counts, moments=moments, shortest=float(r.min(initial=math.inf, where=moves)))
        assert self.belief is not None
        if self.predict is None:
            found = infer(self.model, self.belief, samples)
        else:
            found = judge(self.predict(samples.states), self.belief, samples)
        moments = self._by_fold(samples, found.expand(), counted, fold)
        judges: tuple[Any, ...] = ()
        if self.is_judged:
            judges = self._by_fold(
                samples, found.judge(self.scale, 0.0 if self.belief.is_cooling else None), counted, fold
            )
        shortest = float(r.min(initial=math.inf, where=moves))
        return replace(counts, moments=moments, judges=judges, tallies=(found.tally,), shortest=shortest)

    def include(self, sums: Sums) -> None:
        """Add sums to those there are.

        Parameters
        ----------
        sums : Sums
            From `sums`.
        """
        self.total = self.total + sums

    def merge(self, other: "Accumulator") -> None:
        """Add what another accumulator of the same model has summed of the samples that follow these.

        Parameters
        ----------
        other : Accumulator
            Episodes that it dealt out by itself are counted on from those dealt out here.
        """
        sums = other.total
        if self.folds is not None and other.folds is not None and other.folds.n_dealt:
            sums = sums.rotated(self.folds.n_dealt % self.folds.n_folds, self.folds.n_folds)
            self.folds.deal_unnamed(other.folds.n_dealt)
        self.include(sums)

    def empty(self, known_folds: dict | None = None, longest: float | None = None) -> "Accumulator":
        """Make an accumulator of the same model and options to which nothing was added.

        Parameters
        ----------
        known_folds : dict, optional
            Folds of the episodes that it will see, where they were dealt out before.
        longest : float, optional
            Length of the longest action known; by default what is known here.

        Returns
        -------
        Accumulator
            Empty.
        """
        folds = None if self.folds is None else EpisodeFolds(self.folds.n_folds, known_folds)
        other = Accumulator(
            self.model,
            self.risk,
            self.alpha,
            self.longest if longest is None else longest,
            folds,
            self.belief,
            self.scale,
            self.record,
            self.noise,
            self.unit,
        )
        other.is_judged, other.compared = self.is_judged, self.compared
        other.finds_region, other.holds, other.predict = self.finds_region, self.holds, self.predict
        return other

    def copy(self) -> "Accumulator":
        """Copy the accumulator; the copies share their sums, which never change themselves.

        Returns
        -------
        Accumulator
            With the same sums.
        """
        other = self.empty()
        other.folds = None if self.folds is None else self.folds.copy()
        other.total = self.total
        return other

    def without_labels(self) -> "Accumulator":
        """Copy the sums and the number of episodes, without the episodes' labels.

        Labels need not travel between machines.

        Returns
        -------
        Accumulator
            With the same sums.
        """
        other = self.copy()
        if other.folds is not None:
            other.folds.fold_of.clear()
        return other

    def moments(self, without: int | None = None) -> Moments:
        """Add up all folds, or all but one.

        Parameters
        ----------
        without : int, optional
            The fold left out.

        Returns
        -------
        Moments
            Their sum.

        Raises
        ------
        DataError
            There is nothing to learn from.
        """
        total = self.observed(without)
        return total.summed() if isinstance(total, HeldSamples) else total

    def observed(self, without: int | None = None) -> Moments | HeldSamples:
        """Add up all folds, or all but one, as they are kept.

        Parameters
        ----------
        without : int, optional
            The fold left out.

        Returns
        -------
        Moments or HeldSamples
            Their sum.

        Raises
        ------
        DataError
            There is nothing to learn from.
        """
        return self._observed(add_up(self._folds(without)))

    def by_fold(self) -> list[Moments | None]:
        """List the moments by fold, those of "corrected" for the noise of all.

        Returns
        -------
        list of Moments or None
            None where a fold has no samples.
        """
        parts = self.total.moments
        if self.risk != "corrected":
            parts = tuple(part.summed() if isinstance(part, HeldSamples) else part for part in parts)
            return [part if isinstance(part, Moments) else None for part in parts]
        correction = Correction.of(add_up(self._folds(None)), self.noise)
        return [
            part.at(correction.variance, correction.scale) if isinstance(part, CorrectedMoments) else None
            for part in parts
        ]

    def solve(
        self,
        alpha: float | str | None = None,
        without: int | None = None,
        *,
        near: float | None = None,
    ) -> Solution:
        """Solve for the parameters.

        Parameters
        ----------
        alpha : float or "cv", optional
            The weight decay λ, or "cv" where the sums were kept by fold. By default as at the beginning.
        without : int, optional
            A fold to leave out; λ is then chosen among the others. It costs no pass over the data.
        near : float, optional
            About where λ is. Of held samples, for which each candidate costs passes, only those near it are tried.

        Returns
        -------
        Solution
            The parameters, and what their choice was based on.

        Raises
        ------
        DataError
            There is nothing to learn from, or too few folds to choose λ.
        """
        alpha = self.alpha if alpha is None else alpha
        folds = self._folds(without)
        if self.risk == "corrected":
            return self._solve_corrected(folds, alpha)
        judges: list[Any] = [
            part for k, part in enumerate(self.total.judges) if part is not None and k != without
        ]
        if isinstance(folds[0], HeldSamples):
            return self._solve_held(folds, judges or None, alpha, near)
        total = add_up(folds)
        decay = self.model.decay(total)
        if alpha != "cv":
            return self._solution(decay.solve(total, float(alpha)), float(alpha))
        chosen, alphas, risk = choose_alpha(folds, self.model.decay, judges or None)
        return self._solution(decay.solve(total, chosen), chosen, alphas, risk)

    def _solve_held(
        self,
        folds: list[HeldSamples],
        judges: list[HeldSamples] | None,
        alpha: float | str,
        near: float | None,
    ) -> Solution:
        """Solve by conjugate gradients, from the parameters that are believed so far."""
        decay = WideDecay(folds, judges)
        start = None if self.belief is None else self.belief.w
        if alpha != "cv":
            return self._solution(decay.solve(float(alpha), start), float(alpha))
        chosen, alphas, risk = choose_alpha_of_held(decay, near)
        return self._solution(decay.solve(chosen, start), chosen, alphas, risk)

    def _solve_corrected(self, folds: list[Any], alpha: float | str) -> Solution:
        """Find the noise of all folds together, and solve what is observed beyond it."""
        total, d = add_up(folds), self.model.n_actions
        correction = Correction.of(total, self.noise)
        observed = correction.observed(total)
        chosen, alphas, risk = alpha, None, None
        if chosen == "cv":
            judges = [correction.judge(part) for part in folds]
            chosen, alphas, risk = choose_alpha(folds, self.model.decay, judges, correction.observed)
        w = self.model.decay(observed).solve(observed, float(chosen))
        size = correction.size(total, w)
        return replace(
            self._solution(w, float(chosen), alphas, risk),
            noise=correction.variance,
            residual=correction.residual(d, size),
            doubt=correction.doubt(d, size),
        )

    def _observed(self, total: Any) -> Moments:
        """Return what parameters are solved from."""
        return Correction.of(total, self.noise).observed(total) if self.risk == "corrected" else total

    def _solution(
        self,
        w: np.ndarray,
        alpha: float,
        alphas: np.ndarray | None = None,
        held_out_risk: np.ndarray | None = None,
    ) -> Solution:
        total, parameters = self.total, self.model.parameters(w)
        counts = (total.n_samples, total.n_zero, total.n_known)
        solution = Solution(parameters, alpha, alphas, held_out_risk, *counts, regions=total.regions)
        if self.belief is None:
            return solution
        return replace(
            solution,
            belief=replace(self.belief, w=parameters),
            free_share=total.tallies[0].free_share,
            evidence=total.tallies[0].evidence,
            record=self.record,
        )

    def _find_regions(self, samples: Samples, fold: np.ndarray | None) -> tuple[Region | None, ...]:
        if not self.finds_region or self.unit is None:
            return ()
        counts = np.ones(len(samples.states), dtype=bool) if samples.weights is None else samples.weights > 0
        Z, unit, reached = self.model.lay_out(samples.states), self.unit, self._coarseness
        known = [0 if region is None else region.coarseness for region in self.total.regions]

        def find(rows: np.ndarray, k: int) -> Region:
            while len(reached) <= k:  # zeros, since another thread may do the same meanwhile
                reached.append(0)
            begun = max(reached[k], known[k] if k < len(known) else 0)
            region = Region.of(Z if rows.all() else Z[rows], unit, begun)
            reached[k] = max(reached[k], region.coarseness)
            return region

        numbers = [0] if fold is None else range(1 + int(fold.max(initial=0)))
        inside = [counts if fold is None else counts & (fold == k) for k in numbers]
        return tuple(find(rows, k) if rows.any() else None for k, rows in enumerate(inside))

    def _folds(self, without: int | None) -> list[Any]:
        folds = [part for k, part in enumerate(self.total.moments) if part is not None and k != without]
        if folds:
            if not any(np.any(part.weight) for part in folds):
                raise DataError(OUT_OF_REACH)
            return folds
        if without is None:
            raise DataError(NO_DIRECTION)
        raise DataError(
            "all motion lies in one fold, so none is left without it: give more episodes, or no groups"
        )

    def _by_fold(
        self, samples: Samples, observation: Observation, counted: np.ndarray, fold: np.ndarray | None
    ) -> tuple[Part | None, ...]:
        return _apart(counted, fold, lambda rows: self._moments(samples, observation, rows))

    def _corrected(self, samples: Samples, rows: np.ndarray) -> CorrectedMoments:
        return CorrectedMoments.of(
            self.model, samples if rows.all() else samples.select(np.flatnonzero(rows))
        )

    def _compare(self, beliefs: tuple[Belief, ...], samples: Samples, fold: np.ndarray | None) -> Tally:
        """Sum up the likelihood of samples under beliefs: one for all, or one for each fold."""
        if fold is None or len(beliefs) == 1 or not len(fold):
            return infer(self.model, beliefs[0], samples).tally
        if samples.groups is not None:
            # An episode that comes back is another, also where those in between are of other folds.
            samples = samples._replace(groups=np.cumsum(episode_starts(samples)))
        tallies = []
        for k in np.unique(fold).tolist():
            rows = fold == k
            part = samples.select(rows)
            tallies.append(infer(self.model, beliefs[k], part).tally)
        return reduce(operator.add, tallies)

    def _moments(self, samples: Samples, observation: Observation, rows: np.ndarray) -> Part:
        X, weights = samples.states, samples.weights
        # Where whole actions are observed, as by the regression that inference begins with, H is smaller.
        holds = self.holds and is_wide(
            self.model, X[:1], whole=observation.whole, chooses_alpha=self.alpha == "cv"
        )
        add: Callable[..., Any] = partial(HeldSamples.of, self.model) if holds else self.model.moments
        if rows.all():
            return add(X, observation, weights)
        index = np.flatnonzero(rows)
        # Stored a row a dimension, along which sums run.
        taken = None if weights is None else weights[index]
        return add(X.T.take(index, axis=1).T, observation[index], taken)


def find_informative_samples(risk: str, samples: Samples, moves: np.ndarray) -> np.ndarray:
    """Find the samples that say something of the policy.

    Parameters
    ----------
    risk : {"adaptive", "corrected", "inconsistency", "direct", "whole"}
        Under the inconsistency, a sample that does not move says something only where its projection is known and not
        zero.
    samples : Samples
        N samples.
    moves : ndarray of shape (N,), bool
        Which of them move.

    Returns
    -------
    ndarray of shape (N,), bool
        True for those that count.
    """
    if risk != "inconsistency":
        says = np.ones_like(moves)
    else:
        says = moves if samples.projections is None else moves | informative(samples.projections)
    return says if samples.weights is None else says & (samples.weights > 0)


def _apart(
    counted: np.ndarray, fold: np.ndarray | None, add: Callable[[np.ndarray], Part]
) -> tuple[Part | None, ...]:
    """Add samples up fold by fold, given what adds up those that a mask (N,) names."""
    parts: list[Part | None] = [None] * (1 if fold is None else 1 + int(fold.max(initial=0)))
    for k in [0] if fold is None else np.unique(fold[counted]).tolist():
        rows = counted if fold is None else counted & (fold == k)
        if rows.any():
            parts[k] = add(rows)
    return tuple(parts)


def _check_outlier(r: np.ndarray, moves: np.ndarray) -> None:
    """Refuse a batch in which one action is so long that nothing else is motion."""
    nonzero, moving = np.count_nonzero(r), np.count_nonzero(moves)
    if moving == 0 or nonzero - moving < 3 or moving > max(LEAST_MOVING, LEAST_MOVING_SHARE * nonzero):
        return
    typical = float(np.median(r[(r > 0) & ~moves]))
    raise DataError(
        f"the action in row {int(np.argmax(r))} is {r.max():.3g} long where the others are about {typical:.3g}, so "
        "beside it none of them moves: correct it, or leave it out"
    )
