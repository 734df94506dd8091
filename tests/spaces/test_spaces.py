"""Laws that hold in every space: differences lead there, frames can be undone, velocities are what moves."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation as Rotations

from unconstrain.errors import UnconstrainError
from unconstrain.spaces import Angle, Numbers, Phased, Pose, Product, Rotation, SecondOrder, from_description

ROTATIONS = [
    Rotation(written, frame, degrees)
    for written in ("xyzw", "wxyz", "rotvec", "euler", "matrix")
    for frame in ("world", "body")
    for degrees in ((False, True) if written in ("rotvec", "euler") else (False,))
]
POSES = [
    Pose((Numbers(3), rotation), ((0, 1, 2), tuple(range(3, 3 + rotation.n_states))))
    for rotation in ROTATIONS
]
MIXED = Product((Numbers(2), Angle(), Rotation("wxyz")), ((0, 5), (3,), (1, 2, 4, 6)))
SPACES = [
    Numbers(2),
    Angle(),
    Angle(360.0),
    *ROTATIONS,
    *POSES,
    MIXED,
    SecondOrder(MIXED),
    SecondOrder(Pose()),
    Phased(MIXED, 4.0),
    Phased(SecondOrder(Pose()), 2.5),
]

seeds = st.integers(0, 2**32 - 1)


def states(space, rng, count=5):
    """Draw states (count, n)."""
    if isinstance(space, Phased):
        return np.hstack([states(space.of, rng, count), rng.random((count, 1))])
    return space.step(np.tile(space.origin, (count, 1)), rng.normal(size=(count, space.n_actions)), 1.0)


def first_order(space):
    return not isinstance(without_phase(space), SecondOrder)


@pytest.mark.parametrize("space", SPACES, ids=lambda space: space.words)
@given(seed=seeds)
@settings(max_examples=8, deadline=None)
def test_a_difference_leads_from_one_state_to_the_other(space, seed):
    rng = np.random.default_rng(seed)
    X, Y = states(space, rng), states(space, rng)
    if not first_order(space):
        X[:, : base(space).n_states] = Y[:, : base(space).n_states]  # accelerations change velocities
    reached = space.step(X, space.difference(X, Y), 1.0)
    assert np.abs(space.difference(reached, Y)).max() < 1e-9
    assert np.abs(space.difference(X, X)).max() < 1e-12


@pytest.mark.parametrize("space", SPACES, ids=lambda space: space.words)
@given(seed=seeds)
@settings(max_examples=8, deadline=None)
def test_what_is_relative_can_be_undone(space, seed):
    rng = np.random.default_rng(seed)
    X, to = states(space, rng), states(space, rng)
    if not first_order(space):
        to[:, base(space).n_states :] = 0.0
    back = space.absolute(space.relative(X, to), to)
    assert np.abs(base(space).difference(x(space, back), x(space, X))).max() < 1e-9
    itself = space.relative(to, to)
    assert (
        np.abs(base(space).difference(x(space, itself), x(space, np.tile(space.origin, (5, 1))))).max() < 1e-9
    )


@pytest.mark.parametrize(
    "space", [*ROTATIONS, *POSES, MIXED, Phased(MIXED, 4.0)], ids=lambda space: space.words
)
def test_relative_velocities_are_those_of_relative_states(space):
    rng = np.random.default_rng(0)
    X, to, U, moves = (
        states(space, rng), states(space, rng),
        rng.normal(size=(5, space.n_actions)), rng.normal(size=(5, space.n_actions)),
    )  # fmt: skip
    h = 1e-6
    before, after = (space.relative(space.step(X, U, dt), space.step(to, moves, dt)) for dt in (-h, h))
    numeric = space.difference(before, after) / (2 * h)
    assert np.allclose(space.relative_velocity(X, U, to, moves), numeric, atol=1e-6)
    still = space.relative_velocity(X, U, to, np.zeros_like(moves))
    assert np.allclose(space.absolute_velocity(still, to), U, atol=1e-12)


@pytest.mark.parametrize(
    "space", [*ROTATIONS, *POSES, MIXED, Phased(MIXED, 4.0)], ids=lambda space: space.words
)
def test_slopes_of_coordinates_are_velocities(space):
    rng = np.random.default_rng(1)
    X, U = states(space, rng, 1), rng.normal(size=(1, space.n_actions))
    t = np.linspace(-0.01, 0.01, 5)[:, None]
    path = space.follow(space.step(np.repeat(X, 5, axis=0), np.repeat(U, 5, axis=0), t))
    C = space.coordinates(path)
    slopes = np.gradient(C, t[:, 0], axis=0)
    assert np.allclose(space.velocity(C, slopes)[2], U[0], atol=1e-3)


@pytest.mark.parametrize("space", [*ROTATIONS, *POSES, MIXED], ids=lambda space: space.words)
def test_places_are_as_far_apart_as_states_that_are_near(space):
    rng = np.random.default_rng(2)
    X = states(space, rng, 20)
    U = 1e-4 * rng.normal(size=(20, space.n_actions))
    bases = space.find_base(X), None
    for base_ in bases:
        moved = space.embed(space.step(X, U, 1.0), base_) - space.embed(X, base_)
        ratio = np.linalg.norm(moved, axis=1) / np.linalg.norm(U, axis=1)
        assert np.all((ratio > 0.3) & (ratio < 3.0))


@given(seed=seeds)
@settings(max_examples=30, deadline=None)
def test_both_signs_of_a_quaternion_are_one_place(seed):
    rng = np.random.default_rng(seed)
    space = Rotation()
    X = states(space, rng)
    for zero in (space.find_base(X), None):
        assert np.abs(space.embed(X, zero) - space.embed(-X, zero)).max() < 1e-12
    assert np.abs(space.difference(X, -X)).max() < 1e-7
    signs = np.where(rng.random(5) < 0.5, -1.0, 1.0)[:, None]
    followed = space.follow(signs * X)
    assert np.all(np.sum(followed[1:] * followed[:-1], axis=1) >= 0)


@given(seed=seeds, arc=st.floats(0.0, 0.8))
@settings(max_examples=30, deadline=None)
def test_angles_in_an_arc_lie_on_a_line_however_many_turns_are_counted(seed, arc):
    rng = np.random.default_rng(seed)
    space = Angle()
    true = rng.uniform(-np.pi, np.pi) + 2 * np.pi * arc * rng.random((20, 1))
    counted = true + 2 * np.pi * rng.integers(-3, 4, (20, 1))
    zero = space.find_base(counted)
    assert zero is not None
    laid = space.embed(counted, zero)
    assert np.allclose(laid - laid[0], true - true[0], atol=1e-9)


def test_angles_all_the_way_round_lie_on_a_circle_of_a_turns_length():
    around = np.linspace(0, 360, 100)[:, None]
    space = Angle(360.0)
    assert space.find_base(around) is None
    places = space.embed(around, None)
    assert np.sum(np.linalg.norm(np.diff(places, axis=0), axis=1)) == pytest.approx(360, rel=1e-3)


def test_rotations_all_the_way_round_have_no_base():
    around = Rotations.from_rotvec(np.linspace(0, 2 * np.pi, 50)[:, None] * [0, 0, 1]).as_quat()
    assert Rotation().find_base(around) is None


@pytest.mark.parametrize("space", SPACES, ids=lambda space: space.words)
def test_a_space_is_made_again_of_its_description(space):
    assert from_description(space.describe()) == space
    assert len(space.action_names([f"n{i}" for i in range(space.n_states)])) == space.n_actions
    assert len(space.units) == space.n_actions
    assert not space.faults(states(space, np.random.default_rng(0))).any()


@pytest.mark.parametrize(
    "about", [{}, {"rotation": "xyz", "frame": "world", "degrees": False}, {"numbers": "many"}, 3]
)
def test_what_describes_no_space_is_refused(about):
    with pytest.raises(UnconstrainError):
        from_description(about)


def test_rows_that_are_no_rotation_are_found():
    assert Rotation().faults(np.array([[0, 0, 0, 1.0], [0, 0, 0, 0.5], [0, 0, 0, 0]])).tolist() == [
        False,
        True,
        True,
    ]
    mirror = np.diag([1.0, 1.0, -1.0]).reshape(1, 9)
    assert Rotation("matrix").faults(mirror).all()


@given(seed=seeds, dt=st.floats(0.0, 10.0), share=st.floats(0.0, 1.0))
@settings(max_examples=30, deadline=None)
def test_a_phase_goes_by_the_clock_is_held_at_the_end_and_has_no_frame(seed, dt, share):
    rng = np.random.default_rng(seed)
    space = Phased(MIXED, 4.0)
    X, to, U = states(space, rng), states(space, rng), rng.normal(size=(5, space.n_actions))
    moved = space.step(X, U, dt)
    assert np.allclose(moved[:, -1], np.minimum(X[:, -1] + dt / 4.0, 1.0), atol=1e-12)
    assert np.array_equal(moved[:, :-1], MIXED.step(X[:, :-1], U, dt))
    assert np.array_equal(space.step(space.step(X, U, 4.0), U, dt)[:, -1], np.ones(5))
    between = space.between(X, moved, np.full(5, share))
    assert np.allclose(between[:, -1], (1 - share) * X[:, -1] + share * moved[:, -1], atol=1e-12)
    for same in (space.relative(X, to), space.absolute(X, to), space.follow(X)):
        assert np.array_equal(same[:, -1], X[:, -1])
    late = X + np.append(np.zeros(space.n_states - 1), 1.0)
    assert space.faults(late).all()
    for zero in (space.find_base(X), None):
        assert np.array_equal(space.embed(late, zero)[:, -1], np.ones(5))
        assert np.array_equal(
            space.embed(X, zero)[:, :-1], MIXED.embed(X[:, :-1], None if zero is None else zero[:-1])
        )


def test_what_is_at_rest_begins_its_phase():
    space = Phased(SecondOrder(Numbers(2)), 3.0)
    assert space.at_rest(np.array([1.0, 2.0])).tolist() == [1.0, 2.0, 0.0, 0.0, 0.0]
    assert space.state_names(["x", "y", "x_dot", "y_dot"])[-1] == "phase"
    with pytest.raises(ValueError, match="duration must be a positive number"):
        Phased(Numbers(1), 0.0)


def without_phase(space):
    return space.of if isinstance(space, Phased) else space


def base(space):
    moving = without_phase(space)
    return moving.of if isinstance(moving, SecondOrder) else moving


def x(space, X):
    return X[:, : base(space).n_states]
