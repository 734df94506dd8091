"""Rollouts: the integration itself, constraints of every form, plants with hooks, and mistakes."""

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.constraints import projection
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, PolicyError, UnconstrainError
from unconstrain.limit_cycle import demonstrate
from unconstrain.simulation import rollout, simulate
from unconstrain.stopping import MovementStopped


def decay(X):
    return -X


class Fitted:
    n_features_in_ = 2
    state_names_ = ("reach", "height")

    def predict(self, X):
        return -X


def by_start(demos, name="states"):
    """An attribute of the demonstrations as (starts, samples, ...)."""
    values = getattr(demos, name)
    return values.reshape(demos.n_episodes, -1, *values.shape[1:])


def test_a_linear_policy_decays_as_euler_says():
    result = rollout(decay, [1.0, -2.0], steps=10, dt=0.1)
    assert isinstance(result, Demonstrations)
    assert result.n_episodes == 1
    np.testing.assert_allclose(result.states, 0.9 ** np.arange(11)[:, None] * [1.0, -2.0])
    np.testing.assert_array_equal(result.actions, -result.states)
    np.testing.assert_array_equal(result.policy, result.actions)
    np.testing.assert_allclose(result.time, np.arange(11) * 0.1)
    assert result.projections is None


def test_states_are_called_as_the_policy_learnt_them():
    named = rollout(Fitted(), [1.0, 2.0], steps=1, dt=0.1)
    assert named.state_names == ("reach", "height")
    assert named.action_names == ("reach_velocity", "height_velocity")
    assert rollout(decay, [1.0, 2.0], steps=1, dt=0.1).state_names == ("x1", "x2")


def test_many_starts_are_followed_side_by_side():
    starts = np.random.default_rng(0).normal(size=(5, 2))
    together = rollout(Fitted(), starts, steps=7, dt=0.2)
    assert together.n_episodes == 5
    np.testing.assert_allclose(by_start(together, "time"), np.tile(np.arange(8) * 0.2, (5, 1)))
    for i, start in enumerate(starts):
        alone = rollout(Fitted(), start, steps=7, dt=0.2)
        np.testing.assert_array_equal(alone.states, together.episode(i).states)


def test_a_constraint_keeps_its_direction_still():
    A = np.array([[1.0, 1.0]])
    result = rollout(decay, [[1.0, 0.0], [0.0, 2.0]], steps=20, dt=0.1, constraint=A)
    np.testing.assert_allclose(result.actions @ A.T, 0, atol=1e-14)
    np.testing.assert_allclose(by_start(result) @ A[0], np.repeat([[1.0], [2.0]], 21, axis=1))
    np.testing.assert_array_equal(result.projections, np.tile(projection(A), (42, 1, 1)))
    np.testing.assert_array_equal(result.policy, -result.states)


@pytest.mark.parametrize(
    "radial", [lambda X: X[:, None, :], lambda X: np.stack([X, 2 * X], axis=1)], ids=["rows", "redundant"]
)
def test_a_constraint_that_depends_on_the_state(radial):
    def turn_and_shrink(X):
        return np.stack([-X[:, 1], X[:, 0]], axis=1) - X

    result = rollout(turn_and_shrink, [[1.0, 0.0], [0.0, 2.0]], steps=50, dt=1e-3, constraint=radial)
    lengths = np.linalg.norm(by_start(result), axis=-1)
    np.testing.assert_allclose(lengths, [[1.0] * 51, [2.0] * 51], rtol=1e-4)
    np.testing.assert_allclose(result.projections, projection(radial(result.states)), atol=1e-15)


def test_no_rows_is_no_constraint():
    free = rollout(decay, [1.0, 2.0], 3, 0.1)
    np.testing.assert_array_equal(
        rollout(decay, [1.0, 2.0], 3, 0.1, constraint=np.empty((0, 2))).states, free.states
    )


def test_a_movement_ends_at_the_first_state_that_says_so():
    ended = rollout(decay, [[1.0], [2.0]], steps=50, dt=0.1, stop_when=lambda X: X[:, 0] < 0.8)
    assert [len(ended.episode(k)) for k in range(2)] == [4, 10]
    assert all(ended.episode(k).states[-1] < 0.8 <= ended.episode(k).states[-2] for k in range(2))
    assert not ended.stopped
    np.testing.assert_array_equal(ended.actions, -ended.states)
    assert len(rollout(decay, [1.0], steps=50, dt=0.1, stop_when=lambda X: True)) == 1


def test_a_policy_of_one_action_may_predict_a_flat_array():
    np.testing.assert_array_equal(
        rollout(lambda X: -X[:, 0], [[1.0], [3.0]], 4, 0.1).states,
        rollout(decay, [[1.0], [3.0]], 4, 0.1).states,
    )


