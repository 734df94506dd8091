"""Policies that end at a goal."""

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.base import clone

import unconstrain as uc
from tests.policies.test_spaces import reaches
from unconstrain.constraints.nullspace import projection
from unconstrain.errors import DataError, PolicyError
from unconstrain.simulation import rollout
from unconstrain.spaces import Numbers, Pose, SecondOrder

RNG = np.random.default_rng(0)
GOAL = np.array([0.2, -0.1])


def spiral(count: int = 400) -> tuple[np.ndarray, np.ndarray]:
    """Make states, and actions that turn about a place beside the goal and hardly approach it."""
    X = RNG.uniform(-1, 1, size=(count, 2))
    return X, -0.2 * X + 1.5 * np.stack([X[:, 1], -X[:, 0]], axis=1) + 0.1


X, U = spiral()
PLAIN = {
    "local": uc.LocallyLinearPolicy(n_centers=15, risk="direct").fit(X, U),
    "rbf": uc.ParametricPolicy(uc.NormalizedRBF(25), risk="direct").fit(X, U),
    "scaled": uc.LocallyLinearPolicy(n_centers=15, risk="direct", scale=[1.0, 0.2]).fit(X, U),
}
STABLE = {name: policy.stabilized(GOAL, X) for name, policy in PLAIN.items()}
each = pytest.mark.parametrize("name", PLAIN)


@pytest.fixture(scope="module")
def poses():
    """A policy over poses that aims beside the goal, stabilised; and poses from anywhere."""
    from scipy.spatial.transform import Rotation as Rotations

    states, actions, groups = reaches(Pose())
    policy = uc.LocallyLinearPolicy(n_centers=8, space=Pose(), risk="direct")
    policy.fit(states, actions + RNG.normal(scale=0.3, size=6), groups=groups)
    away = np.hstack([RNG.normal(size=(60, 3)), Rotations.random(60, random_state=1).as_quat()])
    return policy, policy.stabilized(Pose().origin, states), away


@each
@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1))
def test_V_falls_along_every_action_and_over_every_step_that_is_held(name, seed):
    stable, rng = STABLE[name], np.random.default_rng(seed)
    states = GOAL + rng.normal(size=(100, 2)) * 10.0 ** rng.uniform(-4, 2, size=(100, 1))
    actions, stability = stable.predict(states), stable.stability_
    slope = np.sum(
        stability.lyapunov.gradient((states - GOAL) / stable.scale_) * actions / stable.scale_, axis=1
    )
    assert np.all(slope < 0)
    before = stability.value(states)
    for dt in (0.1 * stability.hold, stability.hold):
        assert np.all(stability.value(states + dt * actions) < before)


@each
def test_the_change_is_none_where_the_policy_falls_already_and_else_along_the_gradient(name):
    plain, stable = PLAIN[name], STABLE[name].stabilized(GOAL, X, hold=1e-9)
    stability, scale = stable.stability_, stable.scale_
    states = RNG.uniform(-1, 1, size=(2000, 2))
    states = states[np.linalg.norm((states - GOAL) / scale, axis=1) > stability.radius]
    E, own = (states - GOAL) / scale, plain.predict(states)
    g = stability.lyapunov.gradient(E)
    least = stability.rate(np.linalg.norm(E, axis=1)) * np.sum(g * E, axis=1)
    slope, changed = np.sum(g * own / scale, axis=1), stable.predict(states) - own
    falls = slope <= -least
    assert 0.1 < falls.mean() < 0.9
    assert not changed[falls].any()
    smallest = -((slope + least) / np.sum(g**2, axis=1))[:, None] * g * scale
    assert np.allclose(changed[~falls], smallest[~falls], atol=1e-9)


@each
def test_the_goal_is_an_equilibrium_that_every_rollout_reaches(name):
    stable = STABLE[name]
    assert not stable.predict(GOAL[None]).any()
    starts = np.stack(np.meshgrid(*[np.linspace(-1.2, 1.2, 7)] * 2), axis=-1).reshape(-1, 2)
    for dt in (0.005, 0.02, 0.1):
        movement = rollout(stable, starts, int(40 / dt), dt)
        values = stable.stability_.value(movement.states).reshape(len(starts), -1)
        assert np.all(np.diff(values, axis=1) <= 0)
        ends = movement.states.reshape(len(starts), -1, 2)[:, -1]
        assert np.linalg.norm(ends - GOAL, axis=1).max() < 0.01
    before = (
        PLAIN[name]
        .rollout(starts, steps=2000, dt=0.02, beyond=np.inf)
        .states.reshape(len(starts), -1, 2)[:, -1]
    )
    assert np.linalg.norm(before - GOAL, axis=1).min() > 0.01


