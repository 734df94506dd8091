"""The command line's figures are made of the pictures, and are written whole."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import unconstrain as uc
from unconstrain import plot
from unconstrain.plot import figures
from unconstrain.plot.saving import check_suffix


@pytest.mark.parametrize(("n", "panels"), [(1, 3), (2, 3), (3, 5), (7, 5)])
def test_policies_are_drawn_in_any_dimension_beside_the_contact_they_infer(n, panels):
    X = np.random.default_rng(0).normal(size=(60, n))
    demos = uc.Demonstrations(X, -X, np.repeat([0, 1, 2], 20))
    policy = uc.ParametricPolicy(alpha=1e-3).fit(demos)
    assert len(figures.draw_policy(policy, demos).axes) == panels  # with the colour bar
    direct = figures.draw_policy(uc.ParametricPolicy(risk="direct", alpha=1e-3).fit(demos), demos)
    assert [ax.get_title() for ax in direct.axes] == ["Learnt policy"] * (panels - 2)


@pytest.mark.parametrize(("suffix", "head"), [(".png", b"\x89PNG"), (".SVG", b"<?xml"), (".pdf", b"%PDF")])
def test_formats(suffix, head, tmp_path):
    movement = uc.Demonstrations(np.eye(2), np.ones((2, 2)))
    figure = figures.draw_rollout(movement)
    assert plot.save(figure, tmp_path / f"a{suffix}").read_bytes().startswith(head)
    assert [path.name for path in tmp_path.iterdir()] == [f"a{suffix}"]


def test_states_without_a_common_scale_are_followed_in_panels_of_their_own():
    X = np.cumsum(np.ones((5, 2)), axis=0) * [1, 100]
    for states, panels in ((X, 3), (X[:, :1], 1), (X / [1, 100], 2)):
        assert len(figures.draw_rollout(uc.Demonstrations(states, states)).axes) == panels


def test_a_resting_recording_can_be_drawn(tmp_path):
    demos = uc.Demonstrations(states=np.ones((5, 2)), actions=np.zeros((5, 2)))
    plot.save(plot.policy(lambda X: 0 * X, demos, ax=Figure().subplots()).figure, tmp_path / "rest.png")


def test_mistakes_are_told_in_a_sentence(tmp_path):
    with pytest.raises(uc.errors.UnconstrainError, match=r"'a\.gif': end the name in \.png, \.svg or \.pdf"):
        plot.save(Figure(), tmp_path / "a.gif")
    with pytest.raises(uc.errors.UnconstrainError, match="there is no folder"):
        plot.save(Figure(), tmp_path / "nowhere" / "a.png")
    with pytest.raises(uc.errors.UnconstrainError, match="is no path of a file"):
        check_suffix(3.5)
