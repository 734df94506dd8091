import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, UnconstrainError


def simulated(n_samples=12, n_episodes=3, seed=0):
    rng = np.random.default_rng(seed)
    return Demonstrations(
        states=rng.normal(size=(n_samples, 3)),
        actions=rng.normal(size=(n_samples, 2)),
        episodes=np.arange(n_samples) % n_episodes,
        time=np.arange(n_samples) * 0.1,
        policy=rng.normal(size=(n_samples, 2)),
        projections=np.where(rng.random((n_samples, 1, 1)) < 0.3, np.nan, rng.normal(size=(n_samples, 2, 2))),
        state_names=["x", "y", "z"],
        action_names=["left", "right"],
        episode_labels=[f"run{i}" for i in range(n_episodes)],
        notes=["made up"],
    )


def test_defaults():
    demos = Demonstrations([[1, 2], [3, 4]], [[5], [6]])
    assert len(demos) == 2
    assert demos.n_episodes == 1
    assert demos.states.dtype == demos.actions.dtype == np.float64
    assert demos.episodes.dtype == np.int64
    assert demos.episodes.tolist() == [0, 0]
    assert demos.state_names == ("x1", "x2")
    assert demos.action_names == ("u1",)
    assert demos.time is demos.policy is demos.projections is None
    assert demos.notes == ()


def test_episode_codes_are_kept_and_other_values_are_numbered():
    X = np.ones((4, 1))
    assert Demonstrations(X, X, [1, 1, 0, 0]).episodes.tolist() == [1, 1, 0, 0]
    demos = Demonstrations(X, X, ["b", "b", "a", "b"])
    assert demos.episodes.tolist() == [1, 1, 0, 1]
    assert demos.episode_labels == ("a", "b")
    assert Demonstrations(X, X, [7, 3, 3, 7]).episode_labels == ("3", "7")


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"states": np.ones(4)}, r"states must have shape \(samples, dimensions\)"),
        ({"states": np.ones((0, 2))}, "states are empty"),
        ({"states": [["a", "b"]] * 4}, "states must be an array of numbers"),
        ({"states": [[0, 0], [0, 0], [0, np.nan], [0, 0]]}, "states hold nan at row 2, column 1"),
        ({"actions": np.ones((3, 2))}, r"actions have shape \(3, 2\) where \(4, 2\) is needed"),
        ({"actions": [[0, 0], [np.inf, 0], [0, 0], [0, 0]]}, "actions hold inf at row 1, column 0"),
        ({"time": np.ones(3)}, "time have shape"),
        ({"time": [0, 1, 2, np.nan]}, "time hold nan at row 3"),
        ({"policy": np.ones((4, 3))}, "policy have shape"),
        ({"projections": np.ones((4, 2, 3))}, r"where \(4, 2, 2\) is needed"),
        ({"projections": [[[1, 0], [0, np.nan]]] * 4}, "projections hold nan at row 0, column 1"),
        ({"projections": [[[np.nan, np.inf], [np.nan] * 2]] * 4}, "projections hold nan at row 0"),
        ({"episodes": [0, 1]}, "episodes have shape"),
        ({"episodes": [0.5, 1, 1, 1]}, "integers or strings"),
        ({"episodes": [0, 0, 2, 2], "episode_labels": ["a", "b", "c"]}, "each used"),
        ({"state_names": ["x"]}, "state_names must be 2 names"),
        ({"action_names": "xy"}, "action_names must be 2 names"),
    ],
)
def test_what_does_not_fit_is_told(changes, sentence):
    with pytest.raises(DataError, match=sentence):
        Demonstrations(**({"states": np.ones((4, 2)), "actions": np.ones((4, 2))} | changes))


@given(hnp.arrays(bool, 12).filter(np.any))
def test_select_keeps_everything_together(mask):
    demos = simulated()
    chosen = demos.select(mask)
    for name in ("states", "actions", "time", "policy", "projections"):
        np.testing.assert_array_equal(getattr(chosen, name), getattr(demos, name)[mask])
    labels = np.array(demos.episode_labels)[demos.episodes[mask]]
    np.testing.assert_array_equal(np.array(chosen.episode_labels)[chosen.episodes], labels)
    assert set(chosen.episodes) == set(range(chosen.n_episodes))
    by_index = demos.select(np.flatnonzero(mask))
    np.testing.assert_array_equal(by_index.states, chosen.states)


def test_select_by_slice_and_wrong_selections():
    demos = simulated()
    assert len(demos.select(slice(None, None, 3))) == 4
    assert demos.select([-1]).states.tolist() == demos.states[-1:].tolist()
    with pytest.raises(DataError, match="none of the 12 samples"):
        demos.select([])
    with pytest.raises(DataError, match="the mask has shape"):
        demos.select([True, False])
    with pytest.raises(DataError, match="there is no sample 12"):
        demos.select([12])
    with pytest.raises(DataError, match="boolean mask"):
        demos.select([0.5])


def test_episode_by_number_and_label():
    demos = simulated()
    np.testing.assert_array_equal(demos.episode(1).states, demos.states[1::3])
    np.testing.assert_array_equal(demos.episode("run1").states, demos.states[1::3])
    assert demos.episode(1).episode_labels == ("run1",)
    with pytest.raises(DataError, match="no episodes are labelled 'nine'"):
        demos.episode("nine")
    with pytest.raises(DataError, match="no episode 3"):
        demos.episode(3)