@each
def test_compiled_it_is_the_same_and_so_it_is_after_saving(name, tmp_path):
    stable = STABLE[name]
    states = GOAL + RNG.normal(size=(500, 2)) * 10.0 ** RNG.uniform(-5, 2, size=(500, 1))
    expected = stable.predict(states)
    step = stable.compile()
    step.save(tmp_path / "step.npz")
    loaded = uc.load_compiled(tmp_path / "step.npz")
    out = np.empty(2)
    for each_step in (step, loaded, pickle.loads(pickle.dumps(step))):
        tolerance = 1e-12 * max(step.magnitude(states), np.abs(expected).max())
        assert np.abs(each_step(states) - expected).max() <= tolerance
        assert max(np.abs(each_step(x) - u).max() for x, u in zip(states, expected, strict=True)) <= tolerance
        assert each_step(states[0], out=out) is out
        assert np.array_equal(out, each_step(states[0]))
        assert not each_step(GOAL).any()
        assert np.isnan(each_step(np.array([np.nan, 0.0]))).any()
        assert np.isfinite(each_step(np.array([1e100, -1e90]))).all()
    stable.save(tmp_path / "policy.skops")
    again = uc.load_policy(tmp_path / "policy.skops")
    assert np.array_equal(again.predict(states), expected)
    assert again.stability_.notes == stable.stability_.notes
    with pytest.raises(PolicyError, match="this one is stabilised"):
        stable.to_onnx(tmp_path / "policy.onnx")


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), rows=st.integers(1, 3))
def test_under_a_constraint_the_motion_obeys_it_and_V_falls_as_far_as_it_can(seed, rows):
    rng = np.random.default_rng(seed)
    states = rng.uniform(-1, 1, size=(300, 4))
    turn = rng.normal(size=(4, 4))
    actions = states @ (turn - turn.T) - 0.1 * states + 0.2
    scale = 10.0 ** rng.uniform(-1, 1, size=4)
    stable = (
        uc.ParametricPolicy(risk="direct", scale=scale).fit(states, actions).stabilized(np.zeros(4), states)
    )
    A = rng.normal(size=(rows, 4))
    movement = stable.rollout(states[:5], steps=150, dt=0.02, constraint=A)
    assert (
        np.abs(movement.actions @ A.T).max()
        < 1e-10 * np.abs(movement.actions).max() * np.abs(A).max() * scale.max() / scale.min()
    )
    values = stable.stability_.value(movement.states).reshape(5, -1)
    assert np.all(np.diff(values, axis=1) <= 1e-12 * values[:, :1])
    assert np.all(values[:, -1] < values[:, 0])


def test_where_a_constraint_lets_nothing_fall_the_movement_stops_and_says_so():
    stable = STABLE["local"]
    movement = stable.rollout([0.8, 0.6], steps=2000, dt=0.02, constraint=[[1.0, 0.0]])
    last, N = movement.states[-1:], projection([[1.0, 0.0]])[None]
    assert np.allclose(movement.states[:, 0], 0.8)
    assert np.abs(movement.actions[-1]).max() < 0.01
    assert stable.stability_.freedom(last, N)[0] < 0.05
    assert stable.stability_.freedom(np.array([[0.8, 0.6]]), N)[0] > 0.1
    held = stable.predict_constrained([[0.8, 0.6]], np.zeros((1, 2, 2)))
    assert not held.any()


def test_without_a_goal_a_constraint_leaves_what_it_did():
    N = np.tile(projection([[1.0, 0.3]]), (len(X), 1, 1))
    own = PLAIN["local"].predict(X)
    assert np.allclose(PLAIN["local"].predict_constrained(X, N), np.einsum("nij,nj->ni", N, own))


def test_poses_arrive_and_are_compiled(poses, tmp_path):
    plain, stable, away = poses
    stability, dt = stable.stability_, 0.02
    assert not np.all(stable.scale_ == 1.0)
    actions = stable.predict(away)
    assert np.all(stability.value(Pose().step(away, actions, dt)) < stability.value(away))
    movement = stable.rollout(away, steps=1000, dt=dt)
    ends = movement.states.reshape(len(away), -1, 7)[:, -1]
    assert stability.distance(ends).max() < 0.01
    assert np.linalg.norm(plain.predict(Pose().origin[None])) > 0.01
    assert not stable.predict(Pose().origin[None]).any()
    assert not stable.predict(-Pose().origin[None]).any()  # the same rotation
    step = stable.compile()
    step.save(tmp_path / "step.npz")
    for each_step in (step, uc.load_compiled(tmp_path / "step.npz")):
        assert np.abs(each_step(away) - actions).max() < 1e-12
        assert np.abs(each_step(away[0]) - actions[0]).max() < 1e-12


