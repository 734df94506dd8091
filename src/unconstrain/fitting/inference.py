"""The passes over the data by which contact is inferred: whoever reads the data asks what to add up next.

    inference = Inference(accumulator)
    while (wanted := inference.next_pass()) is not None:
        ...                                  # add all samples to `wanted`
        inference.take(wanted)
    inference.result                         # an accumulator as of any other risk

A fit in memory, a stream and a cluster drive the same object. Expectation maximisation starts from ordinary
regression, which is right where all is free, and from the inconsistency, which is right where nothing is; noise is
lowered from what it seems to be at the start, so that no sample is judged by a policy that is not yet good. Where the
two runs end apart, the likelier end is the start of a third, with the noise raised once more. Where residuals are
independent, another run goes on from the better end with noise in the speed as well. What is kept is the simplest of
"all free" and these whose held-out likelihood none of the others clearly beats: parameters are solved without each
fold, and noise is estimated on what was held out. "All constrained" is fitted too, but only told: it explains anything,
and where it is right inference finds it.

Given the policy of most of the samples, a single run goes on from that, and has to beat "all free" and to explain what
is held out as well as before; else all is inferred anew (`fitting.at_hand`).
"""

import itertools
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from unconstrain.fitting.accumulator import Accumulator, Record, Solution
from unconstrain.fitting.at_hand import AtHand, describe_beginning
from unconstrain.fitting.chain import Chain
from unconstrain.fitting.contact import Belief, Tally
from unconstrain.fitting.drift import Drift
from unconstrain.fitting.gains import INDEPENDENT, NOTICEABLE, clear_gain
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.noise import Noise
from unconstrain.fitting.plausible import check_scale
from unconstrain.fitting.solve import EpisodeFolds
from unconstrain.fitting.wide.decay import WideDecay
from unconstrain.fitting.wide.held import HeldSamples
from unconstrain.waiting import stage

COOLING = 0.8
"""By what the noise's deviation is lowered from one pass to the next, at most."""

MOST_PASSES, SETTLING = 60, 4
"""Passes of a run at most, and those after the noise is found until which λ is still adjusted."""

PASSES_PER_CHOICE = 5
"""After so many passes λ is chosen anew, and once more before it is fixed."""

LARGEST_STEP = 10.0
"""By what λ may change at a choice after the first: it is judged by samples as the present λ has them, and one that is
far too large, once chosen, would take for constrained whatever contradicts it."""

HALVINGS = 5
ENOUGH = 1e-3
"""Gain in log-likelihood, per sample, that is not worth another pass."""

LEAST_NOISE, LEAST_NOISE_BESIDE_SPEED = 1e-7, 1e-3
"""Deviation of the noise, as a share of the root mean square action; where speeds vary as well, a smaller one would let
any single sample say how fast it was."""

SPEED_AT_FIRST, LARGEST_SPEED = 0.1**2, 1.0
FREE, CONSTRAINED, FROM_DIRECT, FROM_INCONSISTENCY, AGAIN, SPEED, AT_HAND = (
    "all free",
    "all constrained",
    "inferred, from regression",
    "inferred, from inconsistency",
    "inferred, warmed again",
    "inferred, with noise in speed",
    "inferred, from the policy at hand",
)
INFERRED = (FROM_DIRECT, FROM_INCONSISTENCY, AGAIN, AT_HAND)

FIRST = {"regression": "whole", "ordinary regression": "direct", "inconsistency": "inconsistency"}
"""Risks of the first passes. Ordinary regression is what the policy is held against later; the first pass is it already
where no projection is known."""

WARMTH = 10.0**2
"""By what the variance found is multiplied for the run that starts where the likelier of two ended. In many dimensions
a free sample shows directions that no other does, is far from a policy that has not learnt them, and so is taken for
constrained for ever; with more noise a policy that is nearly right takes it for free."""

USUAL_RUN = 15
"""Passes that a run from nothing takes in the usual case, for those who wait."""

SHORT_RUN, SHORTEST_RUN = 8, 2
"""Passes of the runs that start where another ended, and of that which only has to learn how large residuals are."""