def test_a_plant_says_how_it_is_constrained_and_how_it_moves():
    asked = []

    def project(k, X, wanted):
        asked.append(k)
        return np.tile(np.diag([1.0, k % 2]), (len(X), 1, 1))

    def advance(X, U):
        return np.minimum(X + U, 5.0), 2 * U  # stops at 5, and reports twice of what it did

    result = simulate(np.ones_like, [[1.0, 1.0]], 3, 1.0, project=project, advance=advance)
    assert asked == [0, 1, 2, 3]
    np.testing.assert_array_equal(result.states, [[1, 1], [2, 1], [3, 2], [4, 2]])
    np.testing.assert_array_equal(result.actions, [[2, 0], [2, 2], [2, 0], [2, 2]])
    np.testing.assert_array_equal(result.policy, np.ones((4, 2)))
    np.testing.assert_array_equal(result.projections[:, 1, 1], [0, 1, 0, 1])
    assert len(simulate(decay, [1.0], 0, 1.0)) == 1


def test_each_movement_stops_by_itself_where_it_diverges():
    with pytest.warns(
        MovementStopped, match=r"1 of 2 .* no. 0 stopped after 1 of 5 steps \(0.1 s\), at x1 1e\+119: "
    ):
        result = rollout(lambda X: np.where(X > 0.5, 1e120 * X, -X), [[1.0], [0.2]], steps=5, dt=0.1)
    assert [len(result.episode(k)) for k in range(2)] == [2, 6]
    assert [(stop.episode, stop.step) for stop in result.stopped] == [(0, 1)]
    with pytest.raises(UnconstrainError, match="not finite at step 0 of 1"):
        rollout(lambda X: X + np.inf, [1.0], steps=1, dt=0.1)


def test_movements_stay_near_what_was_recorded_and_within_limits():
    X = np.random.default_rng(0).uniform(-1, 1, size=(400, 2))
    policy = uc.ParametricPolicy(uc.NormalizedRBF(20), risk="direct", alpha=1e-6).fit(X, X)
    assert policy.distance(X).max() == 0
    with pytest.warns(MovementStopped):
        result = policy.rollout([[0.5, 0.0], [0.0, -0.2], [9.0, 9.0]], steps=4000, dt=0.005, beyond=0.7)
    assert [stop.episode for stop in result.stopped] == [0, 1, 2]
    assert policy.distance(result.select(result.episodes < 2).states).max() <= 0.7
    assert policy.distance(np.stack([stop.state for stop in result.stopped[:2]])).min() > 0.6
    assert len(result.episode(2)) == 1  # a start far away
    with pytest.warns(MovementStopped, match="x2 would be -0.5"):
        held = policy.rollout(
            [[0.0, -0.2], [0.3, 0.1]], 60, 0.02, limits=[None, (-0.5, np.inf)], beyond=np.inf
        )
    assert [len(held.episode(k)) < 61 for k in range(2)] == [True, False]
    assert held.states[:, 1].min() >= -0.5


def test_what_does_not_fit_into_memory_is_refused_before_the_work():
    with pytest.raises(UnconstrainError, match=r"1,000,000,000,001 samples from 1 start would take .* GB"):
        rollout(decay, [1.0, 2.0], steps=10**12, dt=0.1)
    with pytest.raises(UnconstrainError, match="from 1,000,000,000,000 starts would take"):
        demonstrate(10**12)


@pytest.mark.parametrize(
    ("kind", "arguments", "sentence"),
    [
        (PolicyError, {"start": [1.0, 2.0, 3.0]}, "3 numbers but .* 2 dimensions: give 2"),
        (PolicyError, {"policy": lambda X: X[:, :1]}, "2 states to 1 action,"),
        (PolicyError, {"policy": lambda X: X[0]}, "one row of actions each"),
        (PolicyError, {"policy": 3}, "needs a policy"),
        (DataError, {"start": [1.0, np.nan]}, "NaN or infinity in dimension 1 of start 0"),
        (DataError, {"start": np.zeros((2, 2, 2))}, r"not \(2, 2, 2\)"),
        (DataError, {"start": "here"}, "must be an array of numbers"),
        (DataError, {"constraint": [[1.0, 2.0, 3.0]]}, "rows have 3 numbers .* 2 actions"),
        (DataError, {"constraint": lambda X: np.ones((4, 1, 2))}, "rows for 4 states where there is 1"),
        (DataError, {"constraint": [1.0, 2.0]}, r"write a single row as \[\["),
        (UnconstrainError, {"dt": 0.0}, "positive number of seconds, not 0"),
        (UnconstrainError, {"dt": np.nan}, "positive number of seconds, not nan"),
        (UnconstrainError, {"dt": "fast"}, "positive number of seconds, not 'fast'"),
        (UnconstrainError, {"steps": 0}, "at least 1, not 0"),
        (UnconstrainError, {"steps": 1.5}, "whole number of steps"),
        (UnconstrainError, {"steps": np.inf}, "whole number of steps"),
        (UnconstrainError, {"steps": "many"}, "whole number of steps"),
    ],
)
def test_mistakes_are_told_in_a_sentence(kind, arguments, sentence):
    usual = {"policy": Fitted(), "start": [1.0, 2.0], "steps": 3, "dt": 0.1}
    with pytest.raises(kind, match=sentence):
        rollout(**(usual | arguments))
