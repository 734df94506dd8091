"""From samples to networks: a survey, the runs of every member, a choice between them, and what is then believed."""

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np

from unconstrain.errors import DataError
from unconstrain.fitting.accumulator import Record, Solution
from unconstrain.fitting.chain import Chain
from unconstrain.fitting.contact import Belief, Tally, infer
from unconstrain.fitting.drift import Drift
from unconstrain.fitting.noise import Noise
from unconstrain.networks.checkpoint import Checkpoint
from unconstrain.networks.inferring import Candidate, Member, choose
from unconstrain.networks.learner import Learner, Options
from unconstrain.networks.linear import Linear, fit_linear
from unconstrain.networks.model import NetworkModel
from unconstrain.networks.shards import Shard, Shards
from unconstrain.networks.survey import Data, Survey
from unconstrain.progress import Report, begin, reporting
from unconstrain.samples import Samples

RUNS = 16
"""Seeds of a member, at most."""


@dataclass(frozen=True)
class Task:
    """What is to be fitted, besides data.

    Parameters
    ----------
    risk : {"adaptive", "inconsistency", "direct"}
        What a sample says of the policy.
    n_members : int
        Networks, each of which holds out another fold.
    options : Options
        How they descend.
    seed : int
        Of everything random.
    noise : float
        Variance of the actions' noise that is known beforehand; what is inferred is not below it.
    """

    risk: str
    n_members: int
    options: Options
    seed: int
    noise: float


def make_model(
    survey: Survey, d: int, hidden: tuple[int, ...], module: Any, standardized: bool
) -> NetworkModel:
    """Make the model of networks for what a survey has found.

    Parameters
    ----------
    survey : Survey
        Of the samples.
    d : int
        Dimension of the actions.
    hidden : tuple of int
        Units of the hidden layers.
    module : None, callable or torch.nn.Module
        As for `NetworkModel`.
    standardized : bool
        Whether the network takes standardised states, and says actions in units of their size.

    Returns
    -------
    NetworkModel
        Without parameters.
    """
    n = len(survey.center)
    center, spread = (survey.center, survey.spread) if standardized else (np.zeros(n), np.ones(n))
    unit = float(np.sqrt(survey.scale / d)) if standardized else 1.0
    return NetworkModel(n, d, center, spread, unit, hidden, module)


def fit_networks(
    network: NetworkModel,
    model: Any,
    data: Data,
    survey: Survey,
    task: Task,
    checkpoint: str | os.PathLike[str] | None = None,
    belongs_to: dict[str, str] | None = None,
    progress: bool | Report | None = None,
) -> Solution:
    """Fit networks.

    Parameters
    ----------
    network : NetworkModel
        Which.
    model : Model
        The same, or it in a space: as it is asked for actions at recorded states.
    data : Data
        To learn from.
    survey : Survey
        Of them.
    task : Task
        What and how.
    checkpoint : path, optional
        Where runs that have ended are kept, and read from if it is there.
    belongs_to : dict of str to str, optional
        What the checkpoint is of; one of something else is refused.
    progress : bool or function, optional
        As for `progress.reporting`; what is counted are epochs.

    Returns
    -------
    Solution
        With the parameters of all members.

    Raises
    ------
    DataError
        There are too few samples to hold some out.
    ArchiveError
        The checkpoint is damaged, or of something else.
    """
    present = data.present()
    if len(present) < 2:
        raise DataError("networks need at least two samples, to hold one out: give more")
    kept = Checkpoint.open(checkpoint, belongs_to or {}, task.n_members)
    linear = None
    if network.module is None:  # of which linear policies are a part
        linear = cache(partial(fit_linear, network, model, data, task.noise))
    epochs = 0
    with reporting(progress, "epochs") as report:

        def tick() -> None:
            nonlocal epochs
            epochs += 1
            report(epochs, None)

        members = []
        for number in range(task.n_members):
            of = f"network {number + 1} of {task.n_members}, " if task.n_members > 1 else ""
            fold = present[number % len(present)]
            member = _member(network, model, data, survey, task, number, fold, linear, tick)
            member.done, member.keep = kept.members[number], kept.write
            members.append(member.learn(lambda text, of=of: begin(report, of + text)))  # type: ignore[misc]
    return _conclude(model, data, survey, task, members)


def _member(
    network: NetworkModel,
    model: Any,
    data: Data,
    survey: Survey,
    task: Task,
    number: int,
    fold: int,
    linear: Callable[[], Linear] | None,
    tick: Callable[[], None],
) -> Member:
    def prepare(samples: Samples) -> Shard:
        Z = network.standardize(model.lay_out(samples.states))
        return Shard.of(samples, Z, network.unit, task.options.device)

    shards: list[Shards] = []

    def begin_run(run: int) -> Learner:
        if not shards:  # only where a run is left to do
            shards.append(Shards(lambda: data.without(fold), data.held_out(fold), prepare, data.in_memory))
        return Learner(network, shards[0], task.options, task.seed + RUNS * number + run, tick)

    return Member(model, begin_run, task.risk, survey.scale, task.noise, linear)


def _conclude(
    model: Any, data: Data, survey: Survey, task: Task, members: list[dict[str, Candidate]]
) -> Solution:
    def together(name: str) -> Any:
        return tuple(each[name].weights for each in members)

    counts = (survey.n_samples, survey.n_zero, survey.n_known)
    speed = float(np.sqrt(survey.scale))
    if task.risk != "adaptive":
        w = together(task.risk)
        return Solution(w, np.nan, None, None, *counts, regions=survey.regions, usual_speed=speed)
    name, likelihoods = choose(members, model.n_actions)
    w = together(name)
    beliefs = [each[name].belief for each in members]
    belief = replace(_average([each for each in beliefs if each is not None]), w=w)
    total: Tally | None = None
    for samples, _ in data.blocks():
        tally = infer(model, belief, samples).tally
        total = tally if total is None else total + tally
    assert total is not None
    held_out = [each[name].tally for each in members]
    repeated = np.mean([belief.noise.action * each.repeated for each in held_out if each is not None])
    history = tuple(entry for each in members for candidate in each.values() for entry in candidate.history)
    regression = Solution(together("regression"), np.nan, n_samples=survey.n_samples, usual_speed=speed)
    return Solution(
        w,
        np.nan,
        None,
        None,
        *counts,
        belief=belief,
        free_share=total.free_share,
        evidence=total.evidence,
        record=Record(likelihoods, history, float(repeated), regression),
        regions=survey.regions,
        usual_speed=speed,
    )


def _average(beliefs: list[Belief]) -> Belief:
    """Believe what members do on average."""

    def mean(kind: type, of: list[Any]) -> Any:
        return kind(*(float(np.mean([getattr(each, name) for each in of])) for name in vars(of[0])))

    drifts = [each.drift for each in beliefs if each.drift is not None]
    return replace(
        beliefs[0],
        noise=mean(Noise, [each.noise for each in beliefs]),
        chain=mean(Chain, [each.chain for each in beliefs]),
        drift=mean(Drift, drifts) if drifts else None,
        is_cooling=False,
        residual=None,
    )