@dataclass
class Run:
    """One course of expectation maximisation.

    Parameters
    ----------
    name : str
        What it assumes, or where it starts.
    kinds : tuple of str
        Which kinds of noise there are.
    belief : Belief
        That the next pass is made with.
    most : int
        Passes at most.
    cooling : bool
        Whether the noise is still being lowered.
    keeps_alpha : bool
        Whether λ stays what it is, that of the run from whose end this one goes on.
    """

    name: str
    kinds: tuple[str, ...]
    belief: Belief
    most: int = MOST_PASSES
    cooling: bool = True
    keeps_alpha: bool = False
    passes: int = 0
    since_cool: int = 0
    halvings: int = 0
    is_done: bool = False
    alpha: float | None = None
    share_left: float = 1.0
    log_likelihood: float = -np.inf
    accepted: Accumulator | None = None

    @property
    def end(self) -> Belief:
        """The belief of the last pass that was accepted."""
        assert self.accepted is not None
        assert self.accepted.belief is not None
        return self.accepted.belief

    @property
    def tally(self) -> Tally:
        """What that pass has found."""
        assert self.accepted is not None
        return self.accepted.total.tallies[0]

    @property
    def accepted_samples(self) -> int:
        """How many samples that pass was over."""
        assert self.accepted is not None
        return self.accepted.total.n_samples

    @property
    def chooses_alpha(self) -> bool:
        """Whether λ is chosen with the next pass."""
        due = self.passes % PASSES_PER_CHOICE == 0 or self.since_cool == SETTLING - 1
        return due and not (self.keeps_alpha or self.is_climbing)

    @property
    def is_climbing(self) -> bool:
        """Whether likelihoods of passes can be compared, since λ and how noise is lowered stay as they are."""
        return not self.cooling and self.since_cool >= SETTLING

    def take(self, done: Accumulator, floor: float) -> None:
        """Take what a pass has added up, and decide on the next.

        Parameters
        ----------
        done : Accumulator
            Of the belief.
        floor : float
            Least variance of the noise.
        """
        (tally,) = done.total.tallies
        self.passes += 1
        gain = tally.log_likelihood - self.log_likelihood
        if self.is_climbing and self.accepted is not None and self.since_cool > SETTLING:
            if gain < 0:
                self._halve()
                return
            self.is_done = gain < ENOUGH * tally.n_samples
        self.accepted, self.log_likelihood, self.halvings = done, tally.log_likelihood, 0
        if self.passes >= self.most:
            self.is_done = True
        if not self.is_done:
            self._step(done, floor)

    def _halve(self) -> None:
        """Go back half of the way to the belief before, or to the end."""
        self.halvings += 1
        if self.halvings > HALVINGS or self.passes >= self.most:
            self.is_done = True
            return
        self.belief = _between(self.end, self.belief)

    def _step(self, done: Accumulator, floor: float) -> None:
        belief, (tally,) = self.belief, done.total.tallies
        if done.is_judged or self.alpha is None:
            chosen = done.solve(near=self.alpha).alpha
            if self.alpha is not None:
                chosen = float(np.clip(chosen, self.alpha / LARGEST_STEP, self.alpha * LARGEST_STEP))
            self.alpha = chosen
            self.share_left = _share_left(done, self.alpha, tally.squares.count)
            w = done.solve(self.alpha).w
        else:
            w = done.solve(self.alpha).w
        shrunk = 1.0 if belief.w is None else _shrinkage(done, belief.w, w)
        noise = tally.squares.estimate(self.kinds, shrunk / self.share_left)
        least = max(floor, belief.noise.action * COOLING**2 if self.cooling else 0.0)
        if noise.action >= least or not self.cooling:
            self.cooling = False
            self.since_cool += 1
        residual = replace(noise, action=max(noise.action, floor), speed=min(noise.speed, LARGEST_SPEED))
        noise = replace(residual, action=max(noise.action, least))
        self.belief = replace(
            belief,
            w=w,
            noise=noise,
            chain=belief.chain if belief.held else tally.counts.chain(),
            drift=None if belief.drift is None else tally.drifts.estimate(),
            is_cooling=self.cooling,
            residual=residual if self.cooling else None,
        )


