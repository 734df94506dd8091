"""From samples to the posterior of a Gaussian process.

The published risks are observed once: the likeliest kernel is found, and conditioned on all rows. Which samples were
free is inferred on few inducing rows first, whose features are a model like any other (`fitting.inference`): it starts
from both ends and lowers the noise. From where "all free" and the likeliest of its other runs end, and of few samples
from the process of the inconsistency, each further pass

1. infers which samples were free by the process as it is, and what they say of the policy (`fitting.contact`),
2. finds kernel and noise anew, in the first of these passes and in the third,
3. conditions the process on all rows, and estimates the noise from what is left over, `σ² = Σ e² / (n - used)`,

until the policy stays. So every maximisation is a regression by Gaussian processes. What is kept is decided by the
likelihood of folds that are left out of each (`held_out`), "all free" unless another is clearly likelier.
"""

import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from typing import Any

import numpy as np

from unconstrain.fitting.accumulator import Accumulator
from unconstrain.fitting.chain import Chain
from unconstrain.fitting.contact import Belief, Tally, episode_starts, infer
from unconstrain.fitting.drift import Drift
from unconstrain.fitting.gains import clear_gain
from unconstrain.fitting.inference import (
    FREE,
    INFERRED,
    LARGEST_SPEED,
    LEAST_NOISE,
    Inference,
    pass_through,
)
from unconstrain.fitting.model import Model
from unconstrain.fitting.noise import Noise
from unconstrain.fitting.observation import Expanded, Observation, observe
from unconstrain.fitting.solve import EpisodeFolds
from unconstrain.gaussian_process.conditioning import Conditioned, condition_on_all, place_features
from unconstrain.gaussian_process.evidence import Evidence, choose, learn_kernel
from unconstrain.gaussian_process.inducing import InducingFeatures
from unconstrain.gaussian_process.parts import is_separable
from unconstrain.gaussian_process.process import Process
from unconstrain.samples import Samples
from unconstrain.waiting import each

INFERRING, INFERRING_SLOWLY = 420, 210
"""Inducing rows that contact is inferred with at first, where actions share a basis and where they do not."""

MOST_PASSES, LEARNING = 8, (0, 2)
"""Passes of the process at most, and those in which the kernel is found anew. Where all is free the first is enough."""

SETTLED = 1e-3
"""Root mean square change of the policy, as a share of it, that is not worth another pass."""

LEAST_LEFT = 0.2
"""Share of the observed numbers that is taken to be left for the noise, at least."""

FROM_PROCESS = "inferred, from the inconsistency's process"
FEW = 1000
"""Samples up to which passes begin with the process of the inconsistency as well: where movements are few it may be
right where nothing that inducing features can say is."""

ENOUGH = 1e-2
"""Difference in log-likelihood per sample by which two runs have ended apart."""


@dataclass(frozen=True)
class Problem:
    """What is learnt from: samples in units of the scale, their states as a space lays them out.

    Parameters
    ----------
    samples : Samples
        Checked, and none of weight zero.
    kernels : mapping of str to Kernel
        Candidates, by name.
    noise : float
        Variance of the actions' noise that is known beforehand.
    """

    samples: Samples
    kernels: Mapping[str, Any]
    noise: float

    @cached_property
    def size(self) -> float:
        """Root mean square length of the actions; 1 where nothing moves."""
        U, weights = self.samples.actions, self.samples.weights
        square = float(np.average(np.einsum("nd,nd->n", U, U), weights=weights))
        return float(np.sqrt(square)) if square > 0 else 1.0

    @cached_property
    def fold(self) -> np.ndarray:
        """The fold of each sample, (N,)."""
        return EpisodeFolds().assign(self.samples.groups, len(self.samples.states))

    @cached_property
    def follows(self) -> np.ndarray:
        """Whether each sample follows the one before it in its episode, (N,)."""
        return ~episode_starts(self.samples)

    @property
    def floor(self) -> float:
        """Least variance of the noise."""
        share = (LEAST_NOISE * self.size) ** 2 / self.samples.actions.shape[1]
        return max(share, self.noise)

    def find_evidence(self, observation: Observation) -> Evidence:
        """Find the likeliest kernel.

        Parameters
        ----------
        observation : Observation
            Of all samples.

        Returns
        -------
        Evidence
            Of the one chosen.
        """
        X, weights, size = self.samples.states, self.samples.weights, self.size
        return choose(
            [
                learn_kernel(name, kernel, X, observation, weights, size, self.noise)
                for name, kernel in self.kernels.items()
            ]
        )

    def condition(self, evidence: Evidence, observation: Observation, noise: float) -> Conditioned:
        """Condition the process on all samples.

        Parameters
        ----------
        evidence : Evidence
            Whose kernel it has.
        observation : Observation
            Of all samples.
        noise : float
            Variance of the noise, in squared units of the action.

        Returns
        -------
        Conditioned
            Exact where the rows are few enough.
        """
        X, weights = self.samples.states, self.samples.weights
        return condition_on_all(evidence, X, observation, weights, noise, self.fold, self.follows)


