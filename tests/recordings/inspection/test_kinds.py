"""Columns are what their names and numbers say."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from unconstrain.recordings.inspection.kinds import judge, quaternions, sign_flips, wraps
from unconstrain.recordings.inspection.timing import explained_by, judge_stamps


def walk(seed, n=400, k=1):
    """Smooth motion, (n, k)."""
    steps = np.random.default_rng(seed).normal(size=(n, k))
    kernel = np.hanning(41) / 20
    return (
        np.cumsum(np.array([np.convolve(c, kernel, "same") for c in steps.T]).reshape(k, n).T, axis=0) * 0.05
    )


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from(["xyzw", "wxyz"]), st.integers(0, 3))
def test_quaternions_are_found_wherever_they_are(seed, order, before):
    four = walk(seed, k=4) + np.array([0, 0, 0, 1.5])
    four /= np.linalg.norm(four, axis=1)[:, None]
    four = four if order == "xyzw" else np.roll(four, 1, axis=1)
    columns = [*(walk(seed + 1, k=before) * 3 + 5).T, *four.T]
    named = [*(f"p{i}" for i in range(before)), *(f"q{letter}" for letter in order)]
    assert quaternions(named, columns) == [(before, order)]
    nameless = [""] * len(columns)
    assert [start for start, _ in quaternions(nameless, columns)] == [before]


def test_without_names_the_larger_part_is_the_scalar_one():
    half = np.linspace(0, 0.6, 50)
    four = [np.cos(half), 0 * half, 0 * half, np.sin(half)]
    assert quaternions([""] * 4, four) == [(0, "wxyz")]
    assert quaternions([""] * 4, [*four[1:], four[0]]) == [(0, "xyzw")]


def test_a_circle_and_its_velocity_are_no_quaternion_and_neither_is_a_choice_of_four():
    t = np.linspace(0, 6, 100)
    circle = [np.cos(t), np.sin(t), 0.01 * np.cos(t), 0.01 * np.sin(t)]
    assert quaternions(["x", "y", "vx", "vy"], circle) == []
    chosen = np.eye(4)[np.arange(100) % 4]
    assert quaternions([""] * 4, list(chosen.T)) == []


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([2 * np.pi, 360.0]))
def test_a_turning_angle_is_known_by_its_jumps(seed, turn):
    unwrapped = np.linspace(0, 3.2, 300) + 0.05 * walk(seed, 300)[:, 0]
    values = np.mod(unwrapped, 1.0) * turn
    count, found = wraps(values)
    assert found == turn
    assert count == int(np.sum(np.abs(np.diff(values)) > turn / 2))
    (report,) = judge(["a"], [values])
    assert (report.kind, report.unit) == ("angle", "deg" if turn == 360.0 else "rad")


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6))
def test_motion_and_noise_do_not_wrap(seed):
    assert wraps(walk(seed)[:, 0]) == (0, 0.0)
    assert wraps(np.random.default_rng(seed).uniform(-np.pi, np.pi, 300)) == (0, 0.0)


def test_sign_flips_are_counted_within_episodes():
    four = np.tile([0.0, 0.0, 0.6, 0.8], (100, 1))
    four[30:60] *= -1
    assert sign_flips(four, np.zeros(100, int)) == 2
    assert sign_flips(four, np.repeat([0, 1], [30, 70])) == 1


@pytest.mark.parametrize(
    ("name", "kind", "unit"),
    [
        ("x", "position", None),
        ("x [mm]", "position", "mm"),
        ("pose.pose.position.x", "position", None),
        ("twist.twist.linear.x", "velocity", None),
        ("force_z", "force", None),
        ("imu.linear_acceleration.x", "acceleration", None),
        ("left_elbow", "angle", "rad"),
        ("yaw_deg", "angle", "deg"),
        ("joint_pos", "angle", "rad"),
        ("temperature", "number", None),
    ],
)
def test_names_tell(name, kind, unit):
    (report,) = judge([name], [walk(0)[:, 0]])
    assert (report.kind, report.unit) == (kind, unit)


def test_numbers_tell_what_names_do_not():
    n = 200
    columns = [
        np.arange(n, dtype=float),
        1.7e9 + np.arange(n) / 50,
        np.arange(n) % 2.0,
        np.ones(n),
        np.full(n, np.nan),
    ]
    assert [r.kind for r in judge([""] * 5, columns)] == ["index", "time", "flag", "constant", "empty"]


@settings(max_examples=30, deadline=None)
@given(st.floats(1.0, 1000.0), st.integers(0, 10**6))
def test_rate_and_gaps(rate, seed):
    rng = np.random.default_rng(seed)
    t = np.arange(500) / rate + rng.uniform(-0.05, 0.05, 500) / rate
    t[300:] += 20 / rate
    timing = judge_stamps(t, np.zeros(500, int))
    assert timing.rate_hz == pytest.approx(rate, rel=0.1)
    assert (timing.gaps, timing.repeated, timing.backwards, timing.bursts) == (1, 0, 0, False)


def test_bursts_are_seen_and_the_rate_is_that_of_the_messages():
    t = np.repeat(np.arange(50) * 0.2, 10) + np.tile(np.arange(10) * 20e-6, 50)
    timing = judge_stamps(t, np.zeros(500, int))
    assert timing.bursts
    assert timing.rate_hz == pytest.approx(50, rel=0.05)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.floats(1e-3, 1e3))
def test_the_derivative_explains_the_motion_in_any_unit_and_other_numbers_do_not(seed, scale):
    X, t, own = walk(seed, k=2) * scale, np.arange(400) / 100, np.zeros(400, int)
    V = np.gradient(X, t, axis=0)
    assert explained_by(X, V, t, own) > 0.98
    assert explained_by(X, X, t, own) < 0.7
    assert explained_by(X, V * 0, t, own) == pytest.approx(0)


def quaternion(n=50):
    angle = np.linspace(0.1, 1.0, n)
    return [0 * angle, np.sin(angle / 2) * 0.6, np.sin(angle / 2) * 0.8, np.cos(angle / 2)]


def test_a_quaternion_is_of_one_message():
    names = ["orientation.y", "orientation.z", "orientation.w", "linear.x"]
    assert not any(report.kind == "quaternion" for report in judge(names, quaternion()))
    names = [f"orientation.{axis}" for axis in "xyzw"]
    assert all(report.kind == "quaternion" for report in judge(names, quaternion()))


def test_actions_are_no_quaternion():
    assert not any(
        report.kind == "quaternion" for report in judge([f"actions[{i}]" for i in range(4)], quaternion())
    )


def test_what_follows_a_pose_in_an_array_is_no_position():
    wave = np.sin(np.linspace(0, 5, 50))
    columns = [wave, 2 * wave, 3 * wave, *quaternion(), 10 * wave, 20 * wave]
    found = judge([f"X[{i}]" for i in range(9)], columns)
    assert [report.kind for report in found] == ["position"] * 3 + ["quaternion"] * 4 + ["number"] * 2


def test_rows_of_pose_matrices():
    phase = np.linspace(0.0, 3.0, 50)
    zero, one = np.zeros(50), np.ones(50)
    matrix = [
        np.cos(phase),
        -np.sin(phase),
        zero,
        phase,
        np.sin(phase),
        np.cos(phase),
        zero,
        phase**2,
        zero,
        zero,
        one,
        -phase,
    ]
    found = [report.kind for report in judge([""] * 12, matrix)]
    assert [i for i, kind in enumerate(found) if kind == "position"] == [3, 7, 11]
    assert found.count("rotation") == 9
    assert "rotation" not in [report.kind for report in judge([""] * 12, [*matrix[:10], phase, phase])]


def test_frames_and_those_who_are_seen_in_them():
    frames, tracks = np.repeat(np.arange(20.0) * 10, 2), np.tile([1.0, 2.0], 20)
    steps = np.linspace(0.0, 5.0, 40)
    found = [report.kind for report in judge([""] * 4, [frames, tracks, steps, steps**2])]
    assert found[:2] == ["time", "episode"]
    found = [report.kind for report in judge([""] * 4, [steps, steps**2, steps, steps])]
    assert "episode" not in found
