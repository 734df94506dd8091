"""Which samples were free, inferred while a network learns from them.

    regression, inconsistency           two networks, each until held-out samples say stop
    from either:
        pass:   infer γ, chain and drift from the samples by the network as it is       (`fitting.contact`)
        descend a few epochs on  -γ log p(u | free) - (1 - γ) log p(ρ | constrained)    (`torch.adaptive`)
        noise:  from the residuals of held-out samples, lowered slowly
    the linear policy, which far less data determine, learnt from all samples     (`linear`)
    from where the likeliest of these ended, the noise raised once more: the same again, for longer
    keep:   the simplest of "all free" and the ends whose held-out likelihood none clearly beats

As for models that are linear in their parameters (`fitting.inference`), the noise is lowered from what it seems to be
at the start, so that no sample is judged by a network that is not yet good. Unlike there it is estimated from samples
that are held out: a network may know its own by heart. The noise of speed is not inferred, and "all constrained" is
not fitted.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from unconstrain.fitting.chain import Chain
from unconstrain.fitting.contact import Belief, Found, Tally, infer
from unconstrain.fitting.drift import Drift
from unconstrain.fitting.gains import NOTICEABLE, clear_gain
from unconstrain.fitting.inference import (
    AGAIN,
    COOLING,
    FREE,
    FROM_DIRECT,
    FROM_INCONSISTENCY,
    LEAST_NOISE,
    WARMTH,
)
from unconstrain.fitting.noise import Noise
from unconstrain.networks.learner import (
    Learner,
    Stopping,
    Weights,
    direct_loss,
    published_loss,
    whole_loss,
)
from unconstrain.networks.linear import Linear
from unconstrain.networks.perceptron import set_linear
from unconstrain.networks.shards import Shard
from unconstrain.torch import adaptive_loss

EPOCHS = 2
"""Over a shard in memory, between two passes of inference; one where shards are read from files."""

MOST_COOLING = 60
"""Passes during which noise is lowered, at most."""

LINEAR = "inferred, linear"
NAMES = (FREE, LINEAR, FROM_DIRECT, FROM_INCONSISTENCY, AGAIN)
"""Runs whose likelihoods are compared."""

RESTART = 0.3
"""Share of the learning rate with which a run goes on from where another ended."""

ROUNDS = 4
"""By which the noise of samples that are all free is found."""


@dataclass(frozen=True)
class Candidate:
    """Where a run ended.

    Parameters
    ----------
    name : str
        What it assumed, or where it started.
    weights : dict of str to ndarray
        Of the network.
    belief : Belief or None
        Of contact and noise; its parameters are the weights.
    tally : Tally or None
        What it says of the samples that are held out.
    history : tuple of dict
        Of its passes.
    """

    name: str
    weights: Weights
    belief: Belief | None = None
    tally: Tally | None = None
    history: tuple[dict[str, Any], ...] = ()


@dataclass
class Member:
    """The runs of one network, each begun only if it is not there yet.

    Parameters
    ----------
    model : Model
        As inference asks it: over states as they are recorded, in units of the scale.
    begin : callable
        Returns a learner; it is given the number of the run, which seeds it.
    risk : str
        Of the policy.
    scale : float
        Mean squared length of the actions.
    least : float
        Variance of the noise that is known beforehand.
    linear : callable, optional
        Fits the linear policy, where the network has a linear term.
    keep : callable, optional
        Called whenever a run has ended.
    done : dict of str to Candidate
        Runs that have ended.
    """

    model: Any
    begin: Callable[[int], Learner]
    risk: str
    scale: float
    least: float
    linear: Callable[[], Linear] | None = None
    keep: Callable[[], None] | None = None
    done: dict[str, Candidate] = field(default_factory=dict)

    def learn(self, tell: Callable[[str], None]) -> dict[str, Candidate]:
        """Make all runs.

        Parameters
        ----------
        tell : callable
            Is told what begins.

        Returns
        -------
        dict of str to Candidate
            The runs by name. What is learnt with other risks than the adaptive one has the risk's name.
        """
        if self.risk != "adaptive":
            loss = direct_loss if self.risk == "direct" else published_loss
            self._run(self.risk, 0, tell, lambda learner: Candidate(self.risk, learner.fit(loss)))
            return self.done
        self._run("regression", 0, tell, lambda learner: Candidate("regression", learner.fit(direct_loss)))
        self._run(FREE, 1, tell, self._fit_free)
        self._run(
            "inconsistency", 2, tell, lambda learner: Candidate("inconsistency", learner.fit(published_loss))
        )
        d = self.model.n_actions
        whole, quarter = self.done[FREE].belief, 0.25 * self.scale / d
        assert whole is not None
        starts = [
            (3, FROM_DIRECT, self.done[FREE].weights, whole.noise.action),
            (4, FROM_INCONSISTENCY, self.done["inconsistency"].weights, quarter),
        ]
        for number, name, weights, variance in starts:
            start = believe(weights, max(variance, self._floor), drift=Drift() if d > 1 else None)
            self._run(name, number, tell, partial(self._infer, name=name, belief=start))
        ends = [self.done[FROM_DIRECT], self.done[FROM_INCONSISTENCY]]
        if self.linear is not None:
            self._run(LINEAR, 6, tell, self._take_linear)
            linear = self.done[LINEAR]
            assert linear.belief is not None
            if not linear.belief.held:
                ends.append(linear)
            elif _likelihood(linear) > _likelihood(self.done[FREE]):
                self.done[FREE] = replace(linear, name=FREE)
        end = max(ends, key=_likelihood).belief
        assert end is not None
        warmer = Noise(min(WARMTH * end.noise.action, quarter))
        start = replace(end, noise=warmer, chain=Chain())
        self._run(AGAIN, 5, tell, partial(self._infer, name=AGAIN, belief=start, is_last=True))
        return self.done

    @property
    def _floor(self) -> float:
        return max(LEAST_NOISE**2 * self.scale / self.model.n_actions, self.least)

    def _run(
        self, name: str, number: int, tell: Callable[[str], None], run: Callable[[Learner], Candidate]
    ) -> None:
        if name not in self.done:
            tell(name)
            self.done[name] = run(self.begin(number))
            if self.keep is not None:
                self.keep()

    def _fit_free(self, learner: Learner) -> Candidate:
        """Learn from all samples as free ones, and find the noise that held-out ones then have."""
        knows = any(shard.N is not None for shard in learner.shards)
        weights = learner.fit(whole_loss) if knows else self.done["regression"].weights
        chain = Chain.held("free")
        belief = believe(weights, self.scale / self.model.n_actions, chain=chain, held="free")
        for _ in range(ROUNDS):
            tally = self._ask(learner.shards.held_out, belief).tally
            belief = replace(
                belief, noise=Noise(max(tally.squares.estimate(("action",)).action, self._floor))
            )
        return Candidate(FREE, weights, belief, self._ask(learner.shards.held_out, belief).tally)

    def _take_linear(self, learner: Learner) -> Candidate:
        """Make the network the linear policy, of which it is known how likely samples are that are held out."""
        assert self.linear is not None
        linear = self.linear()
        weights = set_linear(learner.weights, linear.slopes, linear.intercept)
        noise = Noise(linear.belief.noise.action)
        belief = replace(linear.belief, w=wrap(weights), noise=noise, is_cooling=False, residual=None)
        tally = self._ask(learner.shards.held_out, belief).tally
        tally = replace(tally, log_likelihood=linear.log_likelihood * tally.n_samples)
        return Candidate(LINEAR, weights, belief, tally)

    def _infer(
        self,
        learner: Learner,
        name: str,
        belief: Belief,
        is_last: bool = False,
    ) -> Candidate:
        """Alternate inference and descent: first while noise is lowered, then until held-out samples say stop.

        Of runs that are not the last one it is only to be seen where they lead.
        """
        learner.load(belief.w[0])
        learner.restart(RESTART * learner.options.learning_rate)
        history: list[dict[str, Any]] = []
        for _ in range(MOST_COOLING):
            belief, found = self._pass(learner, belief, cooling=True)
            history.append(_describe(name, belief, found))
            if not belief.is_cooling:
                break
        patience = learner.options.patience
        stop = Stopping(learner, patience) if is_last else Stopping(learner, max(1, patience // EPOCHS), 1)
        for _ in range(learner.options.max_epochs // EPOCHS):
            belief, _ = self._pass(learner, belief, cooling=False)
            tally = self._ask(learner.shards.held_out, belief).tally
            history.append(_describe(name, belief, tally))
            stop.look(-tally.mean, (belief, tally))
            if stop.is_done:
                break
        best, tally = stop.kept
        return Candidate(name, stop.best, best, tally, tuple(history))

    def _pass(self, learner: Learner, belief: Belief, *, cooling: bool) -> tuple[Belief, Tally]:
        """Infer from every shard, and descend on what was inferred; the noise is that of held-out samples."""
        residual = belief.residual or belief.noise
        total: Tally | None = None
        for shard in learner.shards:
            found = self._ask(shard, belief)
            total = found.tally if total is None else total + found.tally
            loss_of = _expected_loss(found, shard, np.sqrt(residual.action) / learner.model.unit)
            for _ in range(EPOCHS if learner.shards.in_memory else 1):
                learner.epoch(shard, loss_of)
        learner.tick()
        assert total is not None
        belief = replace(
            belief,
            w=wrap(learner.weights),
            chain=total.counts.chain(),
            drift=None if belief.drift is None else total.drifts.estimate(),
        )
        squares = self._ask(learner.shards.held_out, belief).tally.squares
        found_noise = max(squares.estimate(("action",)).action, self._floor)
        least = COOLING**2 * belief.noise.action if cooling else 0.0
        going_on = cooling and found_noise < least
        return replace(
            belief,
            noise=Noise(max(found_noise, least)),
            residual=Noise(found_noise) if going_on else None,
            is_cooling=going_on,
        ), total

    def _ask(self, shard: Shard, belief: Belief) -> Found:
        return infer(self.model, belief, shard.samples)


def wrap(weights: Weights) -> Any:
    """Make what a model takes as parameters of the weights of one network."""
    return (weights,)


def believe(weights: Weights, variance: float, **options: Any) -> Belief:
    """Make a belief of the weights of one network.

    Parameters
    ----------
    weights : dict of str to ndarray
        By name.
    variance : float
        Of the noise.
    **options
        As for `Belief`.

    Returns
    -------
    Belief
        To infer by.
    """
    return Belief(wrap(weights), Noise(variance), **options)


def choose(members: Sequence[dict[str, Candidate]], n_actions: int) -> tuple[str, dict[str, float]]:
    """Choose between "all free" and the ends of the other runs, by what held-out samples say of all members.

    Parameters
    ----------
    members : sequence of dict of str to Candidate
        The runs of each member.
    n_actions : int
        d.

    Returns
    -------
    name : str
        The likeliest run that beats "all free" clearly, or that.
    log_likelihoods : dict of str to float
        Of a held-out sample by run, the one chosen first.
    """
    names = [name for name in NAMES if all(_is_compared(each.get(name)) for each in members)]
    tallies = {name: _total([each[name].tally for each in members]) for name in names}
    likelihoods = {name: tally.mean for name, tally in tallies.items()}

    def gain(name: str, other: str) -> float:
        return clear_gain(likelihoods[name] - likelihoods[other], tallies[name], n_actions)

    best = max(names, key=lambda name: gain(name, FREE))
    best = best if gain(best, FREE) > 0 else FREE
    for name in names:
        best = name if gain(name, FREE) > 0 and gain(name, best) > 0 else best
    # Whether there is contact was decided for the linear policy by itself; what is left is which predicts better.
    if LINEAR in names and likelihoods[LINEAR] - likelihoods[best] > NOTICEABLE:
        best = LINEAR
    return best, dict(sorted(likelihoods.items(), key=lambda item: item[0] != best))


def _expected_loss(found: Found, shard: Shard, noise: float) -> Callable[[Any, Shard, Any], Any]:
    """Make the expected negative log-likelihood, times the noise's variance: in squared units, whatever the noise."""
    free = shard.U.new_tensor(found.free)

    def loss_of(P: Any, shard: Shard, rows: Any) -> Any:
        N = None if shard.N is None else shard.N[rows]
        weights = None if shard.weights is None else shard.weights[rows]
        return noise**2 * adaptive_loss(P, shard.U[rows], noise, N, free[rows], weights=weights)

    return loss_of


def _describe(name: str, belief: Belief, tally: Tally) -> dict[str, Any]:
    return {
        "run": name,
        "log_likelihood": tally.mean,
        "comparable": not belief.is_cooling,
        "accepted": True,
        "noise": float(np.sqrt(belief.noise.action)),
        "speed_noise": 0.0,
        "free_share": tally.free_share,
        "evidence": tally.evidence,
    }


def _is_compared(candidate: Candidate | None) -> bool:
    """Whether a run has a likelihood of its own: a linear policy that found all samples free counts as "all free"."""
    if candidate is None or candidate.belief is None:
        return False
    return candidate.name != LINEAR or not candidate.belief.held


def _likelihood(candidate: Candidate) -> float:
    assert candidate.tally is not None
    return candidate.tally.log_likelihood / candidate.tally.n_samples


def _total(tallies: Sequence[Tally | None]) -> Tally:
    present = [tally for tally in tallies if tally is not None]
    total = present[0]
    for tally in present[1:]:
        total = total + tally
    return total
