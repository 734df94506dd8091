"""Policies over rotations, poses and angles, and with a metric of their actions."""

import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Rotations

import unconstrain as uc
from unconstrain.constraints.nullspace import in_metric, projection
from unconstrain.errors import DataError, PolicyError
from unconstrain.spaces import Angle, Numbers, Phased, Pose, Product, Rotation, SecondOrder

POLICIES = [
    lambda **options: uc.ParametricPolicy(uc.NormalizedRBF(20), **options),
    lambda **options: uc.LocallyLinearPolicy(n_centers=8, **options),
]


def reaches(space: Pose, count: int = 6, steps: int = 40, dt: float = 0.08):
    """Let poses go to the origin: states (N, n), actions (N, 6) and episodes (N,)."""
    rng = np.random.default_rng(0)
    X = np.tile(space.origin, (count, 1))
    X = space.step(X, np.hstack([0.3 * rng.normal(size=(count, 3)), 0.8 * rng.normal(size=(count, 3))]), 1.0)
    states, actions = [], []
    for _ in range(steps):
        U = space.difference(X, np.tile(space.origin, (count, 1))) * [1.5, 1.5, 1.5, 1, 1, 1]
        states.append(X)
        actions.append(U)
        X = space.step(X, U, dt)
    groups = np.repeat(np.arange(count), steps)
    return (
        np.swapaxes(states, 0, 1).reshape(-1, space.n_states),
        np.swapaxes(actions, 0, 1).reshape(-1, 6),
        groups,
    )


@pytest.mark.parametrize("make", POLICIES)
def test_both_signs_of_a_quaternion_give_the_same_policy(make):
    X, U, groups = reaches(Pose())
    flipped = X.copy()
    flipped[:, 3:] *= np.where(np.random.default_rng(1).random(len(X)) < 0.5, -1, 1)[:, None]
    one = make(space=Pose()).fit(X, U, groups=groups)
    other = make(space=Pose()).fit(flipped, U, groups=groups)
    assert np.abs(one.predict(X) - other.predict(X)).max() < 1e-9
    assert np.abs(one.predict(X) - one.predict(flipped)).max() < 1e-9


@pytest.mark.parametrize("written", ["wxyz", "rotvec", "matrix", "euler"])
def test_it_does_not_matter_how_rotations_are_written(written):
    X, U, groups = reaches(Pose())
    rotation = Rotation(written)
    pose = Pose((Numbers(3), rotation), ((0, 1, 2), tuple(range(3, 3 + rotation.n_states))))
    other = np.hstack([X[:, :3], rotation.write(Rotations.from_quat(X[:, 3:]))])
    a = uc.LocallyLinearPolicy(n_centers=8, space=Pose()).fit(X, U, groups=groups)
    b = uc.LocallyLinearPolicy(n_centers=8, space=pose).fit(other, U, groups=groups)
    assert np.abs(a.predict(X) - b.predict(other)).max() < 1e-6


@pytest.mark.parametrize("make", POLICIES)
def test_a_rollout_stays_on_the_manifold_and_arrives(make, tmp_path):
    X, U, groups = reaches(Pose())
    policy = make().fit(uc.Demonstrations(X, U, groups, space=Pose()))
    movement = policy.rollout(X[0], steps=400, dt=0.02)
    assert np.abs(np.linalg.norm(movement.states[:, 3:], axis=1) - 1).max() < 1e-12
    assert np.linalg.norm(Pose().difference(movement.states[-1:], Pose().origin[None])) < 0.05
    assert np.all(np.sum(movement.states[1:, 3:] * movement.states[:-1, 3:], axis=1) > 0)
    policy.save(tmp_path / "policy.skops")
    again = uc.load_policy(tmp_path / "policy.skops")
    assert again.space_ == Pose()
    assert np.array_equal(again.predict(X), policy.predict(X))
    movement.save(tmp_path / "movement.npz")
    assert uc.load(tmp_path / "movement.npz").space == Pose()


