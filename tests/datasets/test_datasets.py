"""The recordings that ship: small, made by what is committed, and their policy is the one that is said."""

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.datasets.writing import write


def test_they_are_what_the_committed_simulation_writes(tmp_path):
    for written in write(tmp_path):
        shipped, again = (
            np.loadtxt(p, delimiter=",", skiprows=1) for p in (uc.datasets.path(written.name), written)
        )
        # Another processor may round the last digit otherwise.
        np.testing.assert_allclose(again, shipped, rtol=0, atol=0.011)
        assert np.mean(again == shipped) > 0.99
    assert sorted(p.name for p in tmp_path.iterdir()) == list(uc.datasets.names())


def test_all_together_they_hold_at_most_200_kilobytes():
    assert sum(uc.datasets.path(name).stat().st_size for name in uc.datasets.names()) <= 200_000


def test_the_hand_moves_by_its_policy_where_the_sensor_feels_nothing_and_across_no_board():
    demos = uc.datasets.load_wiping(force_threshold=2.0)
    known = ~np.isnan(demos.projections[:, 0, 0])
    free = known & np.isclose(np.trace(demos.projections, axis1=1, axis2=2), 3)
    bent = known & ~free
    assert 0.3 < free.mean() < 0.7
    missed = uc.metrics.normalized(np.mean(np.sum((demos.actions - demos.policy) ** 2, axis=1)), demos.policy)
    away = np.sum((demos.actions - demos.policy)[free] ** 2, axis=1)
    assert np.median(np.sqrt(away)) < 0.03  # m/s: it wanders, and the tracker is noisy
    assert missed > 0.05
    across = demos.actions[bent] - np.einsum("nij,nj->ni", demos.projections[bent], demos.actions[bent])
    assert np.median(np.linalg.norm(across, axis=1)) < 0.02


def test_the_trolleys_heading_is_an_angle():
    demos = uc.datasets.load_trolley()
    X, U, turned = demos.states, demos.actions, demos.states + np.array([0, 0, 2 * np.pi])
    np.testing.assert_allclose(uc.datasets.trolley_policy(turned), demos.policy, atol=1e-12)
    policy = uc.ParametricPolicy(space=demos.space).fit(X, U, groups=demos.episodes)
    np.testing.assert_allclose(policy.predict(turned), policy.predict(X), atol=1e-9)


def test_a_name_that_is_not_there_is_told_which_are():
    with pytest.raises(uc.errors.DataError, match=r"trolley\.csv, wiping\.csv"):
        uc.datasets.path("sweeping.csv")
    with pytest.raises(uc.errors.DataError, match="states of shape"):
        uc.datasets.wiping_policy(np.zeros((3, 2)))