@given(st.lists(st.integers(0, 3), min_size=1, max_size=40), st.integers(1, 6))
def test_blocks_are_contiguous_and_even_within_each_episode(episodes, k):
    X = np.ones((len(episodes), 1))
    demos = Demonstrations(X, X, episodes)
    blocks = demos.blocks(k)
    for code in range(demos.n_episodes):
        own = blocks[demos.episodes == code] - code * k
        assert np.all(np.diff(own) >= 0)
        assert own.min() == 0
        assert own.max() < k
        sizes = np.bincount(own, minlength=k)
        assert sizes.max() - sizes.min() <= 1


def test_blocks_need_a_positive_integer():
    with pytest.raises(UnconstrainError, match="k must be a whole number from 1"):
        simulated().blocks(0)


def test_moving_leaves_slow_samples_out_and_says_so():
    demos = Demonstrations(np.arange(4.0)[:, None], [[0.0], [-1.0], [0.5], [2.0]], ["a", "b", "b", "b"])
    moving = demos.moving(1.0)
    assert moving.states[:, 0].tolist() == [1.0, 3.0]
    assert moving.episode_labels == ("b",)
    assert moving.notes == ("left out 2 of 4 samples slower than 1",)
    assert demos.moving(0) is demos
    with pytest.raises(UnconstrainError, match="the fastest action has speed 2"):
        demos.moving(3)
    with pytest.raises(UnconstrainError, match="min_speed must be a finite number of at least zero"):
        demos.moving(-1)


def test_concatenate_keeps_episodes_distinct():
    one, two = simulated(seed=1), simulated(n_samples=6, n_episodes=2, seed=2)
    both = Demonstrations.concatenate([one, two])
    assert both.episode_labels == ("run0", "run1", "run2", "run0 (2)", "run1 (2)")
    np.testing.assert_array_equal(both.episode("run1 (2)").states, two.episode(1).states)
    np.testing.assert_array_equal(both.projections, np.concatenate([one.projections, two.projections]))
    assert both.notes == ("made up",)


def test_concatenate_drops_what_only_some_have():
    one = simulated()
    two = Demonstrations(one.states, one.actions)
    both = Demonstrations.concatenate([one, two])
    assert both.policy is None
    assert "left out policy, which 1 of 2 demonstrations do not have" in both.notes
    with pytest.raises(DataError, match="dimensions"):
        Demonstrations.concatenate([one, Demonstrations(one.states[:, :2], one.actions)])
    with pytest.raises(DataError, match="no demonstrations"):
        Demonstrations.concatenate([])


def test_repr_tells_the_shape_of_things():
    assert repr(simulated()) == (
        "Demonstrations(12 samples in 3 episodes; states x, y, z; actions left, right; "
        "with time, policy, projections; 1 note)"
    )
    many = Demonstrations(np.ones((1, 30)), np.ones((1, 1)))
    assert repr(many) == "Demonstrations(1 sample in 1 episode; states x1, x2, x3, ..., x30 (30); actions u1)"


def test_a_data_frame_holds_every_column():
    pandas = pytest.importorskip("pandas")
    N = np.broadcast_to(np.diag([1.0, 0.0]), (3, 2, 2))
    demos = Demonstrations(
        np.arange(6.0).reshape(3, 2), np.ones((3, 2)), [0, 0, 1], [0.0, 0.1, 0.0], np.ones((3, 2)), N,
        ["x", "y"], ["x", "v"], ["a", "b"], free=[0, 1, 0], forces=np.zeros((3, 1)),
    )  # fmt: skip
    frame = demos.to_pandas()
    assert isinstance(frame, pandas.DataFrame)
    assert list(frame) == [
        "episode", "time", "x", "y", "x_2", "v", "policy.x", "policy.v", "force.1", "free", "projections",
    ]  # fmt: skip
    assert frame["episode"].tolist() == ["a", "a", "b"]
    np.testing.assert_array_equal(frame[["x", "y"]], demos.states)
    np.testing.assert_array_equal(frame["projections"][1], N[1])


def test_a_missing_pandas_is_one_sentence(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(
        UnconstrainError, match="to_pandas needs pandas, which is not installed: pip install pandas"
    ):
        Demonstrations([[1.0]], [[1.0]]).to_pandas()


THREE = Demonstrations(np.ones((3, 2)), np.ones((3, 2)))


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: Demonstrations(np.ones((3, 2)) + 1j, np.ones((3, 2))), "states must be real numbers"),
        (lambda: Demonstrations(np.ones((3, 2)), np.ones((3, 2)), [[1], [1, 2], 3]), "integers or strings"),
        (lambda: Demonstrations(np.ones((3, 2)), np.ones((3, 2)), state_names=2), "state_names must be"),
        (
            lambda: Demonstrations(np.ones((3, 2)), np.ones((3, 2)), state_names=np.array(2)),
            "state_names must be",
        ),
        (
            lambda: Demonstrations(np.ones((3, 2)), np.ones((3, 2)), episode_labels=4),
            "episode_labels must be",
        ),
        (lambda: Demonstrations(np.ones((3, 2)), np.ones((3, 2)), notes=4), "notes must be a list"),
        (lambda: THREE.episode(0.5), r"no episode 0\.5"),
        (lambda: THREE.episode([0]), r"no episode \[0\]"),
        (lambda: THREE.blocks(10**30), "k must be a whole number from 1 to"),
        (lambda: THREE.folds([1]), "folds must be episodes or blocks"),
        (lambda: THREE.folds(0), "folds must be episodes or blocks, got 0"),
        (lambda: THREE.moving("fast"), "min_speed must be a number of at least zero"),
        (lambda: THREE.select([[1], [1, 2]]), "select takes"),
    ],
)
def test_values_of_another_kind_are_told_in_one_sentence(call, sentence):
    with pytest.raises(UnconstrainError, match=sentence) as caught:
        call()
    assert "\n" not in str(caught.value)
