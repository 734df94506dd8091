"""Each picture is drawn on axes that are given, of any dimension, and says what it leaves out."""

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
from unconstrain.plot.arrows import find_full_speed, scale_arrows
from unconstrain.stopping import Movement, Stop


@pytest.fixture(autouse=True)
def _no_window():
    mpl.use("agg")
    yield
    pyplot.close("all")


def towards_origin(n):
    """Three movements of a linear policy, and that policy learnt from them, contact and all."""
    X = np.random.default_rng(0).normal(size=(60, n))
    demos = uc.Demonstrations(X, -X, np.repeat([0, 1, 2], 20))
    return uc.ParametricPolicy(alpha=1e-3).fit(demos), demos


def arrows_of(ax):
    return {each.get_label(): each for each in ax.collections if hasattr(each, "scale")}


def legend_of(ax):
    (strip,) = (child for child in ax.child_axes if child.get_label() == "legend above")
    legend = strip.get_legend()
    return [legend.get_title().get_text(), *(text.get_text() for text in legend.get_texts())]


@pytest.mark.parametrize(("n", "space"), [(1, False), (2, False), (7, False), (3, True)])
def test_every_picture_is_drawn_on_the_axes_given(n, space):
    policy, demos = towards_origin(n)
    movement = policy.rollout(demos.states[0], 5, 0.02)
    blocked = demos.actions * (np.arange(n) > 0)
    pictures = {
        "policy": (policy, demos),
        "comparison": (policy, demos),
        "demonstrations": (demos,),
        "contact": (policy, demos),
        "rollout": (movement, demos),
        "identifiability": (uc.identifiability(policy, demos),),
    }
    if n > 1:
        learnt = uc.ConstantConstraint(1).fit(demos.states, blocked)
        pictures["constraint"] = (learnt, uc.Demonstrations(demos.states, blocked))
    for name, arguments in pictures.items():
        figure = Figure(layout="constrained")
        ax = figure.add_subplot(projection="3d" if space else None)
        more = {"coordinates": (2, 0, 1)} if space else {}
        assert getattr(plot, name)(*arguments, ax=ax, **more) is ax
        assert ax.get_xlabel() in (("x3",) if space else ("x1", "time (s)", "sample", ""))
        figure.draw_without_rendering()


def test_states_actions_and_episodes_do_where_demonstrations_do():
    policy, demos = towards_origin(2)
    given = plot.policy(policy, demos.states, demos.actions, groups=demos.episodes)
    np.testing.assert_array_equal(
        *(each.lines[0].get_xdata() for each in (given, plot.policy(policy, demos)))
    )


def test_one_fast_stretch_does_not_shorten_the_other_arrows():
    slow = np.tile([0.1, 0.0], (70, 1))
    arrows = scale_arrows(np.concatenate([slow, 1000 * slow[:30]]))
    np.testing.assert_allclose(np.linalg.norm(arrows, axis=1), [1 / 3] * 70 + [1] * 30)
    assert find_full_speed(np.zeros((3, 2))) == 1.0


def test_arrows_of_two_policies_have_one_scale():
    demos = demonstrate(3, random_state=0)
    ax = plot.comparison(LimitCycle(), demos, other=lambda X: LimitCycle()(X) / 2)
    one, half = (arrows_of(ax)[name] for name in ("learnt policy", "ordinary regression"))
    longest = np.hypot(one.U, one.V).max()
    short = np.hypot(one.U, one.V) < 0.99 * longest
    np.testing.assert_allclose(half.U[short], one.U[short] / 2)
    assert ax.get_title().endswith("50% apart")
    assert legend_of(ax)[0].startswith("longest arrows: ")


def test_arrows_stand_near_the_data_unless_a_region_is_given():
    demos = uc.Demonstrations([[0.9, 0.9], [0.8, 0.9], [-1.0, -1.0]], np.ones((3, 2)))
    near, all_over = (
        arrows_of(plot.policy(LimitCycle(), demos, region=region))["learnt policy"].get_offsets()
        for region in (None, [[-1, -1], [1, 1]])
    )
    assert np.all(np.linalg.norm(near - demos.states[[0]], axis=1).min() < 0.2)
    assert len(all_over) == 256 > 20 > len(near)
    assert len(arrows_of(plot.policy(towards_origin(2)[0]))) == 1  # where it was learnt


