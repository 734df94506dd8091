"""Constraints on a hand block what their names say, however they are written."""

import numpy as np
import pytest

from unconstrain.errors import DataError, UnconstrainError
from unconstrain.robots import TaskConstraint


@pytest.mark.parametrize(
    ("given", "selection"),
    [
        ("1-2-3", np.eye(6)[:3]),
        (" 6-1 ", np.eye(6)[[5, 0]]),
        ("3", np.eye(6)[[2]]),
        ("0,0,2", [[0, 0, 1, 0, 0, 0]]),
        ([3.0, 4.0, 0.0], [[0.6, 0.8, 0, 0, 0, 0]]),
        ("1,0,0,0,0,0; 0,0,0,0,0,2", [[1, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 2]]),
        (np.eye(6)[1:4], np.eye(6)[1:4]),
    ],
)
def test_constraints_as_users_write_them(given, selection):
    constraint = TaskConstraint.parse(given)
    np.testing.assert_allclose(constraint.selection, selection)
    assert TaskConstraint.parse(constraint) is constraint


@pytest.mark.parametrize(("one", "other"), [("1-2-3", "4-5-6"), ("1-3-5", "2-4-6"), ("6", "1-2-3-4-5")])
def test_complements_of_rows(one, other):
    assert TaskConstraint.parse(one).complement().name == other
    assert TaskConstraint.parse(other).complement().name == one


def test_the_complement_of_a_plane_is_everything_else():
    plane = TaskConstraint.parse("1,1,0")
    rest = plane.complement().selection
    assert rest.shape == (5, 6)
    np.testing.assert_allclose(rest @ plane.selection.T, 0, atol=1e-15)


@pytest.mark.parametrize(
    ("kind", "call", "sentence"),
    [
        (UnconstrainError, lambda: TaskConstraint.parse("1-2-7"), "no task row 7 as in '1-2-7'"),
        (UnconstrainError, lambda: TaskConstraint.parse("0-1"), "no task row 0"),
        (UnconstrainError, lambda: TaskConstraint.parse("1-1"), "named twice"),
        (UnconstrainError, lambda: TaskConstraint.parse("table"), "'table' is no constraint: give task rows"),
        (UnconstrainError, lambda: TaskConstraint.parse("1,2"), "is no constraint"),
        (UnconstrainError, lambda: TaskConstraint.parse("1,2,3; 1,2,3,4,5,6"), "is no constraint"),
        (UnconstrainError, lambda: TaskConstraint.parse("0,0,0"), "cannot be 0,0,0"),
        (UnconstrainError, lambda: TaskConstraint.parse("1-2-3-4-5-6").complement(), "leaves nothing free"),
        (DataError, lambda: TaskConstraint.parse("0,nan,1"), "NaN or infinity"),
        (DataError, lambda: TaskConstraint.parse(np.eye(4)), "or a matrix \\(k, 6\\), not \\(4, 4\\)"),
        (DataError, lambda: TaskConstraint.parse([["a"]]), "must be numbers"),
    ],
)
def test_mistakes_are_told_in_a_sentence(kind, call, sentence):
    with pytest.raises(kind, match=sentence) as told:
        call()
    assert "\n" not in str(told.value)


def test_rows_and_projections_follow_from_jacobians():
    rng = np.random.default_rng(0)
    J = rng.normal(size=(4, 6, 7))
    constraint = TaskConstraint.parse("0,0,1")
    np.testing.assert_array_equal(constraint.rows(J)[:, 0], J[:, 2])
    N = constraint.projections(J)
    np.testing.assert_allclose(constraint.rows(J) @ N, 0, atol=1e-14)
    np.testing.assert_allclose(np.trace(N, axis1=1, axis2=2), 6)
