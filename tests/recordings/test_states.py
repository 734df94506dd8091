"""States that are rotations, poses and angles, in the frame of others, and with their velocities."""

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation as Rotations

import unconstrain as uc
from unconstrain.errors import DataError
from unconstrain.spaces import Angle, Numbers, Pose, Product, Rotation, SecondOrder

DT = 0.02
STATE = ["x", "y", "z", "qx", "qy", "qz", "qw"]
QUATERNION = STATE[3:]


@pytest.fixture(scope="module")
def reaches():
    """Poses that go to the origin, (E, T, 3) and rotations (E, T)."""
    rng = np.random.default_rng(0)
    positions, rotations = [], []
    for _ in range(6):
        t = np.arange(120)[:, None] * DT
        positions.append(0.4 * rng.normal(size=3) * np.exp(-1.5 * t))
        rotations.append(Rotations.from_rotvec(rng.normal(size=3) * np.exp(-t)))
    return positions, rotations


def frame(reaches, quaternion="xyzw", prefix=""):
    """Write reaches as a data frame, each quaternion with a sign of its own."""
    positions, rotations = reaches
    rng = np.random.default_rng(1)
    parts = []
    for episode, (p, r) in enumerate(zip(positions, rotations, strict=True)):
        q = r.as_quat() * np.where(rng.random(len(p)) < 0.3, -1, 1)[:, None]
        columns = {f"{prefix}{axis}": p[:, i] for i, axis in enumerate("xyz")}
        columns |= {f"{prefix}q{axis}": q[:, "xyzw".index(axis)] for axis in quaternion}
        parts.append(pd.DataFrame({"run": episode, "t": np.arange(len(p)) * DT, **columns}))
    return pd.concat(parts, ignore_index=True)


def noted(source, *words):
    return [note for note in map(str, source.notes) if all(word in note for word in words)]


def test_poses_have_velocities_and_angular_velocities(reaches):
    demos = uc.load(frame(reaches), state=STATE, rotation=QUATERNION, time="t", episode="run")
    assert demos.space == Pose()
    assert demos.action_names == ("x_dot", "y_dot", "z_dot", "omega_x", "omega_y", "omega_z")
    first = demos.episode("0")
    expected = -reaches[1][0].as_rotvec()
    inside = slice(10, -10)
    assert np.allclose(first.actions[inside, 3:], expected[inside], atol=0.01)
    assert np.allclose(first.actions[inside, :3], -1.5 * reaches[0][0][inside], atol=0.01)
    assert np.all(np.sum(first.states[1:, 3:] * first.states[:-1, 3:], axis=1) > 0)


def test_both_signs_and_both_orders_give_the_same_policy(reaches):
    plain = frame(reaches)
    plain[QUATERNION] = np.vstack([r.as_quat() for r in reaches[1]])
    other = frame(reaches, "wxyz")
    policies = []
    for table, columns in ((plain, STATE), (other, [*STATE[:3], "qw", "qx", "qy", "qz"])):
        demos = uc.load(table, state=columns, rotation=columns[3:], time="t", episode="run")
        policies.append((uc.LocallyLinearPolicy(n_centers=8).fit(demos), demos))
    (one, a), (two, b) = policies
    assert np.abs(one.predict(a.states) - two.predict(b.states)).max() < 1e-9


@pytest.mark.parametrize("written", ["rotvec", "degrees", "euler", "matrix"])
def test_rotations_may_be_written_otherwise(reaches, written):
    table = frame(reaches).drop(columns=QUATERNION)
    every = Rotations.concatenate(reaches[1])
    if written == "matrix":
        columns = [f"r{i}{j}" for i in range(3) for j in range(3)]
        table[columns] = every.as_matrix().reshape(-1, 9)
    elif written == "euler":
        columns = ["yaw", "pitch", "roll"]
        table[columns] = every.as_euler("xyz", degrees=True)[:, ::-1]
    else:
        columns = ["rx", "ry", "rz"]
        table[columns] = every.as_rotvec(degrees=written == "degrees")
    state = [*STATE[:3], *columns]
    demos = uc.load(table, state=state, rotation=columns, time="t", episode="run")
    expected = uc.load(frame(reaches), state=STATE, rotation=QUATERNION, time="t", episode="run")
    assert np.allclose(demos.actions, expected.actions, atol=1e-9)
    if written != "matrix":
        assert noted(demos, "degrees" if written != "rotvec" else "radians", "angle_unit=")


