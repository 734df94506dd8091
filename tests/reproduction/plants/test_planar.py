"""Planar arms move as their Jacobian says."""

import numpy as np

from reproduction.plants.planar import PlanarArm


def test_planar_arms_move_as_their_jacobian_says():
    rng = np.random.default_rng(8)
    plant, Q, dQ = PlanarArm((1.0, 0.7, 0.4)), rng.uniform(-2, 2, (20, 3)), 1e-6 * rng.normal(size=(20, 3))
    moved = plant.pose(Q + dQ) - plant.pose(Q - dQ)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", plant.jacobian(Q), 2 * dQ), moved, atol=1e-14)