@pytest.mark.parametrize("make", POLICIES)
def test_compiled_policies_know_their_space(make, tmp_path):
    X, U, groups = reaches(Pose())
    policy = make(space=Pose()).fit(X, U, groups=groups)
    step = policy.compile()
    assert np.abs(step(X) - policy.predict(X)).max() < 1e-12
    out = np.empty(6)
    assert step(X[0], out) is out
    step.save(tmp_path / "step.npz")
    for again in (uc.load_compiled(tmp_path / "step.npz"), pickle.loads(pickle.dumps(step))):
        assert np.array_equal(again(X), step(X))


def test_an_angle_is_the_same_after_a_turn():
    rng = np.random.default_rng(0)
    angle, x = rng.uniform(-np.pi, np.pi, 400), rng.normal(size=400)
    space = Product.of(Angle(), Numbers(1))
    U = np.column_stack([-np.sin(angle), -x])
    policy = uc.ParametricPolicy(uc.NormalizedRBF(40), space=space, risk="direct")
    policy.fit(np.column_stack([angle, x]), U)
    at = np.column_stack([angle, x])
    turned = at + np.array([2 * np.pi, 0.0])
    assert np.abs(policy.predict(at) - policy.predict(turned)).max() < 1e-9
    assert np.sqrt(np.mean((policy.predict(at) - U) ** 2)) < 0.1


def test_states_with_velocities_are_followed_by_accelerations():
    space = SecondOrder(Numbers(1))
    X = np.random.default_rng(0).normal(size=(200, 2))
    policy = uc.ParametricPolicy(space=space, risk="direct", alpha=1e-12).fit(X, -X[:, :1] - 0.0 * X[:, 1:])
    movement = policy.rollout([1.0, 0.0], steps=1000, dt=2 * np.pi / 1000)
    assert movement.states[500] == pytest.approx([-1.0, 0.0], abs=0.02)


@pytest.mark.parametrize("make", POLICIES)
def test_a_phase_is_followed_to_the_end_and_held_there(make, tmp_path):
    space = Phased(Numbers(1), 2.0)
    s = np.tile(np.linspace(0, 1, 60), 5)
    start = np.repeat(np.random.default_rng(0).normal(size=5), 60)
    X = np.column_stack([start + 4 * s * (1 - s), s])
    U = (2 - 4 * s)[:, None]
    policy = make(space=space, risk="direct", alpha=1e-6).fit(X, U, groups=np.repeat(np.arange(5), 60))
    movement = policy.rollout(space.at_rest(np.zeros(1)), steps=120, dt=0.02)
    assert movement.space == space
    assert np.allclose(movement.states[:, 1], np.minimum(movement.time / 2.0, 1.0))
    there = movement.states[:101, 1]
    assert np.abs(movement.states[:101, 0] - 4 * there * (1 - there)).max() < 0.1
    policy.save(tmp_path / "policy.skops")
    assert uc.load_policy(tmp_path / "policy.skops").space_ == space
    step = policy.compile()
    step.save(tmp_path / "step.npz")
    step = uc.load_compiled(tmp_path / "step.npz")
    assert np.abs(step(X) - policy.predict(X)).max() < 1e-12
    late = np.array([0.3, 1.7])  # the clock of a controller goes on
    assert np.allclose(step(late), policy.predict([[0.3, 1.0]])[0], atol=1e-12)
    with pytest.raises(PolicyError, match=r"compile\(\).save"):
        policy.to_onnx(tmp_path / "policy.onnx")
    stable = policy.stabilized([0.0, 1.0], X)
    assert np.abs(stable.compile()(X) - stable.predict(X)).max() < 1e-9
    with pytest.raises(DataError, match="sample 0 are none of these: 1 number, and a phase from 0 to 1"):
        make(space=space).fit(X + np.array([0.0, 1.5]), U)


