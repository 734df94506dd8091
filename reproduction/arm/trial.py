"""One data set of the arm (section 4.2): the recordings, the policies learnt from them, and their errors.

The paper learns from "a training subset" of 100 x 100 samples and tests on "a subset held out". Held-out samples of
the same trajectories give its figures, to their spread over data sets; whole trajectories held out give larger errors
and twice the spread. So `Recordings.test` holds samples, λ is chosen on episodes held out, and the stricter
test, on trajectories from new starts, is reported beside it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sklearn.preprocessing import SplineTransformer

from reproduction.adaptive_column import ADAPTIVE
from reproduction.plants import arm
from reproduction.scores import ncpe, nupe, nupe_and_ncpe
from unconstrain.demonstrations import Demonstrations
from unconstrain.features import DecoupledFeatures, NormalizedRBF, PotentialFeatures
from unconstrain.policies import LocallyLinearPolicy, ParametricPolicy
from unconstrain.policies.base import Policy
from unconstrain.robots import TaskConstraint
from unconstrain.selection import select_policy

POWERS = (1.5, 1.8, 2.0)
CONSTRAINTS = ("1-2-3", "4-5-6", "1-3-5", "2-4-6")

EPISODES, LENGTH = 100, 100
TRAINING_SHARE = 0.7
NEW_EPISODES, COMPLEMENTARY_EPISODES = 25, 50
"""Trajectories from new starts under the same constraint, and from known ones under the complementary one."""

WIDTH, COVERAGE = 3**0.5, 0.7
"""σ of the receptive fields, and the weight that every training sample has in some local model."""

SETTINGS = {
    "episodes": EPISODES,
    "length": LENGTH,
    "training share": TRAINING_SHARE,
    "new episodes": NEW_EPISODES,
    "complementary episodes": COMPLEMENTARY_EPISODES,
    "width": WIDTH,
    "coverage": COVERAGE,
}
"""What the results depend on besides the seed."""


@dataclass(frozen=True)
class Recordings:
    """A data set of one policy under one constraint, and what it is tested on.

    Attributes
    ----------
    training, test : Demonstrations
        Samples of the same trajectories.
    new : Demonstrations
        Trajectories from other starts under the same constraint.
    complementary : Demonstrations
        Trajectories from the starts of the data set under the complementary constraint.
    """

    training: Demonstrations
    test: Demonstrations
    new: Demonstrations
    complementary: Demonstrations

    @classmethod
    def simulate(cls, p: float, constraint: str, seed: int, episodes: int = EPISODES) -> "Recordings":
        """Simulate the data set of this number; starts and split are the same for all policies and constraints."""
        blocked, policy = TaskConstraint.parse(constraint), arm.PowerPolicy(p)
        new, other = (max(1, episodes * n // EPISODES) for n in (NEW_EPISODES, COMPLEMENTARY_EPISODES))
        everything = arm.demonstrate(blocked, policy, episodes + new, LENGTH, random_state=seed)
        complementary = arm.demonstrate(blocked.complement(), policy, other, LENGTH, random_state=seed)
        order = np.random.default_rng([seed, 1]).permutation(episodes * LENGTH)
        split = round(TRAINING_SHARE * len(order))
        return cls(
            training=everything.select(np.sort(order[:split])),
            test=everything.select(np.sort(order[split:])),
            new=everything.select(everything.episodes >= episodes),
            complementary=complementary,
        )


def measure_errors(policy: Policy, recordings: Recordings) -> dict[str, float]:
    """Measure nUPE and nCPE on held-out samples, nCPE under the complementary constraint, nUPE on new trajectories."""
    complementary, new = recordings.complementary, recordings.new
    return {
        **nupe_and_ncpe(recordings.test, policy.predict(recordings.test.states)),
        "complementary nCPE": ncpe(complementary, policy.predict(complementary.states)),
        "new nUPE": nupe(new, policy.predict(new.states)),
    }


def make_local_models(risk: str = "inconsistency") -> LocallyLinearPolicy:
    """Make the paper's model: σ² = 3, every training sample with weight of at least 0.7 in some model, λ chosen."""
    return LocallyLinearPolicy(width=WIDTH, centers="coverage", coverage=COVERAGE, risk=risk, alpha="cv")