@dataclass
class Inference:
    """What has been found so far, and what is to be added up next.

    Parameters
    ----------
    blank : Accumulator
        Empty, with everything placed.
    at_hand : AtHand, optional
        The policy to go on from. It is forgotten where it turns out that contact has to be inferred anew.
    """

    blank: Accumulator
    at_hand: AtHand | None = None
    beginning: str = ""
    stage: str = "regression"
    runs: list[Run] = field(default_factory=list)
    compared: list[Run] = field(default_factory=list)
    noises: list[Noise] = field(default_factory=list)
    likelihoods: dict[str, float] = field(default_factory=dict)
    repeated: dict[str, float] = field(default_factory=dict)
    starts: dict[str, Belief] = field(default_factory=dict)
    history: list[dict[str, Any]] = field(default_factory=list)
    scale: float = 1.0
    regression: Solution | None = None
    result: Accumulator | None = None

    def next_pass(self) -> Accumulator | None:
        """Say what to add up next.

        Returns
        -------
        Accumulator or None
            Empty; None once there is a result.
        """
        if self.result is not None:
            return None
        if self.stage in FIRST:
            return self._blank(FIRST[self.stage])
        if self.stage == "run":
            run = self.runs[-1]
            wanted = self._blank("adaptive", run.belief)
            if run.name == AT_HAND and not run.passes:
                assert self.at_hand is not None
                wanted.predict = self.at_hand.start(self.blank.model.scale)[1]
            wanted.is_judged = self.blank.alpha == "cv" and run.chooses_alpha
            return wanted
        if self.stage == "final":
            return self._blank("adaptive", self.compared[0].end)
        wanted = self._blank("adaptive", self.runs[0].belief)
        wanted.compared = tuple(
            _held_out_beliefs(run, noise) for run, noise in zip(self.compared, self.noises, strict=True)
        )
        return wanted

    def take(self, done: Accumulator) -> None:
        """Take what `next_pass` asked for, with all samples added.

        Parameters
        ----------
        done : Accumulator
            As `next_pass` returned it, but filled.
        """
        # What counts as motion beside the longest action of all is known from the first pass on.
        self.blank.longest = max(self.blank.longest, done.total.longest)
        if self.stage == "regression":
            alpha = self._start(done, FREE)
            self._begin_from(alpha, done.total.n_samples)
            self.stage = self._after_regression if self.regression is not None else "ordinary regression"
        elif self.stage == "ordinary regression":
            self._keep_regression(done.solve())
            self.stage = self._after_regression
        elif self.stage == "inconsistency":
            self._start(done, CONSTRAINED)
            self._run(FREE, self.starts[FREE], held="free", most=SHORTEST_RUN, cooling=False)
            self.stage = "run"
        elif self.stage == "run":
            self._advance(done)
        elif self.stage in ("noise", "likelihood"):
            self._compare(done)
        else:
            repeated = self.repeated[self.compared[0].name]
            n_anew = done.total.n_samples if self.at_hand is None else self.at_hand.n_anew
            done.record = Record(
                self.likelihoods, tuple(self.history), repeated, self.regression, n_anew, self.beginning
            )
            self.result = done
            return
        if done.folds is not None:
            # The next pass deals all episodes out anew, and of millions the labels take memory.
            done.folds = EpisodeFolds(done.folds.n_folds)

    def copy(self) -> "Inference":
        """Copy what `take` changes; sums are shared, which never change.

        Returns
        -------
        Inference
            At the same place.
        """
        return replace(
            self,
            runs=[copy(run) for run in self.runs],
            compared=[copy(run) for run in self.compared],
            noises=list(self.noises),
            likelihoods=dict(self.likelihoods),
            repeated=dict(self.repeated),
            starts=dict(self.starts),
            history=list(self.history),
        )

    @property
    def description(self) -> str:
        """What the next pass is for, in a few words."""
        if self.stage == "run":
            return f"{self.runs[-1].name}, pass {self.runs[-1].passes + 1}"
        if self.stage in FIRST:
            return self.stage
        return "last pass" if self.stage == "final" else "held-out likelihood"

    @property
    def n_expected(self) -> int:
        """How many passes are probably still to be made, for those who wait."""
        if self.result is not None:
            return 0
        alone = {FREE: SHORTEST_RUN} | ({} if self.at_hand is None else {FREE: 1, AT_HAND: SHORT_RUN})
        if self.at_hand is None:
            alone |= {FROM_DIRECT: USUAL_RUN, FROM_INCONSISTENCY: USUAL_RUN, CONSTRAINED: SHORT_RUN}
        made = {run.name: run.passes for run in self.runs}
        runs = 0 if self.stage == "final" else sum(max(n - made.get(name, 0), 0) for name, n in alone.items())
        running = bool(self.runs) and self.stage == "run" and not self.runs[-1].is_done
        comparing = 0 if self.stage == "final" else 2
        return max(runs, int(running)) + comparing + 1

    @property
    def _floor(self) -> float:
        beside_speed = self.stage == "run" and "speed" in self.runs[-1].kinds
        share = LEAST_NOISE_BESIDE_SPEED if beside_speed else LEAST_NOISE
        return max(share**2 * self.scale / self.blank.model.n_actions, self.blank.noise)

    def _blank(self, risk: str, belief: Belief | None = None) -> Accumulator:
        wanted = self.blank.empty()
        wanted.risk, wanted.belief, wanted.scale = risk, belief, self.scale
        wanted.finds_region = self.stage == "final" and wanted.finds_region  # it is the same in every pass
        return wanted

    @property
    def _after_regression(self) -> str:
        return "inconsistency" if self.at_hand is None else "run"

    def _begin_from(self, alpha: float, n_samples: int) -> None:
        """Go on from the policy at hand, if there is one, and nothing speaks against it."""
        if self.at_hand is None:
            return
        self.beginning = describe_beginning("")
        why_not = self.at_hand.why_not(n_samples)
        if why_not:
            self._begin_anew(why_not)
            return
        # The λ of regression is that of "all free", and large residuals are estimated once more on what is held out.
        free = {"held": "free", "alpha": alpha, "keeps_alpha": True}
        self._run(FREE, self.starts[FREE], most=1, cooling=False, **free)

    def _begin_anew(self, why: str) -> None:
        self.at_hand, self.beginning, self.stage = None, describe_beginning(why), "inconsistency"
        self.runs.clear()
        self.compared.clear()
        self.likelihoods.clear()
        self.repeated.clear()

    def _start(self, done: Accumulator, name: str) -> float:
        """Keep where runs start, and return its λ."""
        solution = done.solve()
        total, d = done.observed(), self.blank.model.n_actions
        if name == FREE:
            whole = total if total.everywhere is None else total.everywhere
            self.scale = float(np.sum(whole.squares) / np.sum(whole.weight))
            check_scale(self.scale, "adaptive")
            variance = _residual(done, solution.w) / d
            if (
                not solution.n_known
            ):  # where projections are known, this is regression of what they let through
                self._keep_regression(solution)
        else:
            variance = 0.25 * self.scale / d
        self.starts[name] = Belief(solution.w, Noise(max(variance, self._floor)))
        return solution.alpha

    def _keep_regression(self, solution: Solution) -> None:
        self.regression = Solution(solution.w, solution.alpha, n_samples=solution.n_samples)

    def _run(self, name: str, start: Belief, **options: Any) -> None:
        held = options.pop("held", None)
        drift = None if held == "free" or self.blank.model.n_actions == 1 else Drift()
        kinds = options.pop("kinds", ("action",))
        chain = Chain.held(held) if held else start.chain
        cooling = options.get("cooling", True)
        belief = replace(start, held=held, drift=start.drift or drift, chain=chain, is_cooling=cooling)
        self.runs.append(Run(name, kinds, belief, **options))

    def _advance(self, done: Accumulator) -> None:
        run = self.runs[-1]
        run.take(done, self._floor)
        (tally,) = done.total.tallies
        assert done.belief is not None
        self.history.append(
            {
                "run": run.name,
                "log_likelihood": tally.mean,
                "comparable": run.is_climbing and run.since_cool > SETTLING,
                "accepted": run.accepted is done,
                "noise": float(np.sqrt(done.belief.noise.action)),
                "speed_noise": float(np.sqrt(done.belief.noise.speed)),
                "free_share": tally.free_share,
                "evidence": tally.evidence,
                "alpha": run.alpha,
            }
        )
        if run.is_done:
            self._next_run()

    def _next_run(self) -> None:
        """Start the next run, or compare those there are."""
        names, best = [run.name for run in self.runs], self._likeliest()
        if self.at_hand is not None:
            self._next_from(self.at_hand, names, best)
            return
        if FROM_DIRECT not in names:
            self._run(FROM_DIRECT, self.starts[FREE])
        elif FROM_INCONSISTENCY not in names:
            self._run(FROM_INCONSISTENCY, self.starts[CONSTRAINED])
        elif AGAIN not in names and not self._agree():
            end = max(self.runs[1:], key=lambda run: run.log_likelihood).end
            warmer = replace(end.noise, action=WARMTH * end.noise.action)
            self._run(AGAIN, replace(end, noise=warmer, chain=Chain(), residual=end.noise))
        elif not self.likelihoods:
            self._begin_comparison(self.runs)
        elif self._may_have_speed(names, best):
            self._add_speed(best, SPEED_AT_FIRST)
        elif CONSTRAINED not in names:
            self._go_on(CONSTRAINED, best.end, best.alpha, held="constrained")
        else:
            self._begin_comparison([run for run in self.runs if run.name not in self.likelihoods])

    def _next_from(self, at_hand: AtHand, names: list[str], best: Run) -> None:
        """Do the same where there is a policy to go on from."""
        if AT_HAND not in names:
            # λ is chosen with the first pass and then stays, and passes can be compared from the second on.
            alpha = at_hand.alpha if self.blank.alpha == "cv" else None
            start = at_hand.start(self.blank.model.scale)[0]
            quiet = replace(start, noise=replace(start.noise, speed=0.0))
            self._run(AT_HAND, quiet, cooling=False, since_cool=SETTLING - 1, alpha=alpha)
        elif not self.likelihoods:
            self._begin_comparison(self.runs)
        elif self._may_have_speed(names, best):
            self._add_speed(best, at_hand.belief.noise.speed or SPEED_AT_FIRST)
        elif SPEED in names and SPEED not in self.likelihoods:
            self._begin_comparison(self.runs[-1:])
        else:
            likelihood, n_samples = self.likelihoods[best.name], best.accepted_samples
            why = at_hand.why_given_up(likelihood, n_samples, is_all_free=best.name == FREE)
            if why:
                self._begin_anew(why)
            else:
                self._finish(best)

    def _finish(self, best: Run) -> None:
        """Make the last pass, by the likeliest run."""
        self.likelihoods = dict(sorted(self.likelihoods.items(), key=lambda item: item[0] != best.name))
        self.compared = [best]
        self.stage = "final"

    def _may_have_speed(self, names: list[str], best: Run) -> bool:
        """Whether noise in the speed is still to be tried."""
        return SPEED not in names and self.blank.model.n_actions > 1 and best.tally.evidence > INDEPENDENT

    def _add_speed(self, best: Run, variance: float) -> None:
        start = replace(best.end, noise=replace(best.end.noise, speed=variance))
        self._go_on(SPEED, start, best.alpha, kinds=("action", "speed"))

    def _agree(self) -> bool:
        """Whether both starts led to the same place."""
        one, other = self.runs[1:3]
        return abs(one.log_likelihood - other.log_likelihood) <= NOTICEABLE * one.tally.n_samples

    def _go_on(self, name: str, start: Belief, alpha: float | None, **options: Any) -> None:
        """Start a short run where another ended."""
        self._run(name, start, most=SHORT_RUN, cooling=False, alpha=alpha, keeps_alpha=True, **options)
        self.stage = "run"

    def _likeliest(self) -> Run:
        """Choose the run that beats "all free" most clearly, "all free" itself if none does.

        Of two that do, the likelier is taken if that is clear as well. One that makes the policy implausibly large does
        not count, and one with more kinds of noise has to beat those with fewer as clearly. What a gain counts hangs on
        the evidence of the run that gains, not of the one it is compared with: residuals of a wrong explanation are
        correlated because it is wrong.
        """
        runs = {run.name: run for run in self.runs if run.name in self.likelihoods}
        best = self.runs[0]
        found = [runs[name] for name in INFERRED if name in runs]
        clear = [run for run in found if self._gain(run, best) > 0]
        if clear:
            best = max(clear, key=lambda run: self._gain(run, best))
            for other in clear:
                best = other if self._gain(other, best) > 0 else best
        return runs[SPEED] if SPEED in runs and self._gain(runs[SPEED], best) > 0 else best

    def _gain(self, run: Run, other: Run) -> float:
        """Compute by how much a run explains more than another, per sample; 0 where that is not clear."""
        gain = self.likelihoods[run.name] - self.likelihoods[other.name]
        if run.name == SPEED:  # what was held out may lie far off, and then a wider noise explains it
            gain = min(gain, (run.log_likelihood - other.log_likelihood) / run.tally.n_samples)
        return clear_gain(gain, run.tally, self.blank.model.n_actions)

    def _begin_comparison(self, runs: list[Run]) -> None:
        self.compared = list(runs)
        self.noises = [run.end.noise for run in runs]
        self.stage = "noise"

    def _compare(self, done: Accumulator) -> None:
        results = list(zip(self.compared, done.total.tallies, strict=True))
        if self.stage == "noise":
            found = [tally.squares.estimate(run.kinds) for run, tally in results]
            self.noises = [replace(noise, action=max(noise.action, self._floor)) for noise in found]
            self.stage = "likelihood"
            return
        self.likelihoods |= {run.name: tally.mean for run, tally in results}
        self.repeated |= {
            run.name: noise.action * tally.repeated
            for (run, tally), noise in zip(results, self.noises, strict=True)
        }
        if CONSTRAINED not in self.likelihoods:
            self._next_run()
            return
        self._finish(self._likeliest())


