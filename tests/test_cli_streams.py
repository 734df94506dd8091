import numpy as np
import pytest

import recordings
import unconstrain as uc
from test_cli import run  # noqa: F401 - a fixture
from test_stream import EPISODES, TIME, U, X, assert_same_fit

COLUMNS = ("--state", "x0,x1,x2", "--action", "u0,u1,u2", "--episode", "episode_index")


@pytest.fixture
def folder(tmp_path):
    return recordings.write(tmp_path / "parts", X, U, EPISODES, TIME, [100, 333]).name


def test_a_folder_is_read_as_a_stream(run, folder):  # noqa: F811
    code, out, err = run("fit", folder, *COLUMNS, "--model", "linear", "--checkpoint", "run.npz")
    assert code == 0, err
    assert f"read: {len(X)} samples in {len(np.unique(EPISODES))} episodes" in out
    assert "of observed motion explained" in out
    assert f"{len(X)} of {len(X)} rows" in err
    assert_same_fit(
        uc.load_policy("policy.skops"), uc.ParametricPolicy(alpha="cv").fit(X, U, groups=EPISODES)
    )
    code, _, err = run("fit", folder, *COLUMNS, "--model", "rbf", "--checkpoint", "run.npz")
    assert code == 2
    assert "checkpoint of another policy" in err


def test_a_cluster_of_this_machine(run, folder):  # noqa: F811
    pytest.importorskip("distributed")
    code, _, err = run("fit", folder, *COLUMNS, "--model", "linear", "--cluster", "local")
    assert code == 0, err
    assert_same_fit(
        uc.load_policy("policy.skops"), uc.ParametricPolicy(alpha="cv").fit(X, U, groups=EPISODES)
    )


def test_ctrl_c_says_how_to_go_on(run, folder, monkeypatch):  # noqa: F811
    tally, calls = uc.ParametricPolicy._tally, []

    def interrupted(self, *args, **kwargs):
        calls.append(1)
        if len(calls) == 1:
            raise KeyboardInterrupt  # which is what the main thread sees when it asks for the result
        return tally(self, *args, **kwargs)

    monkeypatch.setattr(uc.ParametricPolicy, "_tally", interrupted)
    arguments = ("fit", folder, *COLUMNS, "--model", "linear", "--checkpoint", "run.npz")
    code, _, err = run(*arguments)
    assert code == 130
    assert "the same call with checkpoint run.npz goes on from there" in err
    assert "nothing was left half written" in err
    code, _, err = run(*arguments)
    assert code == 0, err


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--figure", "a.png"), "--figure needs all data in memory"),
        (("--min-speed", "0.1"), "--min-speed needs all data in memory"),
        (("--model", "auto"), "--model auto needs all data in memory"),
        (("--cluster", "local", "--checkpoint", "a.npz"), "leave out --checkpoint, or --cluster"),
        (("--cluster", "tcp://127.0.0.1:1"), "no Dask scheduler answers"),
    ],
)
def test_mistakes_are_told_in_one_sentence(run, folder, options, sentence):  # noqa: F811
    code, _, err = run("fit", folder, *COLUMNS, *options)
    assert code == 2
    assert sentence in err
    assert "Traceback" not in err
