"""Behaviour cloning: a network or trees that regress recorded actions on states."""

from typing import Any

import numpy as np
from sklearn.compose import TransformedTargetRegressor
from sklearn.ensemble import ExtraTreesRegressor
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from benchmarks.rivals.learnt import Field, Recorded
from reproduction.adaptive.bound import is_free

TREES = 50


def learn_network(recorded: Recorded, option: tuple[tuple[int, ...], float]) -> Field:
    """Fit a network with hidden layers of these sizes and this penalty, by L-BFGS."""
    sizes, alpha = option
    network = MLPRegressor(
        hidden_layer_sizes=sizes, solver="lbfgs", alpha=alpha, max_iter=300, random_state=0
    )
    regressor = TransformedTargetRegressor(
        make_pipeline(StandardScaler(), network), transformer=StandardScaler()
    )
    return fit(regressor, recorded)


def learn_trees(recorded: Recorded, leaf: int) -> Field:
    """Fit trees whose leaves hold at least so many samples."""
    return fit(make_trees(leaf), recorded)


def learn_free(recorded: Recorded, leaf: int) -> Field | None:
    """Fit trees to the samples that were free, which somebody has to tell; None where hardly any was."""
    demos = recorded.demos
    if demos.projections is None:
        return None
    free = is_free(demos.projections)
    if np.sum(free) < 2 * leaf:
        return None
    return fit(make_trees(leaf), recorded._replace(demos=demos.select(free)))


def make_trees(leaf: int) -> ExtraTreesRegressor:
    """Make extremely randomised trees."""
    return ExtraTreesRegressor(TREES, min_samples_leaf=leaf, random_state=0)


def fit(regressor: Any, recorded: Recorded) -> Field:
    """Fit any regressor."""
    return Field(regressor.fit(recorded.demos.states, recorded.demos.actions).predict)
