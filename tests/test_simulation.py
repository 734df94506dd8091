"""Rollouts: the integration itself, constraints of every form, and mistakes."""

import numpy as np
import pytest

from unconstrain.errors import DataError, PolicyError, UnconstrainError
from unconstrain.simulation import rollout


def decay(X):
    return -X


class Fitted:
    n_features_in_ = 2

    def predict(self, X):
        return -X


def test_a_linear_policy_decays_as_euler_says():
    result = rollout(decay, [1.0, -2.0], steps=10, dt=0.1)
    assert result.states.shape == (11, 2)
    assert result.actions.shape == (10, 2)
    np.testing.assert_allclose(result.states, 0.9 ** np.arange(11)[:, None] * [1.0, -2.0])
    np.testing.assert_allclose(result.actions, -result.states[:-1])
    np.testing.assert_allclose(result.time, np.arange(11) * 0.1)


def test_many_starts_are_followed_side_by_side():
    starts = np.random.default_rng(0).normal(size=(5, 2))
    together = rollout(Fitted(), starts, steps=7, dt=0.2)
    assert together.states.shape == (5, 8, 2)
    for start, states in zip(starts, together.states, strict=True):
        np.testing.assert_array_equal(rollout(Fitted(), start, steps=7, dt=0.2).states, states)


def test_a_constraint_keeps_its_direction_still():
    A = np.array([[1.0, 1.0]])
    result = rollout(decay, [[1.0, 0.0], [0.0, 2.0]], steps=20, dt=0.1, constraint=A)
    np.testing.assert_allclose(result.actions @ A.T, 0, atol=1e-14)
    np.testing.assert_allclose(result.states @ A[0], np.repeat([[1.0], [2.0]], 21, axis=1))


@pytest.mark.parametrize(
    "radial", [lambda X: X[:, None, :], lambda X: np.stack([X, 2 * X], axis=1)], ids=["rows", "redundant"]
)
def test_a_constraint_that_depends_on_the_state(radial):
    def turn_and_shrink(X):
        return np.stack([-X[:, 1], X[:, 0]], axis=1) - X

    result = rollout(turn_and_shrink, [[1.0, 0.0], [0.0, 2.0]], steps=50, dt=1e-3, constraint=radial)
    np.testing.assert_allclose(np.linalg.norm(result.states, axis=-1), [[1.0] * 51, [2.0] * 51], rtol=1e-4)


def test_no_rows_is_no_constraint():
    free = rollout(decay, [1.0, 2.0], 3, 0.1)
    np.testing.assert_array_equal(
        rollout(decay, [1.0, 2.0], 3, 0.1, constraint=np.empty((0, 2))).states, free.states
    )


def test_a_diverging_policy_is_named_with_its_step():
    with pytest.raises(UnconstrainError, match=r"at step 3 of 5 \(0\.3 s\): use a smaller time step"):
        rollout(lambda X: 1e120 * X, [1.0], steps=5, dt=0.1)


@pytest.mark.parametrize(
    ("kind", "arguments", "sentence"),
    [
        (PolicyError, {"start": [1.0, 2.0, 3.0]}, "3 numbers but .* 2 dimensions: give 2"),
        (PolicyError, {"policy": lambda X: X[:, :1]}, "2 states to 1 action,"),
        (PolicyError, {"policy": lambda X: X[0]}, "one row of actions each"),
        (PolicyError, {"policy": 3}, "needs a policy"),
        (DataError, {"start": [1.0, np.nan]}, "NaN or infinity in dimension 1 of start 0"),
        (DataError, {"start": np.zeros((2, 2, 2))}, r"not \(2, 2, 2\)"),
        (DataError, {"start": "here"}, "must be numbers"),
        (DataError, {"constraint": [[1.0, 2.0, 3.0]]}, "rows have 3 numbers .* 2 actions"),
        (DataError, {"constraint": lambda X: np.ones((4, 1, 2))}, "rows for 4 states where there is 1"),
        (DataError, {"constraint": [1.0, 2.0]}, r"write a single row as \[\["),
        (UnconstrainError, {"dt": 0.0}, "positive number of seconds, not 0"),
        (UnconstrainError, {"dt": np.nan}, "positive number of seconds, not nan"),
        (UnconstrainError, {"steps": 0}, "at least 1, not 0"),
        (UnconstrainError, {"steps": 1.5}, "whole number of steps"),
    ],
)
def test_mistakes_are_told_in_a_sentence(kind, arguments, sentence):
    usual = {"policy": Fitted(), "start": [1.0, 2.0], "steps": 3, "dt": 0.1}
    with pytest.raises(kind, match=sentence):
        rollout(**(usual | arguments))
