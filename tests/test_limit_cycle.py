"""The limit cycle and its constrained demonstrations do what the paper's equations say."""

import numpy as np
import pytest

from unconstrain.errors import DataError, UnconstrainError
from unconstrain.limit_cycle import LimitCycle, demonstrate
from unconstrain.simulation import rollout


def test_the_field_is_the_polar_one():
    r, theta = np.meshgrid([0.2, 0.7, 1.1], np.linspace(0, 6, 7))
    r, theta = r.ravel(), theta.ravel()
    X = np.stack([r * np.sin(theta), r * np.cos(theta)], axis=1)
    dr, dtheta = r * (0.3 - r**2), 2.0
    expected = np.stack(
        [
            dr * np.sin(theta) + r * np.cos(theta) * dtheta,
            dr * np.cos(theta) - r * np.sin(theta) * dtheta,
        ],
        axis=1,
    )
    np.testing.assert_allclose(LimitCycle(rho=0.3, omega=2.0)(X), expected, atol=1e-15)
    np.testing.assert_array_equal(LimitCycle()([[0.0, 0.0]]), [[0.0, 0.0]])


def test_movement_ends_on_the_cycle():
    movements = rollout(LimitCycle(), [[0.05, 0.0], [1.0, -1.0]], steps=2000, dt=0.01)
    end = movements.states.reshape(2, 2001, 2)[:, -1]
    np.testing.assert_allclose(np.linalg.norm(end, axis=1), np.sqrt(0.5), rtol=0.01)


def test_demonstrations_are_the_papers():
    demos = demonstrate(random_state=0)
    assert demos.states.shape == demos.actions.shape == (1600, 2)
    assert np.all(np.abs(demos.states[::40]) <= 1)
    np.testing.assert_allclose(demos.policy, LimitCycle()(demos.states))
    np.testing.assert_allclose(np.einsum("nij,nj->ni", demos.projections, demos.policy), demos.actions)
    np.testing.assert_allclose(np.trace(demos.projections, axis1=1, axis2=2), 1.0)
    X, U = demos.states.reshape(40, 40, 2), demos.actions.reshape(40, 40, 2)
    np.testing.assert_allclose(np.diff(X, axis=1), U[:, :-1] / 50, atol=1e-15)
    changes = np.any(np.diff(demos.projections.reshape(40, 40, 4), axis=1) != 0, axis=2)
    np.testing.assert_array_equal(changes.sum(axis=1), 2)


def test_noise_is_a_share_of_the_scale_and_leaves_the_movement_alone():
    clean, noisy = demonstrate(400, random_state=1), demonstrate(400, noise=0.2, random_state=1)
    np.testing.assert_array_equal(clean.states, noisy.states)
    error = (noisy.actions - clean.actions).std(axis=0)
    np.testing.assert_allclose(error, 0.2 * clean.actions.std(axis=0), rtol=0.05)


def test_without_constraints_the_policy_itself_is_seen():
    demos = demonstrate(5, constrained=False, random_state=2)
    np.testing.assert_array_equal(demos.actions, demos.policy)


def test_a_share_of_the_segments_is_free():
    papers, mixed = demonstrate(400, random_state=3), demonstrate(400, free=0.3, random_state=3)
    ranks = np.trace(mixed.projections, axis1=1, axis2=2).round().reshape(400, 40)
    np.testing.assert_allclose(np.mean(ranks == 2), 0.3, atol=0.04)
    changes = np.flatnonzero(np.any(np.diff(ranks, axis=1), axis=0)) + 1
    np.testing.assert_array_equal(changes, [14, 27], "only where a constraint would be drawn anew")
    np.testing.assert_allclose(np.einsum("nij,nj->ni", mixed.projections, mixed.policy), mixed.actions)
    constrained = ranks.ravel() == 1
    np.testing.assert_array_equal(mixed.projections[constrained], papers.projections[constrained])


def test_no_share_or_all_of_it_is_what_it_was_before():
    for free, constrained in ((0.0, True), (1.0, False)):
        given = demonstrate(5, free=free, random_state=4)
        np.testing.assert_array_equal(
            given.actions, demonstrate(5, constrained=constrained, random_state=4).actions
        )


def test_the_same_random_state_gives_the_same_data():
    np.testing.assert_array_equal(
        demonstrate(3, random_state=7).actions, demonstrate(3, random_state=7).actions
    )
    assert np.any(demonstrate(3, random_state=7).actions != demonstrate(3, random_state=8).actions)


@pytest.mark.parametrize(
    ("kind", "call", "sentence"),
    [
        (UnconstrainError, lambda: demonstrate(0), "at least one episode"),
        (UnconstrainError, lambda: demonstrate(rate=-1), "positive rate"),
        (UnconstrainError, lambda: demonstrate(noise=-0.1), "0 or more, not -0.1"),
        (UnconstrainError, lambda: demonstrate(free=1.1), "0 to 1, not 1.1"),
        (DataError, lambda: LimitCycle()(np.zeros((2, 3))), r"shape \(N, 2\)"),
    ],
)
def test_mistakes_are_told_in_a_sentence(kind, call, sentence):
    with pytest.raises(kind, match=sentence):
        call()
