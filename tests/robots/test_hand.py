"""A hand's policy is learnt from joints, contact included."""

from importlib.metadata import distribution

import numpy as np
import pytest

pytest.importorskip("mujoco")

import unconstrain as uc
from unconstrain.robots import HandFeatures, Robot

HAND = "panda_hand_tcp"


@pytest.fixture(scope="module")
def panda():
    (file,) = [file for file in distribution("example-robot-data").files or [] if file.name == "panda.urdf"]
    return Robot.load(file.locate(), lock=["panda_finger_joint1", "panda_finger_joint2"])


@pytest.fixture(scope="module")
def postures(panda):
    return np.random.default_rng(0).uniform(*panda.limits.T, (400, panda.n))


@pytest.fixture(scope="module")
def features(panda, postures):
    return HandFeatures(panda, HAND, uc.NormalizedRBF(5)).fit(postures, panda.n)


def parameters(features):
    return np.random.default_rng(1).normal(size=3 * 5 + 2 * features.robot.n)


def test_features_along_a_direction_are_that_part_of_the_policy(features, postures):
    directions, w = np.random.default_rng(2).normal(size=postures.shape), parameters(features)
    along = np.einsum("nd,nd->n", directions, features.evaluate(postures, w))
    np.testing.assert_allclose(features.along(postures, directions) @ w, along, rtol=1e-6, atol=1e-6)


def test_the_hand_moves_by_its_own_policy_whatever_the_posture_is_pulled_to(panda, features, postures):
    w = parameters(features)
    moved = np.einsum("nij,nj->ni", panda.jacobian(postures, HAND)[:, :3], features.evaluate(postures, w))
    # Near a singular posture the damping of the inverse shows.
    np.testing.assert_allclose(moved, features.hand(w)(panda.pose(postures, HAND)[0]), atol=1e-5)


def test_the_policy_behind_contact_is_learnt_from_joints(panda, features, postures):
    truth = features.evaluate(postures, parameters(features))
    normals = np.random.default_rng(3).normal(size=(len(postures), 3))
    J = panda.jacobian(postures, HAND)[:, :3]
    N = uc.constraints.projection(np.einsum("ni,nij->nj", normals, J)[:, None])
    policy = uc.ParametricPolicy(
        HandFeatures(panda, HAND, uc.NormalizedRBF(5)), risk="inconsistency", alpha=1e-12
    )
    policy.fit(postures, np.einsum("nij,nj->ni", N, truth))
    np.testing.assert_allclose(policy.predict(postures), truth, atol=1e-4)


def test_a_joint_that_was_not_recorded_is_said(panda, postures):
    with pytest.raises(uc.errors.PolicyError, match=r"each of the robot's 7 joints, got 6 states.*lock"):
        uc.ParametricPolicy(HandFeatures(panda, HAND, uc.NormalizedRBF(5))).fit(
            postures[:, :6], postures[:, :6]
        )
