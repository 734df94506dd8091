"""The window over which states are smoothed, and their noise."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import unconstrain as uc
from benchmarks import velocities
from unconstrain.errors import DataError
from unconstrain.recordings import differentiate
from unconstrain.recordings.smoothing import find_smoothing

RNG = np.random.default_rng(7)


def circle(rate=100, seconds=8.0, noise=0.0, tick=0.0):
    t = np.arange(int(seconds * rate)) / rate
    X, V = velocities.circle(t)
    X = X + noise * np.random.default_rng(1).standard_normal(X.shape)
    return t, np.round(X / tick) * tick if tick else X, V


def test_velocities_are_nearly_as_good_as_with_the_best_window():
    ratios = [row.error_found / row.error_best for row in velocities.rows(rates=(30, 100))]
    assert np.mean(np.array(ratios) <= 1.3) >= 0.9
    assert max(ratios) < 2.0


@pytest.mark.parametrize("noise", [1e-3, 1e-2, 5e-2])
def test_the_noise_is_found_and_what_is_left_of_it(noise):
    t, X, V = circle(noise=noise)
    found = find_smoothing(X, t)
    assert found.state_noise == pytest.approx(noise, rel=0.2)
    left = differentiate(X - circle()[1], t, window=found.window)
    inside = slice(len(t) // 10, -len(t) // 10)
    assert found.velocity_noise == pytest.approx(left[inside].std(), rel=0.35)
    error = np.sqrt(np.mean((differentiate(X, t, window=found.window) - V)[inside] ** 2))
    assert found.error == pytest.approx(error, rel=0.5)
    assert not found.is_exact


@pytest.mark.parametrize(
    "make", [velocities.circle, velocities.reaches, lambda t: (t[:, None] * [1.0, 2.0], 0)]
)
def test_exact_states_are_smoothed_over_the_fewest_samples(make):
    t = np.arange(400) / 50
    found = find_smoothing(make(t)[0] + 5.0, t)
    assert found.window == pytest.approx(0.04)
    assert found.velocity_noise < 1e-3


def test_positions_at_rest_and_few_samples_harm_nothing():
    t = np.arange(100) / 50
    assert find_smoothing(np.zeros((100, 2)), t).is_exact
    assert find_smoothing(np.zeros((4, 2)), t[:4]) is None
    assert find_smoothing(np.full((100, 2), 1e300) * np.sign(np.sin(40 * t))[:, None], t) is None


@pytest.mark.parametrize("tick", [1e-3, 1e-2])
@pytest.mark.parametrize("rate", [100, 1000])
def test_steps_of_an_encoder_are_noise(rate, tick):
    t, X, _ = circle(rate, tick=tick)
    found = find_smoothing(X, t)
    assert not found.is_exact
    assert found.window > 10 * tick**0.5 / rate
    assert found.state_noise > 0.5 * tick / np.sqrt(12)


def test_shift_scale_and_clock_change_nothing():
    t, X, _ = circle(noise=0.01)
    found = find_smoothing(X, t)
    other = find_smoothing(1000 * X + 3, 10 * t - 5)
    assert other.window == pytest.approx(10 * found.window)
    assert other.velocity_noise == pytest.approx(100 * found.velocity_noise, rel=1e-6)


def test_jumps_of_a_tracker_are_left_out():
    t, X, _ = circle(noise=0.005)
    plain = find_smoothing(X, t)
    jumping = X.copy()
    jumping[300:] += 2.0
    jumping[500] += 3.0
    found = find_smoothing(jumping, t)
    assert found.window == pytest.approx(plain.window, rel=0.3)
    assert found.state_noise == pytest.approx(plain.state_noise, rel=0.2)


def test_a_window_holds_several_bursts_of_stamps():
    t, X, _ = circle(noise=1e-4)
    late = np.repeat(t[4::5], 5) + np.tile(np.arange(5) * 2e-5, len(t) // 5)
    assert find_smoothing(X[: len(late)], late).window >= 2 * 0.05


def test_a_window_that_is_given_stays():
    t, X, _ = circle(noise=0.01)
    found, given = find_smoothing(X, t), find_smoothing(X, t, window=0.1)
    assert given.window == 0.1
    assert given.state_noise == found.state_noise
    assert given.velocity_noise == pytest.approx(found.velocity_noise * (found.window / 0.1) ** 1.5, rel=0.15)


@pytest.fixture
def path(tmp_path):
    rows = []
    for run in range(6):
        t, X, _ = circle(50, 4.0)
        X = X + 0.01 * RNG.standard_normal(X.shape)
        rows += [np.column_stack([np.full(len(t), run), t, X])]
    np.savetxt(tmp_path / "a.csv", np.concatenate(rows), delimiter=",", header="run,t,x,y", comments="")
    return tmp_path / "a.csv"


XY = {"state": ["x", "y"], "time": "t", "episode": "run"}


def test_a_reading_says_what_was_found(path):
    demos = uc.load(path, **XY)
    (note,) = demos.notes[:-1]
    assert "the states' noise is about 0.01, so they are smoothed over 0.2" in note
    assert "window= overrules that" in note
    given = uc.load(path, **XY, window=0.1)
    (note,) = given.notes[:-1]
    assert "so over window=0.1 s velocities are uncertain by about" in note
    assert given.noise > 2 * demos.noise > 0


def test_streams_smooth_and_know_as_memory_does(path, tmp_path):
    columns = np.genfromtxt(path, delimiter=",", names=True)
    path = tmp_path / "a.parquet"
    pq.write_table(pa.table({name: columns[name] for name in columns.dtype.names}), path, row_group_size=100)
    demos = uc.load(path, **XY)
    blocks = list(uc.open(path, **XY).blocks(150))
    assert len(blocks) > 2
    np.testing.assert_array_equal(np.concatenate([block.actions for block in blocks]), demos.actions)
    assert {block.noise for block in blocks} == {demos.noise}
    learnt = uc.ParametricPolicy(risk="corrected", alpha=1e-3).fit(demos)
    streamed = uc.fit_stream(uc.ParametricPolicy(risk="corrected", alpha=1e-3), uc.open(path, **XY))
    assert learnt.accumulator_.noise == streamed.accumulator_.noise == demos.noise**2
    np.testing.assert_allclose(streamed.weights_, learnt.weights_, rtol=1e-6)


def test_several_recordings_share_a_window(path, tmp_path):
    t, X, _ = circle(50, 0.3)
    np.savetxt(tmp_path / "b.csv", np.column_stack([t, X]), delimiter=",", header="t,x,y", comments="")
    np.savetxt(tmp_path / "c.csv", np.column_stack([t, X]), delimiter=",", header="t,x,y", comments="")
    demos = uc.load([tmp_path / "b.csv", tmp_path / "c.csv"], state=["x", "y"], time="t")
    assert demos.n_episodes == 2
    assert sum("noise" in note for note in demos.notes) == 1


def test_an_episode_shorter_than_the_window_keeps_what_it_has(path):
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines, *(f"9,{i / 50},{i / 50},1" for i in range(6))]) + "\n")
    demos = uc.load(path, **XY)
    short = demos.episode("9")
    np.testing.assert_allclose(short.actions, np.tile([1.0, 0.0], (6, 1)), atol=1e-9)
    path.write_text("\n".join([*lines, "9,0,0,1", "9,0.02,0,1"]) + "\n")
    with pytest.raises(
        DataError, match=r"episode '9' has 2 samples .* too few to differentiate; leave it out"
    ):
        uc.load(path, **XY)


@pytest.mark.parametrize("name", ["a.npz", "a.parquet"])
def test_the_noise_is_saved(path, tmp_path, name):
    demos = uc.load(path, **XY)
    demos.save(tmp_path / name)
    again = uc.load(tmp_path / name)
    assert again.noise == demos.noise
    assert again.select(slice(0, 10)).noise == demos.noise
    assert uc.open(tmp_path / name).source.noise == demos.noise
    both = uc.Demonstrations.concatenate([demos, again])
    assert both.noise == pytest.approx(demos.noise)
    other = uc.Demonstrations(demos.states, demos.actions)
    mixed = uc.Demonstrations.concatenate([demos, other])
    assert mixed.noise is None
    assert "left out noise, which 1 of 2 demonstrations do not have" in mixed.notes


@pytest.mark.parametrize("noise", [-1.0, np.nan, "much", [1.0]])
def test_a_noise_that_is_none_is_refused(noise):
    with pytest.raises(DataError, match="noise"):
        uc.Demonstrations(np.ones((2, 1)), np.ones((2, 1)), noise=noise)