def run_published(p: float, constraint: str, seed: int, episodes: int = EPISODES) -> dict[str, Any]:
    """Learn one data set as in Table I: by inconsistency, by direct regression, and by an oracle shown the policy."""
    recordings = Recordings.simulate(p, constraint, seed, episodes)
    training = recordings.training
    # λ is chosen on episodes held out whole. Held-out samples of episodes that were learnt from do not show how wrong
    # local models are along what their own samples hardly show, and all but switch the decay off.
    result: dict[str, Any] = {}
    for name, kind, actions in (
        ("inconsistency", "inconsistency", training.actions),
        ("direct", "direct", training.actions),
        ("oracle", "direct", training.policy),
    ):
        policy = _at_least_risk(
            make_local_models(kind).fit(training.states, actions, groups=training.episodes)
        )
        result |= {f"{name} {error}": value for error, value in measure_errors(policy, recordings).items()}
        if name == "inconsistency":
            result |= {"local models": len(policy.centers_), "alpha": policy.alpha_}
    return result


def run_adaptive(p: float, constraint: str, seed: int, episodes: int = EPISODES) -> dict[str, float]:
    """Learn the same data set by risk "adaptive", λ by the library's own rule; errors, and the share found free."""
    recordings = Recordings.simulate(p, constraint, seed, episodes)
    training = recordings.training
    policy = make_local_models(ADAPTIVE).fit(training.states, training.actions, groups=training.episodes)
    errors = measure_errors(policy, recordings)
    return {f"{ADAPTIVE} {error}": value for error, value in errors.items()} | {"free": policy.free_share_}


def _at_least_risk(policy: LocallyLinearPolicy) -> LocallyLinearPolicy:
    """Solve at the λ of least held-out risk, as published; by default one as good may be larger."""
    least = float(policy.alphas_[np.argmin(policy.held_out_risk_)])
    return policy.set_params(alpha=least).solved()


def make_candidates() -> dict[str, Policy]:
    """Make what `--model auto` chooses from: the paper's model, then those that know more or less about policies."""
    splines = SplineTransformer(n_knots=7, extrapolation="linear")
    return {
        "locally linear": make_local_models(),
        "RBF": ParametricPolicy(NormalizedRBF(50, width=WIDTH), risk="inconsistency", alpha="cv"),
        "splines": ParametricPolicy(splines, risk="inconsistency", alpha="cv"),
        "decoupled, 15 knots": ParametricPolicy(DecoupledFeatures(15), risk="inconsistency", alpha="cv"),
        "decoupled, 31 knots": ParametricPolicy(DecoupledFeatures(31), risk="inconsistency", alpha="cv"),
        "potential": ParametricPolicy(
            PotentialFeatures(NormalizedRBF(100)), risk="inconsistency", alpha="cv"
        ),
    }


def run_auto(p: float, constraint: str, seed: int, episodes: int = EPISODES) -> dict[str, Any]:
    """Learn the same data set by every candidate, and choose among them by inconsistency alone.

    The test data and true policies serve to report errors, of all candidates; nothing of them enters the choice.
    """
    recordings = Recordings.simulate(p, constraint, seed, episodes)
    training = recordings.training
    found = select_policy(make_candidates(), training.states, training.actions, groups=training.episodes)
    result: dict[str, Any] = {"chosen": found.name}
    for name, policy in found.policies.items():
        result |= {f"{name} {error}": value for error, value in measure_errors(policy, recordings).items()}
        result[f"{name} inconsistency"] = found.table[name].error
        result[f"{name} seconds"] = found.table[name].seconds
    return result


def run_published_rows(constraints: Sequence[str], seed: int) -> dict[str, Any]:
    """Run the rows of Table I under these constraints for one seed, by `name_row`."""
    return {name_row(p, c): run_published(p, c, seed) for p in POWERS for c in constraints}


def run_adaptive_rows(constraints: Sequence[str], seed: int) -> dict[str, Any]:
    """Run the same rows by risk "adaptive"."""
    return {name_row(p, c): run_adaptive(p, c, seed) for p in POWERS for c in constraints}


def run_auto_rows(constraints: Sequence[str], seed: int) -> dict[str, Any]:
    """Run the rows whose policy is not linear likewise, with a choice of models."""
    return {name_row(p, c): run_auto(p, c, seed) for p in POWERS[:2] for c in constraints}


def name_row(p: float, constraint: str) -> str:
    """Name a row of Table I: "1.5 1-2-3"."""
    return f"{p} {constraint}"
