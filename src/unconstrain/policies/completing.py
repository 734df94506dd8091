"""Which rounds a regressor goes through, from which start, and what is kept of them.

Fits are few, so all that costs none is done beside them: a linear policy with the same risk says where to start, and
noise and contact are found anew from every round's held-out predictions. With the adaptive risk two starts are
tried for a few rounds, ordinary regression and the linear policy, and the likelier goes on with more noise. Which is
likelier is judged by whole episodes held out. "All free" is kept unless another explains clearly more than residuals
with heavy tails would (`fitting.outliers`).
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.fitting.chain import Chain
from unconstrain.fitting.completion import ByBelief, ByRisk, Rounds, find_noise
from unconstrain.fitting.contact import Belief, Tally, judge
from unconstrain.fitting.drift import Drift
from unconstrain.fitting.gains import INDEPENDENT, clear_gain
from unconstrain.fitting.halves import Halves
from unconstrain.fitting.inference import (
    AGAIN,
    FREE,
    FROM_DIRECT,
    LEAST_NOISE,
    SPEED,
    SPEED_AT_FIRST,
    WARMTH,
)
from unconstrain.fitting.noise import Noise
from unconstrain.fitting.observation import observe, unknown
from unconstrain.fitting.outliers import find_heavy_tailed
from unconstrain.fitting.regression import Trend
from unconstrain.policies.inferred import finds_no_contact
from unconstrain.policies.parametric import ParametricPolicy
from unconstrain.samples import Samples

Floats = NDArray[np.float64]

FROM_LINEAR = "inferred, from the linear policy"

FIRST_ROUNDS = 4
"""Rounds from each start, after which the likelier goes on alone; fewer where fits are."""

FITS_A_ROUND, RUNS = 2, 4
"""The latter: all free, two starts, and one warmed again. Noise in the speed is tried where fits are left."""

FEWEST_EPISODES, BLOCKS = 4, 10
"""Of which halves are held out, and contiguous blocks that stand for episodes where there are fewer."""

FIXED_DECAY = 1e-4
"""λ of the linear policy where too few episodes move to choose it by."""

CLEAR, PLAIN = 0.07, 1.5
"""Gain in log-likelihood of an independent sample for which contact is taken to be there, and of any sample where the
linear policy finds contact too. For models that are linear in their parameters the former is less
(`gains.NOTICEABLE`): what regressors miss looks more like contact. Both were chosen on limit cycles, the arm,
reaches and handwriting, of which those that are free gained up to 0.05 and 1.1, those that are not 0.08 and 2.8."""


@dataclass(frozen=True)
class Completed:
    """Targets that a regressor is fitted to in the end, and what was found out.

    Parameters
    ----------
    targets : ndarray of shape (N, d)
        Complete actions.
    trend : Trend or None
        What the regressor learns the rest of.
    belief : Belief, optional
        With the adaptive risk.
    tally : Tally, optional
        What it finds in the samples.
    log_likelihoods : dict of str to float
        Held-out log-likelihood of a sample, the one chosen first.
    history : tuple of dict
        One for each round.
    """

    targets: Floats
    trend: Trend | None
    belief: Belief | None = None
    tally: Tally | None = None
    log_likelihoods: dict[str, float] = field(default_factory=dict)
    history: tuple[dict[str, Any], ...] = ()


@dataclass
class Completing:
    """Goes through the rounds.

    Parameters
    ----------
    samples : Samples
        Laid out, in units of the scale.
    halves : Halves
        What fits the regressor.
    has_trend : bool
        Whether the regressor learns what a linear policy leaves, or all.
    most_fits : int
        After which no round begins.
    noise : float
        Standard deviation that the noise is not below.
    report : callable
        Is told of each round: its name, the fits so far.
    """

    samples: Samples
    halves: Halves
    has_trend: bool
    most_fits: int
    noise: float
    report: Callable[[str, int], None]
    history: list[dict[str, Any]] = field(default_factory=list)

    def follow_risk(self) -> Completed:
        """Complete by the inconsistency, or by what is known of the projections.

        Returns
        -------
        Completed
            The targets of the round that leaves least of held-out samples.
        """
        samples, linear = self.samples, self.learn_linear("inconsistency")
        start = linear(samples.states)
        observation = observe("inconsistency", samples.actions, samples.projections)
        rule = ByRisk(observation, samples.weights)
        rounds = self._rounds("inconsistency", rule, linear, start)
        self._go_on(rounds)
        assert rounds.targets is not None
        return Completed(rounds.targets, rounds.trend, history=tuple(self.history))

    def infer(self, regression: Trend) -> Completed:
        """Complete by the adaptive risk.

        Parameters
        ----------
        regression : Trend
            Linear ordinary regression of the same samples.

        Returns
        -------
        Completed
            The targets of the likeliest round, or the actions where all samples are free.
        """
        linear, variance, is_found = self._learn_adaptive()
        free = self._assume_free(regression if self._nothing_is_known else linear)
        first = self._try_starts(free, linear, variance)
        for run in (free, *first):
            self._hold_out_episodes(run)
        again = self._warm(max(first, key=_apart))
        self._go_on(again)
        self._hold_out_episodes(again)
        runs = [*first, again, free]
        best = max(runs[:-1], key=_apart)
        if not self._is_sure(best, free, is_found):
            best = free
        elif (faster := self._vary_speed(best)) is not None:
            self._go_on(faster)
            self._hold_out_episodes(faster)
            runs.append(faster)
            best = max(best, faster, key=_apart)
        assert best.targets is not None
        assert best.predictions is not None
        belief = best.rule.settle(best.predictions)
        return Completed(
            best.targets,
            best.trend,
            belief,
            judge(best.predictions, belief, self.samples).tally,
            {run.name: run.apart for run in sorted(runs, key=lambda run: run is not best)},
            tuple(self.history),
        )

    def learn_linear(self, risk: str) -> Trend:
        """Learn the linear policy by a risk.

        Parameters
        ----------
        risk : str
            Of `ParametricPolicy`.

        Returns
        -------
        Trend
            Learnt from all samples.
        """
        return _as_trend(self._fit_linear(risk))

    @property
    def _nothing_is_known(self) -> bool:
        known = self.samples.projections
        return known is None or bool(unknown(known).all())

    @property
    def _first_rounds(self) -> int:
        return max(1, min(FIRST_ROUNDS, (self.most_fits // FITS_A_ROUND - RUNS) // RUNS))

    @property
    def _least(self) -> float:
        U = self.samples.actions
        scale = float(np.mean(np.einsum("nd,nd->n", U, U)))
        return max(LEAST_NOISE**2 * scale / U.shape[1], self.noise**2)

    def _fit_linear(self, risk: str) -> ParametricPolicy:
        X, U, groups, known, weights = self.samples
        several = groups is not None and bool(np.any(groups != groups[0]))
        given: dict[str, Any] = {
            "sample_weight": weights,
            "projections": None if risk == "direct" else known,
        }
        policy = ParametricPolicy(risk=risk, noise=self.noise or None)
        try:
            return policy.fit(X, U, groups=groups if several else None, **given)
        except DataError:
            return policy.set_params(alpha=FIXED_DECAY).fit(X, U, groups=groups, **given)

    def _learn_adaptive(self) -> tuple[Trend, float, bool]:
        """Return the linear policy behind these samples, the variance that it leaves, and whether it finds contact.

        Where it finds no contact it is ordinary regression, from which another start leads; what is taken instead is
        the inconsistency, with so much noise that all that it finds may be wrong.
        """
        policy = self._fit_linear("adaptive")
        if not finds_no_contact(policy):
            return _as_trend(policy), policy.noise_**2, True
        variance = 0.25 * float(np.mean(self.samples.actions**2))
        return self.learn_linear("inconsistency"), variance, False

    def _try_starts(self, free: Rounds, linear: Trend, variance: float) -> list[Rounds]:
        """Go a few rounds from ordinary regression and from the linear policy."""
        U = self.samples.actions
        assert free.predictions is not None
        drift = None if U.shape[1] == 1 else Drift()
        seeming = find_noise(U, free.predictions, self.samples.weights, self._least)
        left = Noise(max(variance, self._least))
        starts = [
            (FROM_LINEAR, left, linear, linear(self.samples.states)),
            (FROM_DIRECT, seeming, free.trend, free.predictions),
        ]
        runs = []
        for name, noise, trend, start in starts:
            rule = self._rule(Belief(None, noise, drift=drift, is_cooling=True))
            runs.append(self._rounds(name, rule, trend, start))
            self._go_on(runs[-1], self._first_rounds)
        return runs

    def _assume_free(self, trend: Trend) -> Rounds:
        """Take all samples for free whose projection is not known, and judge that by residuals with heavy tails."""
        U, weights = self.samples.actions, self.samples.weights
        start = trend(self.samples.states)
        noise = find_noise(U, start, weights, self._least)
        rule = self._rule(Belief(None, noise, chain=Chain.held("free"), held="free"))
        rounds = self._rounds(FREE, rule, trend, start)
        self._go_on(rounds, 1 if self._nothing_is_known else self._first_rounds)
        assert rounds.predictions is not None
        rounds.score = max(rounds.score, self._explain_freely(rounds, rounds.predictions))
        if self._nothing_is_known:
            rounds.targets = self.samples.actions  # to the last digit
        return rounds

    def _explain_freely(self, free: Rounds, P: Floats) -> float:
        """Return the log-likelihood of a sample whose residuals have heavy tails."""
        views = judge(P, free.rule.settle(P), self.samples).views
        squares = np.einsum("nd,nd->n", views.U - views.P, views.U - views.P)
        weights = self.samples.weights
        omega = np.ones(len(squares)) if weights is None else weights
        return find_heavy_tailed(squares, views.ranks, omega, self._least)

    def _hold_out_episodes(self, rounds: Rounds) -> None:
        """Judge the targets of rounds by episodes that regressors have not seen.

        A sample lies between two others of its episode, under the same constraint. So a flexible regressor predicts it
        from these, whatever was in the way.
        """
        assert rounds.targets is not None
        rest = self.halves.predict_across(rounds.targets - rounds.prior, self._first_episodes)
        P = rounds.prior + rest
        rounds.apart = rounds.rule.judge(P)
        rounds.apart_tally = judge(P, rounds.rule.settle(P), self.samples).tally
        if rounds.name == FREE:
            rounds.apart = max(rounds.apart, self._explain_freely(rounds, P))

    @cached_property
    def _first_episodes(self) -> NDArray[np.bool_]:
        """Which samples are of the one half of the episodes, or of contiguous blocks where these are too few."""
        N, groups = len(self.samples.actions), self.samples.groups
        part = np.zeros(N, dtype=int) if groups is None else np.unique(groups, return_inverse=True)[1]
        if part.max() + 1 < FEWEST_EPISODES:
            part = np.arange(N) * min(BLOCKS, N) // N
        n_parts = int(part.max()) + 1
        return (self.halves.random.permutation(n_parts) < (n_parts + 1) // 2)[part]

    def _warm(self, first: Rounds) -> Rounds:
        """Go on from the predictions of other rounds, with more noise.

        A free sample that is taken for constrained teaches nothing across its sphere, so that the policy stays wrong
        there, and the sample far from it. With more noise a policy that is nearly right takes it for free.
        """
        assert first.predictions is not None
        belief = first.rule.settle(first.predictions)
        noise = replace(belief.noise, action=WARMTH * belief.noise.action)
        warm = replace(belief, noise=noise, chain=Chain(), is_cooling=True)
        return self._rounds(AGAIN, self._rule(warm), first.trend, first.predictions)

    def _vary_speed(self, best: Rounds) -> Rounds | None:
        """Go on from the end of other rounds with noise in the speed, where that explains clearly more."""
        tally = self._tally(best)
        is_affordable = self.halves.n_fits + FITS_A_ROUND <= self.most_fits
        if self.samples.actions.shape[1] == 1 or tally.evidence <= INDEPENDENT or not is_affordable:
            return None
        assert best.predictions is not None
        belief = best.rule.settle(best.predictions)
        noise = replace(belief.noise, speed=SPEED_AT_FIRST)
        rule = replace(best.rule, belief=replace(belief, noise=noise), kinds=("action", "speed"))
        faster = replace(best, name=SPEED, rule=rule, since_best=0)
        faster.score = rule.judge(best.predictions)
        return faster if self._beats(faster, best) else None

    def _is_sure(self, one: Rounds, free: Rounds, linear_agrees: bool) -> bool:
        """Whether contact explains clearly more of held-out episodes, and samples or a linear policy agree.

        What trees and neighbours miss of an episode that they have not seen is large, and may look like contact alone;
        and what is missed resembles itself from sample to sample. A linear policy that finds contact has passed a test
        that holds for linear policies (`fitting.inference`).
        """
        assert one.apart_tally is not None
        gain, tally, d = one.apart - free.apart, one.apart_tally, self.samples.actions.shape[1]
        if linear_agrees and clear_gain(gain, tally, d, least=PLAIN, discounted=False) > 0:
            return True
        return clear_gain(gain, tally, d, least=CLEAR) > 0 and self._beats(one, free)

    def _beats(self, one: Rounds, other: Rounds) -> bool:
        """Whether one explains clearly more of held-out samples than another."""
        d = self.samples.actions.shape[1]
        return clear_gain(one.score - other.score, self._tally(one), d, least=CLEAR) > 0

    def _tally(self, rounds: Rounds) -> Tally:
        assert rounds.predictions is not None
        return judge(rounds.predictions, rounds.rule.settle(rounds.predictions), self.samples).tally

    def _rule(self, belief: Belief) -> ByBelief:
        return ByBelief(self.samples, belief, self._least)

    def _rounds(self, name: str, rule: Any, trend: Trend | None, start: Floats) -> Rounds:
        if trend is None or not self.has_trend:
            return Rounds(name, rule, None, np.zeros_like(self.samples.actions), start, self.halves.predict)
        return Rounds(name, rule, trend, trend(self.samples.states), start, self.halves.predict)

    def _fits_left_for(self, rounds: Rounds) -> int:
        """How many fits may have been made after another round: the last are for episodes that are held out."""
        still = {FREE: RUNS, FROM_LINEAR: RUNS, FROM_DIRECT: RUNS, AGAIN: 1, SPEED: 1}.get(rounds.name, 0)
        return self.most_fits - still * FITS_A_ROUND

    def _go_on(self, rounds: Rounds, most: int | None = None) -> None:
        """Go through rounds until they gain nothing, there were enough, or fits run out."""
        begun = rounds.n_rounds
        while not rounds.is_done and (most is None or rounds.n_rounds - begun < most):
            if rounds.targets is not None and self.halves.n_fits + FITS_A_ROUND > self._fits_left_for(rounds):
                return
            self.report(rounds.name, self.halves.n_fits)
            score = rounds.advance()
            self.history.append(
                {
                    "run": rounds.name,
                    "log_likelihood": score,
                    "accepted": score >= rounds.score,
                    "fits": self.halves.n_fits,
                }
            )


def _as_trend(policy: ParametricPolicy) -> Trend:
    return Trend(policy.model_, policy.solution_.w)


def _apart(rounds: Rounds) -> float:
    return rounds.apart