@dataclass(frozen=True)
class Learnt:
    """What was learnt.

    Parameters
    ----------
    process : Process
        The posterior, as wide as what was held out says.
    evidence : Evidence
        Its kernel.
    belief : Belief, optional
        What was inferred of contact and noise.
    tally : Tally, optional
        What that belief finds in the samples.
    log_likelihoods : dict of str to float, optional
        Held-out log-likelihood of a sample, by what was assumed, the chosen first.
    history : tuple of dict
        One for each pass.
    regression : Process, optional
        Ordinary regression, where inference began with it.
    """

    process: Process
    evidence: Evidence
    belief: Belief | None = None
    tally: Tally | None = None
    log_likelihoods: dict[str, float] | None = None
    history: tuple[dict[str, Any], ...] = ()
    regression: Process | None = None


@dataclass(frozen=True)
class End:
    """Where passes of the process have ended.

    Parameters
    ----------
    name : str
        From where they began.
    conditioned : Conditioned
        The process.
    evidence : Evidence
        Its kernel.
    belief : Belief
        Of the process.
    tally : Tally
        What it finds.
    history : list of dict
        One for each pass.
    """

    name: str
    conditioned: Conditioned
    evidence: Evidence
    belief: Belief
    tally: Tally
    history: list[dict[str, Any]]


def learn_published(problem: Problem, risk: str) -> Learnt:
    """Learn by a risk that observes every sample alike.

    Parameters
    ----------
    problem : Problem
        What is learnt from.
    risk : {"inconsistency", "direct"}
        Which.

    Returns
    -------
    Learnt
        Without a belief.
    """
    conditioned, evidence = _condition_published(problem, risk)
    return Learnt(conditioned.hold_out().widen(conditioned.process), evidence)


def learn_adaptively(
    problem: Problem, model: Any, make_inference: Callable[[InducingFeatures], tuple[Model, Accumulator]]
) -> Learnt:
    """Learn, and infer which samples were free.

    Parameters
    ----------
    problem : Problem
        What is learnt from.
    model : GaussianProcessModel
        Whose parameters are the process.
    make_inference : callable
        Makes an empty accumulator of a model with the features of inducing rows.

    Returns
    -------
    Learnt
        With the belief.
    """
    samples, d = problem.samples, problem.samples.actions.shape[1]
    along = observe("inconsistency", samples.actions, samples.projections)
    # Sums of a basis that actions share are much faster, and good enough to begin with.
    shared = {name: kernel for name, kernel in problem.kernels.items() if is_separable(kernel)}
    evidence = replace(problem, kernels=shared or problem.kernels).find_evidence(along)
    features = place_features(evidence, samples.states, d, INFERRING if shared else INFERRING_SLOWLY)
    inducing, blank = make_inference(features)
    inference = Inference(blank)
    pass_through(inference, lambda wanted: wanted.add(samples))
    runs = {run.name: run for run in inference.runs}
    wanted_runs = {FREE, next(iter(inference.likelihoods))}
    found = max((runs[name] for name in INFERRED if name in runs), key=lambda run: run.log_likelihood)
    apart = min(abs(found.log_likelihood - runs[name].log_likelihood) for name in wanted_runs)
    if apart > ENOUGH * len(samples.states):
        wanted_runs.add(found.name)
    starts: list[tuple[str, Belief, Any]] = [
        (name, run.end, inducing) for name, run in runs.items() if name in wanted_runs
    ]
    if len(samples.states) <= FEW:
        conditioned, evidence = _condition_published(problem, "inconsistency")
        noise = Noise(max(evidence.noise * evidence.size**2, problem.floor))
        drift = Drift() if d > 1 else None
        starts.append((FROM_PROCESS, Belief(conditioned.process, noise, Chain(), drift), model))
    ends = {
        name: _pass_on(problem, model, name, start, first)
        for name, start, first in each(starts, "learning kernels", unit="explanations")
    }
    return _compare(problem, model, ends)


