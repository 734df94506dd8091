"""The finger slides along obstacles: it never enters one, and every action is its policy projected."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reproduction.plants.box import Box
from reproduction.plants.finger import PENETRATION, Finger
from unconstrain.errors import DataError, UnconstrainError

FINGER = Finger()
CURLED = np.array([1.2, 1.3, 1.0])
IN_THE_WAY = Box((0.085, -0.022), (0.04, 0.022), -0.5, 0.003)

boxes = st.builds(
    lambda x, y, w, h, angle: Box((x, y), (w, h), angle),
    st.floats(0.03, 0.1),
    st.floats(-0.07, 0.0),
    st.floats(0.006, 0.05),
    st.floats(0.006, 0.05),
    st.floats(-3, 3),
)


def test_stretched_out_the_finger_points_forward():
    np.testing.assert_allclose(FINGER.joints(np.zeros((1, 3)))[0, :, 0], np.cumsum([0, *FINGER.lengths]))
    np.testing.assert_array_equal(FINGER.joints(np.zeros((1, 3)))[0, :, 1], 0)
    assert FINGER.joints([[0.5, 0.0, 0.0]])[0, -1, 1] < 0


def test_without_obstacles_every_joint_decays():
    demos = FINGER.demonstrate(CURLED, length=100, rate=50)
    np.testing.assert_array_equal(demos.actions, demos.policy)
    np.testing.assert_allclose(demos.states[-1], CURLED * np.exp(-99 / 50), rtol=0.01)


def test_clearance_is_a_distance():
    box = Box((0.2, 0.0), (0.1, 0.1), 0.0, 0.01)
    straight = sum(FINGER.lengths) + FINGER.radius
    np.testing.assert_allclose(FINGER.clearance(np.zeros((1, 3)), box), 0.15 - straight)
    assert FINGER.clearance(np.zeros((1, 3)), []) == np.inf


def test_contact_rows_are_the_gradient_of_the_clearance():
    demos = FINGER.demonstrate(CURLED, IN_THE_WAY, length=75)
    q = demos.states[-1]
    (row,) = FINGER.constraint(q, IN_THE_WAY)
    h = 1e-7
    gradient = [FINGER.clearance([q + h * e, q - h * e], IN_THE_WAY) @ [0.5, -0.5] / h for e in np.eye(3)]
    np.testing.assert_allclose(row, gradient, atol=1e-6)


@settings(max_examples=15, deadline=None)
@given(boxes)
def test_never_inside_and_always_the_projected_policy(box):
    if FINGER.clearance(CURLED[None], box)[0] < 0:
        with pytest.raises(DataError, match="start 0 lies inside an obstacle"):
            FINGER.demonstrate(CURLED, box)
        return
    demos = FINGER.demonstrate(CURLED, box, length=60, rate=20)
    assert FINGER.clearance(demos.states, box).min() >= -PENETRATION
    np.testing.assert_allclose(
        np.einsum("nij,nj->ni", demos.projections, demos.policy), demos.actions, atol=1e-14
    )
    np.testing.assert_allclose(demos.projections @ demos.projections, demos.projections, atol=1e-12)
    for q, u in zip(demos.states, demos.actions, strict=True):
        contacts = FINGER.contacts(q, [box])
        assert np.all(contacts.rows[contacts.distances <= 1e-5] @ u >= -1e-9), (
            "the action presses into the obstacle"
        )


def test_the_finger_moves_as_its_actions_say():
    demos = FINGER.demonstrate(CURLED, IN_THE_WAY, length=400, rate=500)
    moved = np.diff(demos.states, axis=0) * 500
    gap = np.linalg.norm(moved - demos.actions[:-1], axis=1)
    assert np.median(gap) < 0.003
    assert np.sum(gap > 0.02) <= 1, "only where the contact begins, within a sample, may they differ"


def test_several_contacts_at_once():
    hold = [Box((0.03, 0.012), (0.02, 0.01)), Box((0.085, -0.022), (0.04, 0.022), -0.5)]
    demos = FINGER.demonstrate(CURLED, hold, length=300)
    assert FINGER.clearance(demos.states, hold).min() >= -PENETRATION
    freedom = np.trace(demos.projections, axis1=1, axis2=2)
    assert set(np.round(freedom).astype(int)) >= {2, 3}


def test_each_start_can_have_its_own_obstacles():
    demos = FINGER.demonstrate([CURLED, CURLED], [[], [IN_THE_WAY]], length=80)
    free, bound = demos.episode(0), demos.episode(1)
    np.testing.assert_array_equal(free.actions, free.policy)
    assert np.any(bound.actions != bound.policy)
    np.testing.assert_array_equal(bound.states, FINGER.demonstrate(CURLED, IN_THE_WAY, length=80).states)


@pytest.mark.parametrize(
    ("kind", "call", "sentence"),
    [
        (DataError, lambda: FINGER.demonstrate([1.0, 2.0]), "has 3 joints"),
        (DataError, lambda: FINGER.demonstrate([1.0, 2.0, np.nan]), "NaN or infinity"),
        (UnconstrainError, lambda: FINGER.demonstrate(CURLED, length=0), "at least one sample"),
        (UnconstrainError, lambda: FINGER.demonstrate(CURLED, [[], []]), "each of the 1 starts"),
        (UnconstrainError, lambda: Box((0, 0), (0.1, 0.1), 0, 0.06), "under half of the shorter side"),
        (UnconstrainError, lambda: Box((0, np.nan), (0.1, 0.1)), "finite numbers"),
    ],
)
def test_mistakes_are_told_in_a_sentence(kind, call, sentence):
    with pytest.raises(kind, match=sentence):
        call()


def test_outlines_are_as_thick_as_the_finger():
    for outline in FINGER.outlines([0.4, 0.3, 0.2]):
        assert outline.shape == (34, 2)
    straight = FINGER.outlines(np.zeros(3)).reshape(-1, 2)
    np.testing.assert_allclose(np.ptp(straight[:, 1]), 2 * FINGER.radius)
    np.testing.assert_allclose(np.ptp(straight[:, 0]), sum(FINGER.lengths) + 2 * FINGER.radius)
