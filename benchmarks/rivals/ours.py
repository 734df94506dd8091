"""Our own policies, of the model that a plant has on other pages."""

import warnings

from benchmarks.rivals.cloning import make_trees
from benchmarks.rivals.learnt import Field, Recorded
from reproduction.adaptive import ways
from unconstrain.policies import RegressorPolicy


def learn(recorded: Recorded, way: str) -> Field:
    """Learn in one of the ways: "direct", "adaptive" or "told"."""
    demos = recorded.demos
    return Field(ways.learn(recorded.make_model(), way, demos, demos.projections).predict)


def wrap_trees(recorded: Recorded, leaf: int) -> Field:
    """Learn the same trees as behaviour cloning has, by the adaptive risk."""
    demos = recorded.demos
    policy = RegressorPolicy(make_trees(leaf))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that no contact was found is what is measured here
        return Field(policy.fit(demos.states, demos.actions, groups=demos.episodes).predict)