def test_the_end_is_the_mean_of_the_last_states(poses):
    plain, *_ = poses
    states, actions, groups = reaches(Pose())
    demos = uc.Demonstrations(states, actions, groups, space=Pose())
    goal = plain.stabilized("end", demos).stability_.goal
    assert np.linalg.norm(Pose().difference(goal[None], Pose().origin[None])) < 0.1
    flat = uc.Demonstrations(X, U, np.repeat([0, 1], 200), time=np.tile(np.arange(200) * 0.01, 2))
    stability = PLAIN["local"].stabilized("end", flat).stability_
    assert np.allclose(stability.goal, (X[199] + X[399]) / 2)
    assert stability.hold == pytest.approx(0.01)
    assert "the mean of where the 2 episodes end" in stability.notes[0]
    apart = np.linalg.norm(X[199] - X[399]) / 2
    assert f"ends {apart:.3g} from it" in stability.notes[0]


def test_without_demonstrations_the_centres_say_where_the_policy_was_learnt(poses):
    for name in ("local", "rbf"):
        stable = PLAIN[name].stabilized(GOAL)
        end = stable.rollout([-0.9, 0.9], steps=2000, dt=0.02).states[-1]
        assert np.linalg.norm(end - GOAL) < 0.01
    plain, _, away = poses
    states = (
        plain.stabilized(Pose().origin).rollout(away[:5], steps=1000, dt=0.02).states.reshape(5, -1, 7)[:, -1]
    )
    assert np.abs(Pose().difference(np.tile(Pose().origin, (5, 1)), states)).max() < 0.01
    linear = uc.ParametricPolicy(risk="direct").fit(X, U)
    with pytest.raises(PolicyError, match="give the demonstrations"):
        linear.stabilized(GOAL)


def test_what_stays_and_what_is_forgotten():
    stable = STABLE["local"]
    assert PLAIN["local"].stability_ is None
    assert stable.n_features_in_ == 2
    assert stable.space_ == Numbers(2)
    assert clone(stable).stability_ is None
    more = PLAIN["rbf"].stabilized(GOAL).partial_fit(*spiral(50))
    assert not more.predict(GOAL[None]).any()
    assert PLAIN["rbf"].stabilized(GOAL).fit(X, U).stability_ is None
    moved = stable.stabilized([0.5, 0.5], X)
    assert not moved.predict([[0.5, 0.5]]).any()
    assert np.isfinite(stable.score(X, U))


def test_mistakes():
    policy = PLAIN["local"]
    with pytest.raises(DataError, match="must have 2 numbers, as the policy has states, got 3"):
        policy.stabilized([0, 0, 0], X)
    with pytest.raises(DataError, match="NaN or infinity"):
        policy.stabilized([0, np.nan], X)
    with pytest.raises(DataError, match='a goal is a state, "end"'):
        policy.stabilized("home", X)
    with pytest.raises(DataError, match="give these too, or a state"):
        policy.stabilized("end")
    with pytest.raises(DataError, match="give these too, or a state"):
        policy.stabilized("end", X)
    with pytest.raises(PolicyError, match="hold must be a finite number above zero"):
        policy.stabilized(GOAL, X, hold=0)
    with pytest.raises(PolicyError, match="hold must be at most"):
        policy.stabilized(GOAL, X, hold=1e300)
    with pytest.raises(DataError, match="no distance to compute with"):
        policy.stabilized([1e200, 0], X)
    with pytest.raises(DataError, match="all states are at the goal"):
        policy.stabilized(GOAL, GOAL[None])
    second = SecondOrder(Numbers(1))
    with pytest.raises(PolicyError, match="whose actions are accelerations cannot be stabilised"):
        uc.ParametricPolicy(space=second, risk="direct").fit(X, U[:, :1]).stabilized([0, 0], X)
    with pytest.raises(PolicyError, match="only a policy whose actions are velocities"):
        uc.ParametricPolicy(risk="direct").fit(X, U[:, :1]).stabilized(GOAL, X)


def test_units_and_origin_do_not_matter():
    away = GOAL + RNG.normal(size=(100, 2))
    unit, origin = 1024.0, np.array([512.0, -4096.0])
    other = uc.LocallyLinearPolicy(n_centers=15, risk="direct").fit(X * unit + origin, U * unit)
    moved = other.stabilized(GOAL * unit + origin, X * unit + origin).predict(away * unit + origin) / unit
    expected = STABLE["local"].predict(away)
    assert np.abs(moved - expected).max() < 1e-4 * np.abs(expected).max()
