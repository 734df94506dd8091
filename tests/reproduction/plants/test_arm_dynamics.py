"""In physics the arm moves nearly as the projection says, though no projection is in the loop."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

from reproduction.plants import arm, arm_dynamics
from reproduction.plants.arm_stage import GRIPPED, SCENARIOS, SERVO_GAIN, TABLE, TIP, TIP_RADIUS, stage
from unconstrain.errors import UnconstrainError

RECORDED = {
    name: arm_dynamics.demonstrate(name, n_episodes=4, duration=1.5, random_state=0) for name in SCENARIOS
}


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_physics_is_near_the_ideal_projection(scenario):
    recording = RECORDED[scenario]
    demos = recording.demonstrations
    fast = np.linalg.norm(demos.actions, axis=1) > 0.1
    assert np.nanmedian(np.degrees(recording.off_projection()[fast])) < 1.0
    # What the constraint took away is far more than that.
    assert np.mean(np.linalg.norm(demos.policy - demos.actions, axis=1)[recording.touching]) > 0.1


def test_a_gripped_hand_stays():
    demos = RECORDED[GRIPPED].demonstrations
    place = arm.pose(demos.states)[0].reshape(4, -1, 3)
    assert np.abs(place - place[:, :1]).max() < 2e-3
    assert np.ptp(demos.states.reshape(4, -1, 7), axis=1).max() > 0.2, "while the arm moves"


def test_a_tip_touches_the_table_and_is_pushed_along_its_normal():
    recording = RECORDED[TABLE]
    robot, touching = stage(TABLE), recording.touching
    tip, _ = robot.pose(recording.demonstrations.states, TIP)
    table = recording.tables[recording.demonstrations.episodes, :3]
    height = np.einsum("ni,ni->n", tip - table, recording.normals) - TIP_RADIUS
    assert touching.mean() > 0.3
    assert np.abs(height[touching]).max() < 2e-3
    assert height.min() > -2e-3
    force = np.einsum("ni,ni->n", recording.contact_force, recording.normals)
    assert np.all(force[touching] > 0)
    np.testing.assert_array_equal(recording.contact_force[~touching], 0)
    np.testing.assert_allclose(np.linalg.norm(recording.contact_force, axis=1), force, rtol=1e-12)
    # Quasi-static: the servo's pull along the joints is what the table answers, k (π - q̇) = -Jᵀ f.
    J = robot.jacobian(recording.demonstrations.states, TIP)[:, :3]
    demos = recording.demonstrations
    pull = SERVO_GAIN * (demos.policy - demos.actions)
    answer = -np.einsum("nij,ni->nj", J, recording.contact_force)
    assert np.median(np.linalg.norm(pull - answer, axis=1)[touching]) < 0.05 * np.median(
        np.linalg.norm(answer, axis=1)[touching]
    )


def test_tables_differ_from_trajectory_to_trajectory():
    tables = RECORDED[TABLE].tables
    assert np.ptp(tables[:, 2]) > 0.01
    assert np.ptp(tables[:, 4]) > 0.01


def test_the_same_seed_gives_the_same_recording():
    again = arm_dynamics.demonstrate(GRIPPED, n_episodes=4, duration=1.5, random_state=0)
    np.testing.assert_array_equal(again.demonstrations.states, RECORDED[GRIPPED].demonstrations.states)


def test_mistakes_are_told_in_a_sentence():
    with pytest.raises(UnconstrainError, match="no scenario 'wall'"):
        arm_dynamics.demonstrate("wall")
    with pytest.raises(UnconstrainError, match=r"a duration above 0\.2 s"):
        arm_dynamics.demonstrate(GRIPPED, duration=0.1)