def infer_contact(
    blank: Accumulator, add: Callable[[Accumulator], None], at_hand: AtHand | None = None
) -> Accumulator:
    """Make all passes.

    Parameters
    ----------
    blank : Accumulator
        Empty, with everything placed.
    add : callable
        Adds all samples to an accumulator.
    at_hand : AtHand, optional
        The policy to go on from.

    Returns
    -------
    Accumulator
        With the sums of the last pass.
    """
    inference = Inference(blank, at_hand)
    pass_through(inference, add)
    assert inference.result is not None
    return inference.result


def pass_through(inference: Inference, add: Callable[[Accumulator], None]) -> None:
    """Make all passes of an inference.

    Parameters
    ----------
    inference : Inference
        That has not begun.
    add : callable
        Adds all samples to an accumulator.
    """
    with stage("inferring contact", unit="passes") as report:
        for number in itertools.count(1):
            wanted = inference.next_pass()
            if wanted is None:
                break
            report.begin(f"inferring contact: {inference.description}")
            add(wanted)
            inference.take(wanted)
            report(number, number + inference.n_expected)


def _held_out_beliefs(run: Run, noise: Noise) -> tuple[Belief, ...]:
    """Return a belief for each fold, with parameters that are solved without it."""
    accepted = run.accepted
    assert accepted is not None
    plain = replace(run.end, noise=noise)
    present = [k for k, part in enumerate(accepted.total.moments) if part is not None]
    if accepted.folds is None or len(present) < 2:
        return (plain,)
    alpha = run.alpha if run.alpha is not None else accepted.solve().alpha
    return tuple(
        replace(plain, w=accepted.solve(alpha, without=k).w) if k in present else plain
        for k in range(accepted.folds.n_folds)
    )


