"""Any regression technique: what a sample does not show is completed by what the regressor itself says of it.

A sample shows `Q π(x)`, and a regressor wants all of π(x). With the prediction p of a regressor so far, the target

    y = p + Q(u - p)

is consistent with the sample, and the regressor is fitted to the targets again. That is majorise-minimise, since
`Σ ‖y - p'‖² >= Σ ‖Q(u - p')‖²` with equality at p' = p: a regressor that makes the left side small makes the risk
on the right small. With the adaptive risk `Q(u - p)` is the gradient of the expected log-likelihood in units of a
free sample's information (`contact`), which is no larger than one.

Predictions are held out (`halves`), and the step from one round to the next is prolonged (Nesterov, Beck, Teboulle).
What each round is judged by is what its held-out predictions explain; the best round's targets are kept.

References
----------
Beck, Teboulle, A fast iterative shrinkage-thresholding algorithm, SIAM Journal on Imaging Sciences 2, 2009.
O'Donoghue, Candès, Adaptive restart for accelerated gradient schemes, Foundations of Computational Mathematics 15,
2015.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from unconstrain.fitting.contact import Belief, Found, Tally, judge
from unconstrain.fitting.noise import Noise
from unconstrain.fitting.observation import Observation, squared_errors
from unconstrain.fitting.regression import Trend
from unconstrain.samples import Samples

Floats = NDArray[np.float64]

COOLING = 0.7
"""By what the noise's deviation is lowered from one round to the next, at most."""

LEAST_INFORMATION = 0.5
"""Of a sample, in units of a free one's, by which its step is divided. Short actions tell little: followed by their
gradient alone they would take many rounds, and with what a regressor misses, which is no noise, they are worth
more than their noise says."""

SETTLING = 5
"""Passes in which noise and contact are adjusted to the same predictions, before these are judged."""

PATIENCE = 3
"""Rounds without a gain after which no more is expected."""

ENOUGH = 1e-2
"""Gain in log-likelihood of a sample that is worth another round; beside the inconsistency the same share of that."""


class Rule(Protocol):
    """What a sample says, given what is predicted."""

    def complete(self, P: Floats) -> Floats:
        """Return targets (N, d) that are consistent with the samples, and otherwise as predicted, P (N, d)."""
        ...

    def judge(self, P: Floats) -> float:
        """Say how much held-out predictions P (N, d) explain: more is better."""
        ...


@dataclass
class ByRisk:
    """A sample shows what is observed of it, whatever is predicted: the inconsistency, and ordinary regression.

    Parameters
    ----------
    observation : Observation
        Of N samples, with targets.
    weights : ndarray of shape (N,), optional
        Of the samples.
    """

    observation: Observation
    weights: Floats | None = None

    def complete(self, P: Floats) -> Floats:
        """Complete by `y = p + Qᵀ(Q u - Q p)`; see `Rule`."""
        rows, targets = self.observation.rows, self.observation.targets
        assert targets is not None
        missed = targets - np.einsum("nkd,nd->nk", rows, P)
        return P + np.einsum("nkd,nk->nd", rows, missed)

    def judge(self, P: Floats) -> float:
        """Return the logarithm of the mean squared error, with the sign turned; see `Rule`."""
        mean = float(np.average(squared_errors(self.observation, P), weights=self.weights))
        return -float(np.log(max(mean, np.finfo(np.float64).tiny)))