def test_where_names_do_not_tell_the_order_of_a_quaternion_is_said(reaches):
    table = frame(reaches).rename(columns=dict(zip(QUATERNION, ["a", "b", "c", "d"], strict=True)))
    demos = uc.load(table, state=["a", "b", "c", "d"], rotation=["a", "b", "c", "d"], time="t", episode="run")
    assert demos.space == Rotation()
    assert noted(demos, "a, b, c, d are taken for x, y, z and w", "rotation=")


def test_states_are_expressed_in_the_frame_of_an_object(reaches):
    inside = frame(reaches)
    rng = np.random.default_rng(2)
    outside = inside.copy()
    for _, rows in inside.groupby("run").groups.items():
        turn, at = Rotations.from_rotvec(rng.normal(size=3)), rng.normal(size=3)
        outside.loc[rows, ["x", "y", "z"]] = (
            turn.apply(inside.loc[rows, ["x", "y", "z"]].to_numpy(copy=True)) + at
        )
        outside.loc[rows, QUATERNION] = (
            turn * Rotations.from_quat(inside.loc[rows, QUATERNION].to_numpy(copy=True))
        ).as_quat()
        outside.loc[rows, ["ox", "oy", "oz"]] = at
        outside.loc[rows, ["ow", "oi", "oj", "ok"]] = turn.as_quat(scalar_first=True)
    options = {"time": "t", "episode": "run"}
    outside = outside.rename(columns={"oi": "o_x", "oj": "o_y", "ok": "o_z", "ow": "o_w"})
    object_ = ["ox", "oy", "oz", "o_w", "o_x", "o_y", "o_z"]
    expected = uc.load(inside, state=STATE, rotation=QUATERNION, **options)
    demos = uc.load(outside, state=STATE, rotation=QUATERNION, relative_to=object_, **options)
    assert np.allclose(demos.actions, expected.actions, atol=1e-9)
    assert np.allclose(demos.states[:, :3], expected.states[:, :3])
    assert noted(demos, "relative to the columns", "in its frame")
    positions = uc.load(outside, state=["x", "y", "z"], relative_to=object_, **options)
    assert np.allclose(positions.states, expected.states[:, :3])
    assert np.allclose(positions.actions, expected.actions[:, :3], atol=1e-9)
    goal = uc.load(outside, state=STATE, rotation=QUATERNION, relative_to="goal", **options)
    assert np.allclose(goal.episode("3").states[-1], Pose().origin)


@pytest.mark.parametrize("in_frame", ["world", "body"])
def test_recorded_angular_velocities_are_compared_with_how_states_turn(reaches, in_frame):
    table = frame(reaches)
    turning = Rotations.concatenate(reaches[1])
    # A second rotation about another axis, so that the frames differ.
    about = Rotations.from_rotvec(np.tile(np.arange(120) * DT, 6)[:, None] * [0, 1.0, 0.5])
    both = about * turning
    table[QUATERNION] = both.as_quat()
    spin = np.vstack([np.gradient(r.as_rotvec(), DT, axis=0) for r in reaches[1]])
    world = np.array([0, 1.0, 0.5]) + about.apply(spin)
    table[["wx", "wy", "wz"]] = world if in_frame == "world" else both.inv().apply(world)
    options = {"state": QUATERNION, "rotation": QUATERNION, "action": ["wx", "wy", "wz"], "episode": "run"}
    demos = uc.load(table, time="t", **options)
    assert demos.space == Rotation(frame=in_frame)
    assert noted(demos, f"in the {in_frame}'s frame", "angular_velocity=")
    assert noted(uc.load(table, **options), "no time tells")
    said = uc.load(table, time="t", angular_velocity="world", **options)
    assert said.space == Rotation()
    assert not noted(said, "angular_velocity=")


@pytest.mark.parametrize(
    "options",
    [{}, {"relative_to": "goal"}, {"relative_to": "start", "order": 2}, {"resample": 30.0}, {"order": 2}],
)
def test_streams_learn_what_memory_does(reaches, options, tmp_path):
    path = tmp_path / "reaches.parquet"
    frame(reaches).to_parquet(path)
    opened = uc.open(path, state=STATE, rotation=QUATERNION, time="t", episode="run", **options)
    demos = opened.load()
    streamed = uc.fit_stream(uc.ParametricPolicy(alpha=1e-3), opened, batch_rows=100)
    loaded = uc.ParametricPolicy(alpha=1e-3).fit(demos)
    # A stream finds the base of rotations among the rows as they lie in the file.
    atol = 1e-4 if "resample" in options else 1e-6
    assert streamed.space_ == demos.space
    assert np.allclose(streamed.predict(demos.states), loaded.predict(demos.states), atol=atol)
    demos.save(tmp_path / "saved.npz")
    again = uc.load(tmp_path / "saved.npz")
    assert again.space == demos.space
    assert np.array_equal(again.states, demos.states)


