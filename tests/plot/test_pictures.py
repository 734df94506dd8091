"""Movements, constraints and reports are drawn on axes that are given, or on new ones."""

import subprocess
import sys

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.figure import Figure

import unconstrain as uc
from unconstrain import plot
from unconstrain.limit_cycle import LimitCycle, demonstrate


@pytest.fixture(autouse=True)
def _no_window():
    mpl.use("agg")
    yield
    pyplot.close("all")


def on_a_plane(d):
    """Movements with one direction blocked, the same at all states."""
    rng = np.random.default_rng(0)
    X, U = rng.normal(size=(80, d)), rng.normal(size=(80, d))
    U[:, 0] = 0.0
    return uc.Demonstrations(X, U)


@pytest.mark.parametrize("d", [2, 3, 5])
def test_rows_are_drawn_over_the_states_or_as_a_table(d):
    demos = on_a_plane(d)
    learnt = uc.ConstantConstraint().fit(demos.states, demos.actions)
    figure = plot.constraint_figure(learnt, demos)
    assert figure.axes[0].get_title() == f"1 of {d} directions constrained"
    assert hasattr(figure.axes[1], "get_zlabel") == (d == 3)
    assert plot.constraint(learnt, demos).get_title() == figure.axes[1].get_title()


def test_shares_not_looked_at_are_shown_together():
    demos = on_a_plane(3)
    learnt = uc.FeatureConstraint().fit(demos.states, demos.actions)
    bars = plot.shares_of_motion(learnt).patches
    assert [bar.get_height() for bar in bars] == pytest.approx([0.0, 100.0])


def test_policies_are_compared_to_one_scale():
    demos = demonstrate(3, random_state=0)
    ax = plot.comparison({"one": LimitCycle(), "twice": lambda X: 2 * LimitCycle()(X)}, demos)
    twice, one = (arrows for arrows in ax.collections if hasattr(arrows, "scale"))
    assert one.scale == twice.scale
    np.testing.assert_allclose(2 * one.U, twice.U)
    with pytest.raises(uc.errors.PolicyError, match="1 states and 1 actions"):
        plot.comparison({"one": lambda X: X}, uc.Demonstrations([[0.0], [1.0]], [[0.0], [1.0]]))


def test_movements_begin_at_dots():
    demos = demonstrate(3, random_state=0)
    ax = Figure().subplots()
    assert plot.trajectory(demos, ax=ax) is ax
    assert ax.get_xlabel() == "x1"
    assert len(ax.lines) == len(plot.trajectory(demos.states, episodes=demos.episodes).lines) == 6
    assert len(plot.trajectory(demos.states).lines) == 2


@pytest.mark.parametrize("n", [1, 3])
def test_rollouts_are_drawn_against_time(n):
    X = np.cumsum(np.ones((5, n)), axis=0)
    figure = plot.rollout_figure(uc.Demonstrations(X, np.ones((5, n)), time=np.arange(5.0)))
    assert figure.axes[1].get_xlabel() == "t (s)"
    assert len(figure.axes[1].lines) == n


@pytest.mark.parametrize("n", [1, 2, 3])
def test_reports_are_drawn_in_any_dimension(n):
    rng = np.random.default_rng(0)
    X = rng.normal(size=(60, n))
    policy = uc.ParametricPolicy(alpha=1e-3).fit(X, -X)
    report = uc.identifiability(policy, X, -X)
    figure = plot.identifiability_figure(report, [f"q{i}" for i in range(n)])
    assert figure.axes[0].get_xlabel() == "q0"


def test_matplotlib_is_imported_with_the_first_picture_only():
    code = "import sys; from unconstrain import plot; plot.check_suffix('a.png'); print('matplotlib' in sys.modules)"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "False"
