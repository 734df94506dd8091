"""NumPy archives: batches, numbered arrays, episodes by their ends or by flags, records, goals of episodes."""

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.errors import DataError

LENGTHS = (50, 60, 40)


def paths(lengths=LENGTHS, dimensions=2):
    """Movements, one an episode."""
    rng = np.random.default_rng(0)
    return [np.cumsum(rng.normal(size=(length, dimensions)), axis=0) for length in lengths]


def save(folder, **arrays):
    path = folder / "a.npz"
    np.savez(path, **arrays)
    return path


def told(demos):
    return "\n".join(demos.notes)


def test_batches_are_episodes_and_share_their_time(tmp_path):
    batch = np.random.default_rng(0).normal(size=(5, 60, 3))
    path = save(tmp_path, x=batch, u=2 * batch, t=np.arange(60) * 0.1, aim=batch[:, -1])
    demos = uc.load(path, state="x", action="u", action_is="velocity")
    assert demos.n_episodes == 5
    np.testing.assert_array_equal(demos.states, batch.reshape(-1, 3))
    np.testing.assert_allclose(demos.episode(4).time, np.arange(60) * 0.1)
    assert "5 demonstrations found in the first axis of x, u" in told(demos)
    near = uc.load(path, state="x", action="u", action_is="velocity", relative_to="goal")
    ends = uc.load(path, state="x", action="u", action_is="velocity", relative_to="aim")
    np.testing.assert_allclose(near.states, ends.states)
    assert "aim: one value for each demonstration, repeated" in told(ends)


ENDS = np.cumsum(LENGTHS)
LAST = np.isin(np.arange(ENDS[-1]), ENDS - 1)


@pytest.mark.parametrize(
    ("borders", "said"),
    [
        ({"meta/episode_ends": ENDS}, "meta/episode_ends, which counts the samples up to the end"),
        ({"episode_lengths": np.array(LENGTHS)}, "episode_lengths, which counts the samples of each"),
        ({"dones": LAST}, "dones, which flags the last sample"),
        ({"dones": LAST | np.roll(LAST, -1)}, "dones, which flags the last sample"),
        (
            {"terminals": LAST & (np.arange(150) < 60), "timeouts": LAST & (np.arange(150) > 60)},
            "terminals or timeouts, which flag the last sample",
        ),
        ({"episode_starts": np.roll(LAST, 1).astype(float)}, "episode_starts, which flags the first sample"),
    ],
)
def test_episodes_end_where_the_file_says(tmp_path, borders, said):
    x = np.concatenate(paths())
    path = save(tmp_path, **{"data/state": x, "data/action": x**2}, **borders)
    demos = uc.load(path, state="data/state", action="data/action")
    assert np.bincount(demos.episodes).tolist() == list(LENGTHS)
    assert f"3 episodes told apart by {said}" in told(demos)
    by_rate = uc.load(path, state="data/state", rate=10)
    np.testing.assert_allclose(by_rate.episode(2).time, np.arange(LENGTHS[2]) / 10)
    found = uc.inspect(path)
    assert found.episodes == 3
    assert "--episode episode" in found.next


@pytest.mark.parametrize(
    "borders",
    [
        {"episode_ends": ENDS - 1},
        {"episode_ends": ENDS[::-1]},
        {"dones": np.ones(150, bool)},
        {"dones": np.zeros(150, bool)},
    ],
)
def test_what_says_nothing_of_episodes_is_no_border(tmp_path, borders):
    x = np.concatenate(paths())
    demos = uc.load(save(tmp_path, x=x, u=x**2, **borders), state="x", action="u")
    assert demos.n_episodes == 1


def test_the_episode_option_overrules_ends(tmp_path):
    x = np.concatenate(paths())
    run = np.repeat([0, 1], 75)
    path = save(tmp_path, x=x, u=x**2, episode_ends=ENDS, run=run)
    assert uc.load(path, state="x", action="u", episode="run").n_episodes == 2


@pytest.mark.parametrize("name", ["traj_{}", "arr_{}"])
def test_numbered_arrays_are_demonstrations(tmp_path, name):
    path = save(tmp_path, **{name.format(i): x for i, x in enumerate(paths())})
    demos = uc.load(path, state=name.format("").rstrip("_"), rate=10)
    assert np.bincount(demos.episodes).tolist() == list(LENGTHS)
    np.testing.assert_array_equal(demos.states, np.concatenate(paths()))


def test_numbered_arrays_of_several_kinds_go_together(tmp_path):
    arrays = {f"x_{i}": x for i, x in enumerate(paths())}
    arrays |= {f"t_{i}": np.arange(len(x)) * 0.1 for i, x in enumerate(paths())}
    demos = uc.load(save(tmp_path, **arrays), state="x")
    np.testing.assert_allclose(demos.episode(1).time, np.arange(60) * 0.1)


def test_numbered_arrays_of_one_length_are_columns(tmp_path):
    x, u = paths((50, 50))
    demos = uc.load(save(tmp_path, arr_0=x, arr_1=u), state="arr_0", action="arr_1")
    assert demos.n_episodes == 1
    np.testing.assert_array_equal(demos.actions, u)


def test_states_may_have_a_sample_more_than_actions(tmp_path):
    arrays = {}
    for i, x in enumerate(paths()):
        arrays |= {f"episode_{i}/x": x, f"episode_{i}/u": x[1:] ** 2, f"episode_{i}/reward": x[1:, 0]}
    demos = uc.load(save(tmp_path, **arrays), state="x", action="u")
    np.testing.assert_array_equal(demos.states, np.concatenate([x[:-1] for x in paths()]))
    assert "x: one sample more than in other arrays, the last of which is left out" in told(demos)


def test_records_and_the_time_step_are_read(tmp_path):
    log = np.zeros(50, [("x", "f4"), ("q", "f8", 4)])
    log["x"] = np.arange(50.0) ** 2
    demos = uc.load(save(tmp_path, log=log, dt=0.05), state="log/x")
    np.testing.assert_allclose(demos.time, np.arange(50) * 0.05)
    assert "steps of 0.05 s, as dt says" in told(demos)


def test_a_wrong_axis_of_time_is_refused_at_once(tmp_path):
    path = save(tmp_path, x=np.random.default_rng(0).normal(size=(3, 1000)))
    with pytest.raises(DataError, match=r"1000 numbers a sample and but 3 samples.*time_axis=last"):
        uc.load(path, state="x", rate=10, time_axis="first")