def test_axes_have_the_units_of_states_and_one_scale_where_they_share_it():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(30, 2))
    lengths = uc.Demonstrations(X, -X, state_names=["x [m]", "y [m]"])
    ax = plot.policy(lambda X: -X, lengths)
    assert (ax.get_ylabel(), ax.get_aspect()) == ("y [m]", 1.0)
    assert legend_of(ax)[0].endswith(" m/s or faster")
    space = uc.spaces.Product.of(uc.spaces.Numbers(1), uc.spaces.Angle(1))
    mixed = uc.Demonstrations(X, -X, state_names=["x [m]", "q"], space=space)
    ax = plot.policy(lambda X: -X, mixed)
    assert (ax.get_ylabel(), ax.get_aspect()) == ("q (rad)", "auto")
    far = uc.Demonstrations(X * [1, 1000], -X)
    assert plot.demonstrations(far).get_aspect() == "auto"


def test_a_quaternion_has_no_arrows_and_that_is_said():
    X = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (9, 1))
    X[:, 0] = np.arange(9)
    demos = uc.Demonstrations(X, np.ones((9, 6)), space=uc.spaces.Pose())
    still = lambda X: np.ones((len(X), 6))  # noqa: E731
    assert "no velocities" in plot.policy(still, demos, coordinates=(4, 5)).get_title()
    assert arrows_of(plot.policy(still, demos, coordinates=(0, 2)))


def test_a_rollout_that_had_to_stop_ends_in_a_cross():
    X = np.column_stack([np.arange(3.0), np.zeros(3)])
    stop = Stop(0, 2, 0.04, X[-1], "it left")
    movement = Movement(X, np.ones((3, 2)), time=np.arange(3) / 50, stopped=[stop])
    assert "stopped after 0.04 s" in legend_of(plot.rollout(movement))
    ax = plot.rollout(movement, against_time=True)
    assert ax.get_xlabel() == "time (s)"
    assert legend_of(ax) == ["", "x1", "x2"]


def test_contact_is_inferred_of_all_and_colours_what_is_drawn():
    policy, _ = towards_origin(2)
    X = np.random.default_rng(1).normal(size=(50_000, 2))
    N = np.tile(np.eye(2), (len(X), 1, 1))
    N[::2] = [[1.0, 0.0], [0.0, 0.0]]
    U = np.einsum("nij,nj->ni", N, -X)
    ax = plot.contact(policy, uc.Demonstrations(X, U, projections=N))
    (dots,) = (each for each in ax.collections if each.get_array() is not None)
    assert len(dots.get_array()) == 20_000
    assert set(np.unique(dots.get_array())) == {0.0, 1.0}
    assert "50%" in ax.get_title()


def test_thousands_of_episodes_are_thinned_and_the_legend_says_so():
    X = np.random.default_rng(0).normal(size=(60_000, 2))
    ax = plot.demonstrations(uc.Demonstrations(X, X, np.arange(60_000) // 20))
    assert ax.get_legend_handles_labels()[1] == ["recorded movement (1,000 of 3,000)"]
    line, starts = (each.get_xdata() for each in ax.lines)
    assert len(starts) == 1000
    assert np.isnan(line).sum() == 1000
    assert len(line) <= 21_000


def test_rows_are_drawn_over_states_or_as_a_table():
    for n, title in ((2, "1 of 2 directions constrained"), (3, "1 of 3 dir"), (5, "Mean squares")):
        X = np.random.default_rng(0).normal(size=(40, n))
        U = X * (np.arange(n) > 0)
        ax = plot.constraint(uc.ConstantConstraint(1).fit(X, U), X, U)
        assert ax.get_title().startswith(title)
        assert hasattr(ax, "get_zlim") == (n == 3)


def test_matplotlib_is_imported_with_the_first_picture_only():
    code = "import sys; from unconstrain.plot import save; print('matplotlib' in sys.modules)"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "False"
