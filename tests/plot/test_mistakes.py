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
DIRECT = uc.ParametricPolicy(risk="direct").fit(X, U)
REPORT = uc.identifiability(DIRECT, X, U)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (
            lambda: plot.demonstrations(X, coordinates=(0, 2)),
            "coordinates must be a whole number from 0 to 1",
        ),
        (lambda: plot.demonstrations(X, coordinates=3.5), "coordinates must be two or three numbers"),
        (lambda: plot.demonstrations(X, coordinates=(1, 1)), "coordinates must be different ones"),
        (lambda: plot.demonstrations(X[:, 0]), "states must have shape"),
        (lambda: plot.demonstrations(X, groups=[1, 2]), "episodes have shape"),
        (lambda: plot.policy(CYCLE, X), "give the actions beside the states"),
        (lambda: plot.policy(CYCLE, DEMOS, U), "bring their own actions and episodes"),
        (lambda: plot.policy(CYCLE), "give the recordings beside the policy"),
        (lambda: plot.policy(CYCLE, region=[1, 2]), "region must be two corners"),
        (
            lambda: plot.policy(CYCLE, region=[[1, 1], [0, 0]]),
            "region must be two corners, the lower one first",
        ),
        (lambda: plot.policy(CYCLE, DEMOS, region=[[1], [2]]), "region= is for one or two states"),
        (lambda: plot.policy(CYCLE, DEMOS, full_speed=0), "full_speed must be a finite number above zero"),
        (lambda: plot.policy(CYCLE, DEMOS, direct=True), "does not know ordinary regression"),
        (lambda: plot.policy(lambda X: X[:, :1], DEMOS), "the policy has 1 actions and the recordings 2"),
        (lambda: plot.policy(lambda X: X[1:], DEMOS), "it must give one row for each"),
        (lambda: plot.comparison(CYCLE, DEMOS, other=3), "a policy has a method predict"),
        (lambda: plot.contact(CYCLE, DEMOS), "contact is inferred by a policy of unconstrain"),
        (lambda: plot.contact(DIRECT, DEMOS), 'only after a fit with risk="adaptive"'),
        (lambda: plot.identifiability(REPORT, levels=[1.0]), "levels must be two or more"),
        (lambda: plot.identifiability(X), "a report is what uc.identifiability returns"),
        (lambda: plot.rollout(X, against_time=True, coordinates=[5]), "coordinates must be a whole number"),
        (lambda: plot.constraint(X, DEMOS), "a constraint is one that was learnt"),
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
    with pytest.raises(uc.errors.DataError, match="one of 3 actions, and the recordings have 2"):
        plot.constraint(learnt, DEMOS)
