"""Pictures of any dimension are drawn and written whole, and mistakes are told."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import unconstrain as uc
from unconstrain import plot
from unconstrain.errors import PolicyError, UnconstrainError
from unconstrain.limit_cycle import LimitCycle, demonstrate


def linear(X):
    return -X


@pytest.mark.parametrize(("n", "panels"), [(1, 2), (2, 2), (3, 4), (7, 4)])
def test_policies_are_drawn_in_any_dimension(n, panels, tmp_path):
    X = np.random.default_rng(0).normal(size=(60, n))
    demos = uc.Demonstrations(states=X, actions=-X, episodes=np.repeat([0, 1, 2], 20))
    figure = plot.policy_figure(linear, demos)
    assert len(figure.axes) == panels
    written = plot.save(figure, tmp_path / "field.png")
    assert written.read_bytes().startswith(b"\x89PNG")


def test_axes_carry_the_names_of_the_states():
    demos = demonstrate(3, random_state=0)
    assert plot.policy_figure(LimitCycle(), demos).axes[0].get_xlabel() == "x1"
    named = uc.Demonstrations(demos.states, demos.actions, state_names=["x [m]", "y [m]"])
    assert plot.policy(LimitCycle(), named).get_ylabel() == "y [m]"


def test_one_action_over_two_states_is_drawn_without_arrows():
    X = np.random.default_rng(0).normal(size=(30, 2))
    demos = uc.Demonstrations(states=X, actions=X[:, :1])
    assert not plot.policy_figure(lambda X: X[:, 0], demos).axes[0].collections


def test_a_resting_recording_can_be_drawn(tmp_path):
    demos = uc.Demonstrations(states=np.ones((5, 2)), actions=np.zeros((5, 2)))
    plot.save(plot.policy_figure(lambda X: 0 * X, demos), tmp_path / "rest.png")


def test_arrows_only_near_the_data():
    ax = Figure().subplots()
    assert plot.field(LimitCycle(), near=[[0.9, 0.9]], n=11, ax=ax) is ax
    (arrows,) = ax.collections
    assert 1 <= len(arrows.get_offsets()) <= 9
    assert np.all(np.asarray(arrows.get_offsets()) >= 0.6)


@pytest.mark.parametrize(("suffix", "head"), [(".png", b"\x89PNG"), (".SVG", b"<?xml"), (".pdf", b"%PDF")])
def test_formats(suffix, head, tmp_path):
    figure = plot.policy_figure(LimitCycle(), demonstrate(2, random_state=0))
    assert plot.save(figure, tmp_path / f"a{suffix}").read_bytes().startswith(head)
    assert [path.name for path in tmp_path.iterdir()] == [f"a{suffix}"]


def test_mistakes_are_told_in_a_sentence(tmp_path):
    with pytest.raises(UnconstrainError, match=r"'a\.gif': end the name in \.png, \.svg or \.pdf"):
        plot.save(Figure(), tmp_path / "a.gif")
    with pytest.raises(UnconstrainError, match="there is no folder"):
        plot.save(Figure(), tmp_path / "nowhere" / "a.png")
    with pytest.raises(PolicyError, match="has 1 actions and the demonstrations 2"):
        plot.policy_figure(lambda X: X[:, :1], demonstrate(2, random_state=0))
