"""Projections from normals, Jacobians, flags and recordings."""

import numpy as np
import pytest

import unconstrain as uc
from reproduction.plants import arm
from tests.constraints.test_forces import slide
from unconstrain import constraints


def test_normals_alone_and_through_a_jacobian():
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(5, 3))
    normals[1], normals[2] = 0.0, np.nan
    N = constraints.from_normals(normals)
    np.testing.assert_allclose(N[0] @ normals[0], 0.0, atol=1e-12)
    np.testing.assert_array_equal(N[1], np.eye(3))
    assert np.isnan(N[2]).all()
    J = rng.normal(size=(5, 3, 7))
    through = constraints.from_normals(normals, J)
    np.testing.assert_allclose(normals[0] @ J[0] @ through[0], 0.0, atol=1e-12)
    assert np.trace(through[3]) == pytest.approx(6)
    two = constraints.from_normals(rng.normal(size=(5, 2, 3)))
    np.testing.assert_allclose(np.trace(two, axis1=1, axis2=2), 1.0)


def test_jacobian_rows_flags_and_the_first_known():
    Q = arm.draw_starts(6, random_state=0)
    J = arm.jacobian(Q)
    expected = arm.demonstrate("1-3-5", n_episodes=6, length=1, random_state=0).projections
    np.testing.assert_allclose(constraints.from_jacobian(J, [0, 2, 4]), expected, atol=1e-12)
    flags = constraints.from_flags([1, 0, True], 2)
    np.testing.assert_array_equal(flags[[0, 2]], [np.eye(2)] * 2)
    assert np.isnan(flags[1]).all()
    filled = constraints.first_known(flags, np.full((3, 2, 2), np.nan), np.zeros((3, 2, 2)))
    np.testing.assert_array_equal(filled, [np.eye(2), np.zeros((2, 2)), np.eye(2)])


def test_forces_and_flags_are_loaded_saved_and_used(tmp_path):
    U, forces, _, on = slide(noise=0.2)
    X = np.cumsum(U, axis=0)
    free = (~on).astype(float)
    path = tmp_path / "slide.csv"
    names = ["x", "y", "z", "u", "v", "w", "fx", "fy", "fz", "free"]
    np.savetxt(
        path, np.column_stack([X, U, forces, free]), delimiter=",", header=",".join(names), comments=""
    )
    demos = uc.load(
        path, state=["x", "y", "z"], action=["u", "v", "w"], force=["fx", "fy", "fz"], free="free"
    )
    np.testing.assert_allclose(demos.forces, forces)
    for suffix in (".npz", ".parquet"):
        demos.save(tmp_path / f"saved{suffix}")
        back = uc.load(tmp_path / f"saved{suffix}")
        np.testing.assert_array_equal(back.forces, demos.forces)
        np.testing.assert_array_equal(back.free, demos.free)
    both = uc.Demonstrations.concatenate([demos, demos.select(slice(100))])
    assert len(both.forces) == len(both.free) == 500
    assert "forces, free" in repr(both)

    N = constraints.from_recording(demos, force_threshold=2.0)
    np.testing.assert_array_equal(N[~on], np.broadcast_to(np.eye(3), N[~on].shape))
    np.testing.assert_allclose(np.trace(N[on], axis1=1, axis2=2), 2.0)
    flagged = uc.Demonstrations(X, U, free=free)
    assert np.isnan(constraints.from_recording(flagged)[on]).all()


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: constraints.from_normals(np.ones(3)), "normals must be"),
        (lambda: constraints.from_normals(np.ones((3, 2)), np.ones((3, 3, 7))), r"must be \(3, 2, actions\)"),
        (lambda: constraints.from_jacobian(np.ones((3, 6, 7)), [6]), "there is no row 6"),
        (lambda: constraints.from_flags([0, np.nan], 2), "row 1 is NaN"),
        (lambda: constraints.first_known(), "no projections to choose from"),
        (
            lambda: constraints.from_forces(np.ones((3, 2)), 0),
            "threshold, in the unit of the forces, must be a",
        ),
        (
            lambda: constraints.from_forces(np.ones((3, 2)), 10**400),
            "threshold, in the unit of the forces, must be a",
        ),
        (
            lambda: constraints.from_forces(np.ones((3, 2)), 1, release=2),
            "release must be above zero and at most",
        ),
        (lambda: constraints.from_forces(np.ones((3, 2)), 1, window=4), "odd number of samples"),
        (lambda: constraints.from_forces([[np.nan, 1.0]], 1), "NaN or infinity in row 0"),
        (
            lambda: constraints.from_forces(np.ones((3, 2)), 1, actions=np.ones((4, 2))),
            "3 forces and 4 actions",
        ),
        (
            lambda: constraints.from_forces(np.ones((3, 6)), 1, actions=np.ones((3, 2))),
            "6 components and actions",
        ),
        (
            lambda: constraints.from_recording(uc.Demonstrations(np.ones((3, 2)), np.ones((3, 2)))),
            "neither forces nor flags",
        ),
        (
            lambda: constraints.from_recording(
                uc.Demonstrations(np.ones((3, 2)), np.ones((3, 2)), forces=np.ones((3, 3))), force_threshold=1
            ),
            "forces have 3 components and actions 2 dimensions",
        ),
        (
            lambda: uc.Demonstrations(np.ones((3, 2)), np.ones((3, 2)), forces=np.ones((2, 3))),
            "2 forces and 3 states",
        ),
        (lambda: uc.Demonstrations(np.ones((2, 1)), np.ones((2, 1)), free=[0, 2]), "free must be 1"),
        (
            lambda: uc.ParametricPolicy().fit(np.eye(3), np.eye(3), projections=np.full((3, 2, 2), np.nan)),
            "projections must have shape",
        ),
        (
            lambda: uc.ParametricPolicy().fit(
                np.eye(3), np.eye(3), projections=np.where(np.eye(3, dtype=bool), np.nan, np.ones((3, 3, 3)))
            ),
            "projections contains NaN in row 0",
        ),
    ],
)
def test_mistakes_are_told_in_one_sentence(call, sentence):
    with pytest.raises(uc.errors.DataError, match=sentence) as caught:
        call()
    assert "\n" not in str(caught.value)
