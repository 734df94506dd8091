import os
import shlex
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import unconstrain as uc
from unconstrain import limit_cycle as toy
from unconstrain.cli.demo import _write_csv


@pytest.fixture
def movements(tmp_path):
    path = tmp_path / "my movements ü.csv"
    _write_csv(toy.demonstrate(40, random_state=0), path)
    return path


COLUMNS = ("--state", "x1,x2", "--action", "u1,u2", "--episode", "episode")


def test_demo_ends_with_a_command_that_works(run, tmp_path):
    folder = tmp_path / "a [demo] of mine"
    code, out, _ = run("demo", "--out", folder.name)
    assert code == 0
    assert {p.name for p in folder.iterdir()} == {"limit-cycle.png", "table.md", "movements.csv"}
    last = shlex.split(out.strip().splitlines()[-1])
    assert last[0] == "unconstrain"
    code, out, _ = run(*last[1:])
    assert code == 0
    assert uc.load_policy(folder / "policy.skops").score([[0.5, 0.5]], [[0.5, -0.5]]) > 0.9


def test_fit_evaluate_rollout(run, movements, tmp_path):
    code, out, _ = run("fit", movements, *COLUMNS, "--model", "rbf", "--out", "p.skops", "--figure", "f.png")
    assert code == 0
    assert "1600 samples, 40 episodes" in out
    assert (tmp_path / "f.png").stat().st_size > 10_000
    learnt, direct = (line for line in out.splitlines() if "%" in line)
    assert "inconsistency (saved)" in learnt
    assert _share(learnt) > 0.9 > 0.8 > _share(direct)

    others = tmp_path / "others.npz"
    uc.save(toy.demonstrate(5, random_state=1), others)
    code, out, _ = run("evaluate", "p.skops", others, "--state", "states", "--action", "actions")
    assert code == 0
    assert _share(out.splitlines()[-2]) > 0.9
    code, out, _ = run("evaluate", "p.skops", movements)  # read as it was when fitted
    assert code == 0
    assert "1600 samples, 40 episodes" in out

    code, out, _ = run(
        "rollout", "p.skops", "--start", "0.1,0.1", "--steps", 50, "--block", "1,0", "--figure", "r.svg"
    )
    assert code == 0
    path = np.genfromtxt("rollout.csv", delimiter=",", names=True)
    assert path.dtype.names == ("t", "x1", "x2", "x1_velocity", "x2_velocity")
    assert len(path) == 51
    np.testing.assert_allclose(path["x1"], 0.1)
    assert np.ptp(path["x2"]) > 0.01
    assert (tmp_path / "r.svg").exists()


def test_every_model_fits_and_the_direct_policy_can_be_saved(run, movements):
    for model in ("linear", "rbf", "locally-linear"):
        code, out, err = run(
            "fit", movements, *COLUMNS, "--model", model, "--folds", "blocks", "--risk", "direct"
        )
        assert code == 0, err
        assert "direct (saved)" in out
        assert uc.load_policy("policy.skops").risk == "direct"


def test_states_alone_are_differentiated(run, movements):
    code, out, err = run(
        "fit", movements, "--state", "2,3", "--time", "t", "--episode", "episode", "--window", 0.1
    )
    assert code == 0, err
    assert "1600 samples, 40 episodes" in out


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["fit", "nowhere.csv", *COLUMNS], "nowhere.csv"),
        (["fit", "DATA"], "state="),
        (["fit", "DATA", "--state", "x1,,x2"], "empty column name"),
        (["fit", "DATA", "--state", "x1,x9", "--action", "u1,u2"], "x9"),
        (["fit", "DATA", "--state", "x1,x2"], "time"),
        (["fit", "DATA", *COLUMNS, "--model", "forest"], "--model must be one of"),
        (["fit", "DATA", *COLUMNS, "--model", "linear", "--width", "1"], "no centres"),
        (["fit", "DATA", *COLUMNS, "--alpha", "some"], "--alpha must be"),
        (["fit", "DATA", *COLUMNS, "--alpha", "-1"], "--alpha must be a finite number of at least zero"),
        (["fit", "DATA", *COLUMNS, "--n-centers", "0"], "error: n_centers must be a whole number"),
        (["fit", "DATA", *COLUMNS[:-2], "--folds", "episodes"], "use --folds blocks"),
        (["fit", "DATA", *COLUMNS, "--folds", "halves"], "--folds must be one of"),
        (["fit", "DATA", *COLUMNS, "--risk", "constrained"], "--risk must be one of"),
        (["fit", "DATA", *COLUMNS, "--out", "nowhere/p.skops"], "there is no folder nowhere"),
        (["fit", "DATA", *COLUMNS, "--figure", "f.docx"], "f.docx"),
        (["fit", "DATA", *COLUMNS, "--centers", "here"], "centers must be one of"),
        (["fit", "DATA", *COLUMNS, "--time", "t,x1"], "--time takes one column"),
        (["fit", "DATA", "--state", '"x1, in m",x2', "--action", "u1,u2"], "no column 'x1, in m' for state"),
        (["evaluate", "nowhere.skops", "DATA"], "no such policy file"),
        (["evaluate", "DATA", "DATA"], "holds no policy saved by unconstrain"),
        (["evaluate", "POLICY", "DATA", "--state", "x1", "--action", "u1"], "maps 2 states to 2 actions"),
        (["rollout", "POLICY", "--start", "0.1"], "--start must have 2 numbers"),
        (["rollout", "POLICY", "--start", "a,b"], "--start must be numbers"),
        (["rollout", "POLICY", "--start", "0,0", "--block", "1"], "--block must have 2 numbers"),
        (["rollout", "POLICY", "--start", "0,0", "--dt", "0"], "dt must be a positive number"),
        (["rollout", "POLICY", "--start", "0,0", "--figure", "r.txt"], "r.txt"),
        (["fit"], "Missing argument"),
        (["fry"], "No such command"),
    ],
)
def test_a_mistake_is_one_sentence_exit_code_2_and_no_file(run, movements, tmp_path, arguments, sentence):
    policy = tmp_path / "kept.skops"
    demos = toy.demonstrate(3, random_state=0)
    uc.ParametricPolicy().fit(demos.states, demos.actions).save(policy)
    before = {p.name for p in tmp_path.iterdir()}
    places = {"DATA": movements, "POLICY": policy}
    code, _, err = run(*(places.get(argument, argument) for argument in arguments))
    assert code == 2
    assert sentence in err
    assert "Traceback" not in err
    assert {p.name for p in tmp_path.iterdir()} == before


def test_ctrl_c_ends_with_one_line_and_leaves_nothing_half_written(movements, tmp_path):
    big = tmp_path / "big.csv"
    _write_csv(toy.demonstrate(4000, random_state=0), big)
    command = [
        sys.executable,
        "-m",
        "unconstrain",
        "fit",
        str(big),
        *COLUMNS,
        "--out",
        str(tmp_path / "p.skops"),
    ]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ
    )
    assert "samples" in process.stdout.readline()
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert err.strip().splitlines()[-1] == "interrupted: nothing was left half written"
    assert "Traceback" not in err
    assert {p.name for p in tmp_path.iterdir()} == {movements.name, "big.csv"}


def test_version(run):
    assert run("--version")[1].strip() == uc.__version__


def _share(line):
    return float(line.split("%")[0].split()[-1]) / 100
