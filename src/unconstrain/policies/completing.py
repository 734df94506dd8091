"""Which rounds a regressor goes through, from which start, and what is kept of them.

Fits are few, so all that costs none is done beside them: a linear policy with the same risk says where to start, and
noise and contact are found anew from every round's held-out predictions. With the adaptive risk two starts are
tried for a few rounds, ordinary regression and the linear policy, and the likelier goes on. "All free" is kept
unless another explains clearly more than residuals with heavy tails would (`fitting.outliers`).
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.fitting.chain import Chain
from unconstrain.fitting.completion import ByBelief, ByRisk, Rounds, find_noise
from unconstrain.fitting.contact import Belief, Tally, judge
from unconstrain.fitting.drift import Drift
from unconstrain.fitting.halves import Halves
from unconstrain.fitting.inference import (
    AGAIN,
    DECISIVE,
    FREE,
    FROM_DIRECT,
    INDEPENDENT,
    LEAST_NOISE,
    NOTICEABLE,
    SPEED,
    SPEED_AT_FIRST,
    WARMTH,
)
from unconstrain.fitting.noise import Noise
from unconstrain.fitting.observation import observe, unknown
from unconstrain.fitting.outliers import find_heavy_tailed
from unconstrain.fitting.plausible import is_plausible
from unconstrain.fitting.regression import Trend
from unconstrain.policies.inferred import finds_no_contact
from unconstrain.policies.parametric import ParametricPolicy
from unconstrain.samples import Samples

Floats = NDArray[np.float64]

FROM_LINEAR = "inferred, from the linear policy"

FIRST_ROUNDS = 4
"""Rounds from each start, after which the likelier goes on alone; fewer where fits are."""

WARM_ROUNDS = 8
"""Rounds that go on from the end of these with more noise."""

FITS_A_ROUND, STARTS = 2, 3


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
        linear, variance = self._learn_adaptive()
        free = self._assume_free(regression if self._nothing_is_known else linear)
        first = self._try_starts(free, linear, variance)
        again = self._warm(max(first, key=_score))
        self._go_on(again, WARM_ROUNDS)
        runs = [*first, again, free]
        best = max(runs[:-1], key=_score)
        self._go_on(best)
        if not self._beats(best, free):
            best = free
        elif (faster := self._vary_speed(best)) is not None:
            self._go_on(faster)
            runs.append(faster)
            best = faster
        assert best.targets is not None
        assert best.predictions is not None
        belief = best.rule.settle(best.predictions)
        return Completed(
            best.targets,
            best.trend,
            belief,
            judge(best.predictions, belief, self.samples).tally,
            {run.name: run.score for run in sorted(runs, key=lambda run: run is not best)},
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
        return max(1, min(FIRST_ROUNDS, self.most_fits // (STARTS * FITS_A_ROUND)))

    @property
    def _least(self) -> float:
        U = self.samples.actions
        scale = float(np.mean(np.einsum("nd,nd->n", U, U)))
        return max(LEAST_NOISE**2 * scale / U.shape[1], self.noise**2)

    def _fit_linear(self, risk: str) -> ParametricPolicy:
        X, U, groups, known, weights = self.samples
        several = groups is not None and bool(np.any(groups != groups[0]))
        return ParametricPolicy(risk=risk, noise=self.noise or None).fit(
            X,
            U,
            groups=groups if several else None,
            sample_weight=weights,
            projections=None if risk == "direct" else known,
        )

    def _learn_adaptive(self) -> tuple[Trend, float]:
        """Return the linear policy behind these samples, and the variance that it leaves.

        Where it finds no contact it is ordinary regression, from which another start leads; what is taken instead is
        the inconsistency, with so much noise that all that it finds may be wrong.
        """
        policy = self._fit_linear("adaptive")
        if not finds_no_contact(policy):
            return _as_trend(policy), policy.noise_**2
        return self.learn_linear("inconsistency"), 0.25 * float(np.mean(self.samples.actions**2))

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
        views = judge(rounds.predictions, rule.settle(rounds.predictions), self.samples).views
        squares = np.einsum("nd,nd->n", views.U - views.P, views.U - views.P)
        omega = np.ones(len(U)) if weights is None else weights
        rounds.score = max(rounds.score, find_heavy_tailed(squares, views.ranks, omega, self._least))
        return rounds

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
        if self.samples.actions.shape[1] == 1 or tally.evidence <= INDEPENDENT:
            return None
        assert best.predictions is not None
        belief = best.rule.settle(best.predictions)
        noise = replace(belief.noise, speed=SPEED_AT_FIRST)
        rule = replace(best.rule, belief=replace(belief, noise=noise), kinds=("action", "speed"))
        faster = replace(best, name=SPEED, rule=rule, since_best=0)
        faster.score = rule.judge(best.predictions)
        return faster if self._beats(faster, best) else None

    def _beats(self, one: Rounds, other: Rounds) -> bool:
        """Whether one explains clearly more than another, for as many samples as are independent."""
        tally = self._tally(one)
        gain = (one.score - other.score) * min(tally.evidence / INDEPENDENT, 1.0)
        size = np.sqrt(tally.meant / tally.shown) if tally.shown > 0 else 0.0
        plausible = is_plausible(float(size), self.samples.actions.shape[1])
        return plausible and gain > NOTICEABLE and gain * tally.n_samples > DECISIVE

    def _tally(self, rounds: Rounds) -> Tally:
        assert rounds.predictions is not None
        return judge(rounds.predictions, rounds.rule.settle(rounds.predictions), self.samples).tally

    def _rule(self, belief: Belief) -> ByBelief:
        return ByBelief(self.samples, belief, self._least)

    def _rounds(self, name: str, rule: Any, trend: Trend | None, start: Floats) -> Rounds:
        if trend is None or not self.has_trend:
            return Rounds(name, rule, None, np.zeros_like(self.samples.actions), start, self.halves.predict)
        return Rounds(name, rule, trend, trend(self.samples.states), start, self.halves.predict)

    def _go_on(self, rounds: Rounds, most: int | None = None) -> None:
        """Go through rounds until they gain nothing, there were enough, or fits run out."""
        begun = rounds.n_rounds
        while not rounds.is_done and (most is None or rounds.n_rounds - begun < most):
            if rounds.targets is not None and self.halves.n_fits + FITS_A_ROUND > self.most_fits:
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


def _score(rounds: Rounds) -> float:
    return rounds.score
