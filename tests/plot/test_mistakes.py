"""What cannot be drawn is told in one sentence, and no empty picture is left open."""

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import pyplot

import unconstrain as uc
from unconstrain import plot
from unconstrain.limit_cycle import LimitCycle, demonstrate

DEMOS = demonstrate(3, random_state=0)
X, U = DEMOS.states, DEMOS.actions
CYCLE = LimitCycle()
REPORT = uc.identifiability(uc.ParametricPolicy().fit(X, U), X, U)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (
            lambda: plot.trajectory(X, coordinates=(0, 2)),
            "coordinates must be a whole number from 0 to 1, got 2",
        ),
        (lambda: plot.trajectory(X, coordinates=3.5), "coordinates must be two numbers"),
        (lambda: plot.trajectory(X[:, 0]), "movements must be states"),
        (lambda: plot.trajectory(X, episodes=[1, 2]), "episodes must hold one label a sample"),
        (lambda: plot.policy(CYCLE, DEMOS, coordinates="xy"), "coordinates must be two numbers"),
        (lambda: plot.comparison({}, DEMOS), "policies must be a mapping"),
        (lambda: plot.comparison({"one": 3}, DEMOS), "a policy has a method predict"),
        (lambda: plot.agreement(U, U[:5]), "must have the same shape"),
        (lambda: plot.field(CYCLE, (0, 0, 0)), "low must be a corner of the region"),
        (lambda: plot.field(CYCLE, (1, 1), (0, 0)), "low first"),
        (lambda: plot.field(CYCLE, n=0), "n must be a whole number of at least 1"),
        (lambda: plot.field(CYCLE, n=10**9), "memory"),
        (lambda: plot.field(CYCLE, near=[1.0]), "near must be states"),
        (
            lambda: plot.standard_deviation(REPORT, X.min(0), X.max(0), levels=[1.0]),
            "levels must be two or more",
        ),
        (lambda: plot.standard_deviation(REPORT, [0], [1]), "low must be a corner"),
        (lambda: plot.identifiability_figure(REPORT, "x"), "state_names must be 2 names"),
        (lambda: plot.rollout_figure(DEMOS, ["x"]), "state_names must be 2 names"),
        (lambda: plot.check_suffix(3.5), "is no path of a file"),
    ],
)
def test_mistakes_are_told_before_anything_is_drawn(call, sentence):
    mpl.use("agg")
    pyplot.close("all")
    with pytest.raises(uc.errors.UnconstrainError, match=sentence) as caught:
        call()
    assert "\n" not in str(caught.value)
    assert not pyplot.get_fignums()


def test_a_constraint_of_other_actions_is_not_drawn():
    learnt = uc.ConstantConstraint(1).fit(X, np.column_stack([U, U[:, 0]]))
    with pytest.raises(uc.errors.DataError, match="one of 3 actions, and the demonstrations have 2"):
        plot.constraint(learnt, DEMOS)