def _condition_published(problem: Problem, risk: str) -> tuple[Conditioned, Evidence]:
    observation = observe(risk, problem.samples.actions, problem.samples.projections)
    evidence = problem.find_evidence(observation)
    noise = max(evidence.noise * evidence.size**2, problem.floor)
    return problem.condition(evidence, observation, noise), evidence


def _kinds(belief: Belief) -> tuple[str, ...]:
    return ("action", "speed") if belief.noise.speed > 0 else ("action",)


def _pass_on(problem: Problem, model: Any, name: str, belief: Belief, first: Any) -> End:
    """Make passes from a belief, whose parameters are those of the model `first`."""
    samples, kinds = problem.samples, _kinds(belief)
    found = infer(first, belief, samples)
    before, history = found.views.P, []
    for number in each(range(MOST_PASSES), name, unit="passes at most"):
        observation: Expanded = found.expand()
        noise = belief.noise.action
        if number in LEARNING:
            evidence = problem.find_evidence(observation)
            noise = max(evidence.noise * evidence.size**2, problem.floor)
        conditioned = problem.condition(evidence, observation, noise)
        process = conditioned.process
        belief = replace(belief, w=process, is_cooling=False, residual=None)
        found = infer(model, belief, samples)
        tally, after = found.tally, found.views.P
        left = max(1 - process.used / max(tally.squares.count, 1.0), LEAST_LEFT)
        variances = tally.squares.estimate(kinds, 1 / left)
        belief = replace(
            belief,
            noise=Noise(max(variances.action, problem.floor), min(variances.speed, LARGEST_SPEED)),
            chain=belief.chain if belief.held else tally.counts.chain(),
            drift=None if belief.drift is None else tally.drifts.estimate(),
        )
        found = infer(model, belief, samples)
        tally = found.tally
        history.append(
            {
                "run": name,
                "log_likelihood": tally.mean,
                "noise": float(np.sqrt(belief.noise.action)),
                "speed_noise": float(np.sqrt(belief.noise.speed)),
                "free_share": tally.free_share,
                "evidence": tally.evidence,
                "kernel": str(evidence.kernel),
            }
        )
        change = np.sum((after - before) ** 2)
        before = after
        is_settled = change <= SETTLED**2 * np.sum(after**2) and number >= LEARNING[-1]
        if is_settled or belief.held == "free":
            break
    return End(name, conditioned, evidence, belief, found.tally, history)


def _compare(problem: Problem, model: Any, ends: dict[str, End]) -> Learnt:
    """Choose by held-out likelihood."""
    held = {name: end.conditioned.hold_out() for name, end in ends.items()}
    likelihoods = {
        name: _held_out_likelihood(problem, model, end, held[name].processes) for name, end in ends.items()
    }
    best = ends[FREE]
    for end in ends.values():
        gain = likelihoods[end.name] - likelihoods[best.name]
        if clear_gain(gain, end.tally, problem.samples.actions.shape[1]) > 0:
            best = end
    likelihoods = dict(sorted(likelihoods.items(), key=lambda item: item[0] != best.name))
    process = held[best.name].widen(best.conditioned.process)
    history = tuple(each for end in ends.values() for each in end.history)
    belief = replace(best.belief, w=process.without_variances())
    regression = ends[FREE].conditioned.process.without_variances()
    return Learnt(process, best.evidence, belief, best.tally, likelihoods, history, regression)


def _held_out_likelihood(problem: Problem, model: Any, end: End, processes: Mapping[int, Process]) -> float:
    """Compute the log-likelihood of a sample that was held out, under the noise of what was held out."""
    belief = end.belief
    if not processes:
        return end.tally.log_likelihood / end.tally.n_samples
    parts = {k: problem.samples.select(problem.fold == k) for k in processes}

    def add_up(noise: Noise) -> Tally:
        tallies = [
            infer(model, replace(belief, w=processes[k], noise=noise), part).tally
            for k, part in parts.items()
        ]
        return reduce(operator.add, tallies)

    found = add_up(belief.noise).squares.estimate(_kinds(belief))
    total = add_up(replace(found, action=max(found.action, problem.floor)))
    return total.mean