def test_a_resampled_rotation_is_one(reaches):
    demos = uc.load(frame(reaches), state=STATE, rotation=QUATERNION, time="t", episode="run", resample=33.0)
    assert np.abs(np.linalg.norm(demos.states[:, 3:], axis=1) - 1).max() < 1e-12


def test_an_angle_lies_on_a_circle_whichever_way_it_wrapped():
    t = np.arange(200) * DT
    parts = []
    for episode, start in enumerate((3.0, -3.2, 3.3)):
        yaw = start + 0.5 * np.sin(t)
        yaw = (yaw + np.pi) % (2 * np.pi) - np.pi
        parts.append(pd.DataFrame({"run": episode, "t": t, "x": np.cos(t), "yaw": yaw}))
    table = pd.concat(parts)
    demos = uc.load(table, state=["x", "yaw"], time="t", episode="run")
    assert demos.space == Product((Numbers(1), Angle()), ((0,), (1,)))
    policy = uc.ParametricPolicy(risk="direct").fit(demos)
    turned = demos.states + np.array([0, 2 * np.pi])
    assert np.abs(policy.predict(demos.states) - policy.predict(turned)).max() < 1e-9
    plain = uc.load(table, state=["x", "yaw"], time="t", episode="run", angle="none")
    assert plain.space == Numbers(2)
    degrees = uc.load(table, state=["x", "yaw"], time="t", episode="run", angle="yaw", angle_unit="deg")
    assert degrees.space == Product((Numbers(1), Angle(360.0)), ((0,), (1,)))


def test_a_movement_that_crosses_itself_is_explained_at_second_order():
    t = np.arange(0, 12, DT)
    rng = np.random.default_rng(0)
    parts = []
    for episode in range(5):
        phase = t + rng.uniform(0, 6)
        eight = np.column_stack([np.sin(phase), np.sin(2 * phase)]) * rng.uniform(0.95, 1.05)
        parts.append(pd.DataFrame({"run": episode, "t": t, "x": eight[:, 0], "y": eight[:, 1]}))
    table = pd.concat(parts)
    first = uc.load(table, state=["x", "y"], time="t", episode="run")
    second = uc.load(table, state=["x", "y"], time="t", episode="run", order=2)
    assert second.space == SecondOrder(Numbers(2))
    assert second.state_names == ("x", "y", "x_dot", "y_dot")
    assert second.action_names == ("x_ddot", "y_ddot")
    explained = [
        uc.LocallyLinearPolicy(risk="direct").fit(demos).score(demos.states, demos.actions)
        for demos in (first, second)
    ]
    assert explained[1] > 0.99
    assert 1 - explained[0] > 5 * (1 - explained[1])


def test_mistakes_about_rotations_are_one_sentence(reaches):
    table = frame(reaches)
    options = {"time": "t", "episode": "run"}
    with pytest.raises(DataError, match="for each rotation, and stands for 5"):
        uc.load(table, state=STATE, rotation=["z", *QUATERNION], **options)
    with pytest.raises(DataError, match="rotation= names states, and column 'qw' is none"):
        uc.load(table, state=STATE[:6], rotation=QUATERNION, **options)
    with pytest.raises(DataError, match="x, y, z, qx are no rotation in row 0"):
        uc.load(table, state=STATE, rotation=["x", "y", "z", "qx"], **options)
    with pytest.raises(DataError, match="moving_centre= is for numbers and angles"):
        uc.load(table, state=STATE, rotation=QUATERNION, moving_centre=1.0, **options)
    with pytest.raises(DataError, match="one column for each of the 7 states"):
        uc.load(table, state=STATE, rotation=QUATERNION, relative_to=["x", "y"], **options)
    with pytest.raises(DataError, match="order must be 1 or 2"):
        uc.load(table, state=STATE, order=3, **options)
    far = pd.concat([table] * 20, ignore_index=True)
    far["run"] = np.repeat(np.arange(120), 120)
    far.loc[12345, QUATERNION] = 0.0
    with pytest.raises(DataError, match=r"the states in row 12345 .* are no rotation"):
        uc.load(far, state=STATE, rotation=QUATERNION, **options)