def _between(a: Belief, b: Belief) -> Belief:
    """Return the belief halfway from a to b."""

    def middle(x: Any, y: Any) -> Any:
        return type(x)(*((getattr(x, name) + getattr(y, name)) / 2 for name in vars(x)))

    drift = None if a.drift is None or b.drift is None else middle(a.drift, b.drift)
    return replace(
        b,
        w=(a.w + b.w) / 2,
        noise=middle(a.noise, b.noise),
        chain=middle(a.chain, b.chain),
        drift=drift,
    )


def _errors(moments: Moments | HeldSamples, w: np.ndarray) -> float:
    return float(np.sum(moments.risk(w[..., :, None, :])))


def _solved(done: Accumulator, w: np.ndarray) -> tuple[Moments | HeldSamples, np.ndarray]:
    """Return the moments without those of all samples, and parameters in the form in which moments take them."""
    total = done.observed()
    if isinstance(total, Moments):
        total = replace(total, everywhere=None)
    return total, done.model.solution(w, total.n_targets)


def _residual(done: Accumulator, w: np.ndarray) -> float:
    """Compute the mean squared error of the parameters."""
    total, solved = _solved(done, w)
    return _errors(total, solved) / max(float(np.sum(total.weight)), np.finfo(np.float64).tiny)


def _shrinkage(done: Accumulator, before: np.ndarray, after: np.ndarray) -> float:
    """By what the squared errors change from one solution to the next."""
    total, old = _solved(done, before)
    _, new = _solved(done, after)
    error = _errors(total, old)
    return float(np.clip(_errors(total, new) / error, 0.05, 1.0)) if error > 0 else 1.0


def _share_left(done: Accumulator, alpha: float, count: float) -> float:
    """Share of the residuals' freedom that is left once the parameters are fitted."""
    total = done.observed()
    if isinstance(total, HeldSamples):
        used = WideDecay([total]).used(alpha)
    elif total.H.ndim > 2:  # neighbouring local models share their samples
        return 1.0
    else:
        used = done.model.decay(total).used(total, alpha)
    return max(1.0 - used / max(count, 1.0), 0.2)
