import numpy as np
import pytest

import unconstrain as uc
from unconstrain.recordings.text import write_csv

X, U = np.random.default_rng(0).standard_normal((2, 6, 2))


def read(path):
    return np.genfromtxt(path, delimiter=",", names=True, deletechars="")


def test_what_is_written_can_be_loaded(tmp_path):
    demos = uc.Demonstrations(X, U, [0, 0, 0, 1, 1, 1], time=[0.0, 0.1, 0.2, 0.0, 0.1, 0.2])
    write_csv(demos, tmp_path / "d.csv")
    again = uc.load(tmp_path / "d.csv", state=["x1", "x2"], action=["u1", "u2"], time="t", episode="episode")
    np.testing.assert_array_equal(again.states, X)
    np.testing.assert_array_equal(again.actions, U)
    np.testing.assert_array_equal(again.episodes, demos.episodes)
    np.testing.assert_array_equal(again.time, demos.time)


def test_a_name_that_is_taken_gets_a_number(tmp_path):
    demos = uc.Demonstrations(X, U, time=range(6), state_names=["t", "x"], action_names=["x", "x"])
    write_csv(demos, tmp_path / "d.csv")
    table = read(tmp_path / "d.csv")
    assert table.dtype.names == ("t", "t_2", "x", "x_2", "x_3")
    np.testing.assert_array_equal(table["x"], X[:, 1])
    np.testing.assert_array_equal(table["x_3"], U[:, 1])


def test_a_place_that_cannot_be_written_is_told(tmp_path):
    with pytest.raises(uc.errors.UnconstrainError, match="there is no folder"):
        write_csv(uc.Demonstrations(X, U), tmp_path / "nowhere" / "d.csv")
