"""What a force sensor carries, friction, and sensors that stopped are told from contacts."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import unconstrain as uc
from unconstrain import constraints
from unconstrain.errors import DataError


def lean(rng, zeroed, weight=7.0, noise=0.2):
    """A sensor that leans about, and is pressed onto a tilted table: two episodes."""
    normal = np.array([0.6, 0.0, 0.8])
    forces, rotations, touching = [], [], []
    for _ in range(2):
        angles = np.cumsum(rng.normal(scale=0.03, size=(400, 3)), axis=0)
        R = (Rotation.from_euler("x", np.pi) * Rotation.from_rotvec(0.8 * np.sin(angles))).as_matrix()
        on = (np.arange(400) // 100) % 2 == 1
        f = np.where(on[:, None], 20.0 * normal, 0.0) + noise * rng.normal(size=(400, 3))
        bias = rng.normal(size=3) - zeroed * np.array([0.0, 0.0, weight])
        forces.append(np.einsum("nji,nj->ni", R, f - [0.0, 0.0, weight]) + bias)
        rotations.append(R)
        touching.append(on)
    return *map(np.concatenate, (forces, rotations, touching)), np.repeat([0, 1], 400), normal


@pytest.mark.parametrize("zeroed", [True, False])
def test_weight_and_bias_are_told_from_what_presses(zeroed):
    forces, rotations, touching, episodes, normal = lean(np.random.default_rng(0), zeroed)
    payload = constraints.find_payload(forces, rotations, 10.0, episodes=episodes, margin=5)
    assert payload.weight == pytest.approx(7.0, abs=0.2)
    assert not (payload.free & touching).any()
    f = payload.remove(forces, rotations, episodes=episodes)
    assert f[touching].mean(axis=0) == pytest.approx(20.0 * normal, abs=0.2)
    assert f[~touching].mean(axis=0) == pytest.approx(np.zeros(3), abs=0.2)


def test_friction_is_estimated_and_taken_out():
    rng = np.random.default_rng(1)
    normal = np.array([0.0, 0.6, 0.8])
    V = rng.normal(size=(500, 3)) @ constraints.projection(normal[None])
    unit = V / np.linalg.norm(V, axis=1, keepdims=True)
    F = 10.0 * normal - 3.0 * unit + 0.3 * rng.normal(size=V.shape)
    friction = constraints.find_friction(F, V, 2.0)
    assert friction.coefficient == pytest.approx(0.3, abs=3 * friction.uncertainty)
    assert friction.explained > 0.95
    N = constraints.from_forces(F, 2.0, actions=V, friction=friction.coefficient)
    assert np.degrees(np.arccos(np.abs(np.linalg.svd(np.eye(3) - N)[2][:, 0] @ normal))).mean() < 3.0


def test_a_sensor_that_stopped_tells_nothing_and_is_said(tmp_path):
    rng = np.random.default_rng(2)
    F = np.array([0.0, 0.0, 9.0]) + rng.normal(size=(300, 3))
    F[100:200] = F[100]
    episodes = np.repeat([0, 1, 2], 100)
    F[250:270] = F[250]  # a part of an episode
    stuck = constraints.find_stuck(F, episodes=episodes)
    np.testing.assert_array_equal(np.flatnonzero(stuck), [*range(100, 200), *range(250, 270)])
    assert np.isnan(constraints.from_forces(F, 2.0, episodes=episodes)[stuck]).all()
    X = np.cumsum(rng.normal(size=(300, 3)), axis=0)
    header = "x,y,z,fx,fy,fz,run"
    np.savetxt(
        tmp_path / "a.csv", np.column_stack([X, F, episodes]), delimiter=",", header=header, comments=""
    )
    demos = uc.load(
        tmp_path / "a.csv",
        state=["x", "y", "z"],
        force=["fx", "fy", "fz"],
        force_threshold=2.0,
        rate=50,
        episode="run",
    )
    assert any("the force stays the same in 120 samples of 2 episodes" in note for note in demos.notes)
    # Simulated forces are constant in contact, and zero elsewhere.
    F = np.where(np.arange(100)[:, None] < 50, [[0.0, 0.0, 5.0]], 0.0)
    assert not constraints.find_stuck(F).any()


def test_no_weight_is_read_off_a_sensor_that_stopped():
    with pytest.raises(DataError, match="no episode is free of contact"):
        constraints.find_payload(np.full((100, 3), 20.0), np.broadcast_to(np.eye(3), (100, 3, 3)), 10.0)