@dataclass
class ByBelief:
    """What a sample shows is inferred from the predictions, and noise is lowered meanwhile.

    Parameters
    ----------
    samples : Samples
        In the order of time within each episode.
    belief : Belief
        So far, without parameters.
    least : float
        Variance that the noise is not below.
    kinds : tuple of str
        Which kinds of noise there are.
    """

    samples: Samples
    belief: Belief
    least: float
    kinds: tuple[str, ...] = ("action",)

    def complete(self, P: Floats) -> Floats:
        """Complete by the gradient of the expected log-likelihood, and go on to the next belief; see `Rule`.

        It is divided by the information, but not by less than `LEAST_INFORMATION`.
        """
        found = judge(P, self.belief, self.samples)
        self.belief = self._next(found, self.belief)
        told = found.expand()
        information = told.blunt + told.towards * np.einsum("nd,nd->n", told.normal, told.normal)
        return P + found.gradient / np.clip(information, LEAST_INFORMATION, 1.0)[:, None]

    def judge(self, P: Floats) -> float:
        """Return the log-likelihood of a sample under the noise and contact that fit P; see `Rule`."""
        return judge(P, self.settle(P), self.samples).tally.mean

    def settle(self, P: Floats) -> Belief:
        """Find the noise and contact that held-out predictions suggest, however far the noise has been lowered.

        Parameters
        ----------
        P : ndarray of shape (N, d)
            Held-out predictions.

        Returns
        -------
        Belief
            Which is not cooling.
        """
        belief = replace(self.belief, is_cooling=False, residual=None)
        for _ in range(SETTLING):
            belief = self._next(judge(P, belief, self.samples), belief)
        return belief

    def _next(self, found: Found, belief: Belief) -> Belief:
        tally = found.tally
        estimated = tally.squares.estimate(self.kinds)
        floor = belief.noise.action * COOLING**2 if belief.is_cooling else 0.0
        residual = replace(estimated, action=max(estimated.action, self.least))
        is_cooling = belief.is_cooling and residual.action < floor
        return replace(
            belief,
            noise=replace(residual, action=max(residual.action, floor)),
            chain=belief.chain if belief.held else tally.counts.chain(),
            drift=None if belief.drift is None else tally.drifts.estimate(),
            is_cooling=is_cooling,
            residual=residual if is_cooling else None,
        )


@dataclass
class Rounds:
    """A course of rounds.

    Parameters
    ----------
    name : str
        Where it starts.
    rule : Rule
        By which targets are completed.
    trend : Trend or None
        What the regressor learns the rest of; None stands for zero.
    prior : ndarray of shape (N, d)
        The actions that it says.
    ahead : ndarray of shape (N, d)
        Predictions that the first round begins with.
    predict : callable
        From targets (N, d) to held-out predictions of these.
    score : float
        What the best round so far explains of held-out samples.
    apart : float
        What its targets explain where whole episodes are held out, if that was looked at.
    apart_tally : Tally, optional
        What was found then.
    targets, predictions : ndarray of shape (N, d), optional
        Of the best round.
    """

    name: str
    rule: Any
    trend: Trend | None
    prior: Floats
    ahead: Floats
    predict: Callable[[Floats], Floats]
    score: float = -np.inf
    apart: float = -np.inf
    apart_tally: Tally | None = None
    targets: Floats | None = None
    predictions: Floats | None = None
    n_rounds: int = 0
    since_best: int = 0
    _momentum: float = 1.0
    _before: Floats | None = None

    @property
    def is_done(self) -> bool:
        """Whether the last rounds gained nothing."""
        return self.since_best >= PATIENCE

    def advance(self) -> float:
        """Complete the targets, fit, and judge.

        Returns
        -------
        float
            What the round's predictions explain.
        """
        targets = self.rule.complete(self.ahead)
        P = self.prior + self.predict(targets - self.prior)
        score = self.rule.judge(P)
        self.n_rounds += 1
        is_worse = score < self.score - ENOUGH
        self.since_best = 0 if score > self.score + ENOUGH else self.since_best + 1
        if score > self.score:
            self.score, self.targets, self.predictions = score, targets, P
        if self._before is None or is_worse:
            self.ahead, self._momentum = P, 1.0
        else:
            following = (1 + np.sqrt(1 + 4 * self._momentum**2)) / 2
            share = (self._momentum - 1) / following
            self.ahead, self._momentum = P + share * (P - self._before), following
        self._before = P
        return score


def find_noise(U: Floats, P: Floats, weights: Floats | None, least: float) -> Noise:
    """Return the noise that residuals would be.

    Parameters
    ----------
    U, P : ndarray of shape (N, d)
        Actions and predictions.
    weights : ndarray of shape (N,), optional
        Of the samples.
    least : float
        Variance that it is not below.

    Returns
    -------
    Noise
        Of the actions.
    """
    mean = float(np.average(np.mean((U - P) ** 2, axis=1), weights=weights))
    return Noise(max(mean, least))