def test_states_that_are_no_rotation_are_refused_in_a_sentence():
    X, U, groups = reaches(Pose())
    X[7, 3:] = [0, 0, 0, 0.5]
    with pytest.raises(DataError, match="sample 7 are none of these: poses"):
        uc.ParametricPolicy(space=Pose()).fit(X, U, groups=groups)
    X, U, groups = reaches(Pose())
    policy = uc.ParametricPolicy(space=Pose()).fit(X, U, groups=groups)
    with pytest.raises(DataError, match="no rotation"):
        policy.predict(np.zeros((1, 7)))
    with pytest.raises(PolicyError, match="states have 6 numbers"):
        uc.ParametricPolicy(space=Pose()).fit(X[:, :6], U, groups=groups)


def bent(seed: int = 0):
    """Movements of a policy whose second action is a hundred times the first, bent by random constraints."""
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(600, 2))
    Pi = np.column_stack([-X[:, 0], -100 * X[:, 1]])
    A = rng.normal(size=(600, 1, 2)) / [[[1.0, 100.0]]]
    N = uc.constraints.projection(A * [[[1.0, 100.0]]])
    U = (np.einsum("nij,nj->ni", N, Pi / [1, 100]) + 0.01 * rng.normal(size=X.shape)) * [1, 100]
    return X, U, Pi, A


@pytest.mark.parametrize("risk", ["adaptive", "inconsistency", "corrected", "direct"])
def test_a_scale_is_another_unit_of_the_actions(risk):
    X, U, Pi, _ = bent()
    scale = np.array([1.0, 100.0])
    scaled = uc.ParametricPolicy(risk=risk, scale=scale).fit(X, U)
    plain = uc.ParametricPolicy(risk=risk).fit(X, U / scale)
    assert np.allclose(scaled.predict(X), plain.predict(X) * scale, atol=1e-8)
    _, deviation = scaled.predict(X, return_std=True)
    assert np.allclose(deviation, plain.predict(X, return_std=True)[1] * scale)
    if risk != "direct":
        assert uc.metrics.normalized(uc.metrics.unconstrained_policy_error(Pi, scaled.predict(X)), Pi) < 2e-3


def test_constraints_are_taken_in_the_metric_of_the_scale():
    X, U, _, A = bent()
    scale = np.array([1.0, 100.0])
    policy = uc.ParametricPolicy(scale=scale).fit(X, U)
    movement = policy.rollout(X[0], 1, 0.01, constraint=A[0])
    assert np.allclose(movement.actions[0], U[0], rtol=0.05, atol=5.0)
    assert abs(A[0, 0] @ movement.actions[0]) < 1e-9


def test_projections_in_a_metric_are_those_of_the_constraint_there():
    rng = np.random.default_rng(3)
    A, scale = rng.normal(size=(10, 2, 4)), rng.uniform(0.1, 10, 4)
    N = projection(A)
    N[3] = np.nan
    expected = projection(A * scale)
    expected[3] = np.nan
    assert np.allclose(in_metric(N, scale), expected, equal_nan=True)


def test_a_scale_is_found_where_metres_stand_beside_radians():
    X, U, groups = reaches(Pose())
    policy = uc.ParametricPolicy(space=Pose()).fit(X, U, groups=groups)
    assert policy.scale_[:3] == pytest.approx(1.0)
    assert np.ptp(policy.scale_[3:]) == 0
    assert policy.scale_[3] > 1.5
    assert uc.ParametricPolicy().fit(X[:, :3], U[:, :3], groups=groups).scale_ == pytest.approx(1.0)
    alone = uc.ParametricPolicy(scale="auto").fit(X[:, :3] * [1, 10, 100], U[:, :3] * [1, 10, 100])
    assert alone.scale_ == pytest.approx([1, 10, 100], rel=0.7)


@pytest.mark.parametrize("scale", [[1.0], [1.0, -1.0], "wide", [1.0, np.nan]])
def test_a_scale_that_is_none_is_refused(scale):
    X, U, _, _ = bent()
    with pytest.raises(PolicyError, match="scale must be"):
        uc.ParametricPolicy(scale=scale).fit(X, U)
