import os
import shlex
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import unconstrain as uc
from tests.cli.commands import COLUMNS, share, start
from unconstrain import limit_cycle as toy
from unconstrain.recordings.text import write_csv


def test_the_policy_is_saved_and_held_against_ordinary_regression(run, movements, tmp_path):
    code, out, _ = run("fit", movements, *COLUMNS, "--model", "rbf", "--out", "p.skops", "--figure", "f.png")
    assert code == 0
    assert "1600 samples, 40 episodes" in out
    assert (tmp_path / "f.png").stat().st_size > 10_000
    learnt, inconsistency, direct, still = (line for line in out.splitlines() if "%" in line and "│" in line)
    assert "adaptive (saved)" in learnt
    assert min(share(learnt), share(inconsistency)) > 0.9 > 0.8 > share(direct) > share(still) == 0
    assert "warning: " not in out
    assert "verdict: nothing found speaks against a robot, but it was not followed, as the rec" in out
    assert "a varying constraint seems to have bent" in out
    for told in (
        "of the samples were free",
        "in the unit of the action",
        "if all free",
        "if all constrained",
    ):
        assert told in out
    assert "no contact was found" not in out
    assert uc.load_policy("p.skops").risk == "adaptive"


def test_noise_can_be_corrected_for(run, movements):
    code, out, err = run(
        "fit", movements, *COLUMNS, "--model", "rbf", "--risk", "corrected", "--out", "p.skops"
    )
    assert code == 0, err
    assert "noise: " in out
    (learnt,) = (line for line in out.splitlines() if "corrected (saved)" in line)
    assert share(learnt) > 0.9
    assert uc.load_policy("p.skops").risk == "corrected"


def test_where_nothing_is_in_the_way_that_is_said(run, tmp_path):
    write_csv(toy.demonstrate(10, noise=0.3, constrained=False, random_state=0), tmp_path / "free.csv")
    code, out, err = run("fit", "free.csv", *COLUMNS, "--model", "rbf")
    assert code == 0, err
    assert "no contact was found in these recordings, so this is ordinary regression" in out
    assert "verdict: " in out
    code, out, err = run("diagnose", "free.csv", *COLUMNS, "--model", "rbf")
    assert code == 0, err
    assert "no contact was found" in out
    assert "verdict: " in out


def test_a_policy_that_loses_to_ordinary_regression_says_so(run, tmp_path):
    # Free movements, every action whole: the direction across it is what inconsistency leaves out.
    free = toy.demonstrate(6, constrained=False, random_state=0)
    write_csv(uc.Demonstrations(free.states, free.actions, free.episodes), tmp_path / "free.csv")
    for risk, rival in (("inconsistency", "ordinary regression"), ("direct", "inconsistency")):
        code, out, err = run(
            "fit", "free.csv", *COLUMNS, "--model", "locally-linear", "--risk", risk, "--out", f"{risk}.skops"
        )
        assert code == 0, err
        assert (f"warning: {rival} is better" in out) == (risk == "inconsistency"), out


@pytest.mark.parametrize("model", ["linear", "rbf", "locally-linear"])
def test_every_model_fits_and_the_direct_policy_can_be_saved(run, movements, model):
    code, out, err = run(
        "fit", movements, *COLUMNS, "--model", model, "--folds", "blocks", "--risk", "direct"
    )
    assert code == 0, err
    assert "ordinary regression (saved)" in out
    assert uc.load_policy("policy.skops").risk == "direct"


def test_the_model_can_be_chosen(run, tmp_path):
    write_csv(toy.demonstrate(6, random_state=0), tmp_path / "few.csv")
    code, out, err = run("fit", "few.csv", *COLUMNS, "--model", "auto")
    assert code == 0, err
    assert "| candidate" in out
    assert "(saved)" in out


def test_states_alone_are_differentiated(run, movements):
    code, out, err = run(
        "fit", movements, "--state", "2,3", "--time", "t", "--episode", "episode", "--window", 0.1
    )
    assert code == 0, err
    assert "1600 samples, 40 episodes" in out


def test_the_printed_rollout_starts_where_the_recording_does(run, tmp_path):
    demos = toy.demonstrate(10, constrained=False, random_state=0)
    far = demos.states + np.array([500_000.0, 5_400_000.0])  # metres, as maps have them
    write_csv(uc.Demonstrations(far, demos.actions, demos.episodes), tmp_path / "-far.csv")
    code, out, err = run("fit", "--out", "-p.skops", *COLUMNS, "--model", "rbf", "--", "-far.csv")
    assert code == 0, err
    command = shlex.split(out.strip().splitlines()[-1])
    (start,) = (word.removeprefix("--start=") for word in command if word.startswith("--start="))
    assert np.abs(np.array(start.split(","), dtype=float) - far[0]).max() < 1e-3 * np.ptp(far, axis=0).max()
    for _ in range(2):
        code, _, err = run(*command[1:])
        assert code in (0, 3), err  # 3 where ten seconds lead beyond what was recorded


@pytest.mark.parametrize("where", ["a full disk", "a closed pipe"])
def test_a_policy_is_saved_though_nobody_hears_what_is_said(movements, tmp_path, where):
    if where == "a full disk":
        out = open("/dev/full", "w")  # noqa: SIM115
    else:
        reading, writing = os.pipe()
        os.close(reading)
        out = os.fdopen(writing, "w")
    with out:
        arguments = ("fit", movements, *COLUMNS, "--model", "linear", "--out", tmp_path / "p.skops")
        ended = start(*arguments, stdout=out, stderr=subprocess.PIPE)
    assert ended.returncode == 1
    assert ended.stderr.count("\n") == 1
    assert "error: standard output could not be written" in ended.stderr
    assert uc.load_policy(tmp_path / "p.skops").n_features_in_ == 2


def test_ctrl_c_ends_with_one_line_and_leaves_nothing_half_written(movements, tmp_path):
    big = tmp_path / "big.csv"
    write_csv(toy.demonstrate(4000, random_state=0), big)
    command = [sys.executable, "-m", "unconstrain", "fit", big, *COLUMNS, "--out", tmp_path / "p.skops"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert "samples" in process.stdout.readline()
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert err == "interrupted: nothing was left half written\n"
    assert {p.name for p in tmp_path.iterdir()} == {movements.name, "big.csv"}


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["nowhere.csv", *COLUMNS], "nowhere.csv"),
        (["DATA"], "--state"),
        (["DATA", "--state", "x1,,x2"], "empty column name"),
        (["DATA", "--state", "x1,x9", "--action", "u1,u2"], "x9"),
        (["DATA", "--state", "x1,x2"], "time"),
        (["DATA", *COLUMNS, "--model", "linear", "--width", "1"], "no centres: leave out --width"),
        (["DATA", *COLUMNS, "--model", "auto", "--risk", "direct"], "leave out --risk, --alpha"),
        (["DATA", *COLUMNS[:-2], "--folds", "episodes"], "use blocks instead of episodes for --folds"),
        (["DATA", *COLUMNS, "--out", "nowhere/p.skops"], "there is no folder"),
        (["DATA", *COLUMNS, "--figure", "f.docx"], "f.docx"),
        (["DATA", *COLUMNS, "--out", "kept.skops"], "kept.skops exists: give --overwrite"),
        (["DATA", *COLUMNS, "--time", "t,x1"], "it takes one column"),
        (["DATA", "--state", '"x1, in m",x2', "--action", "u1,u2"], "no column 'x1, in m' for state"),
        (["DATA", *COLUMNS, "--force", "u1,u2"], "--force-threshold"),
        (["DATA", *COLUMNS, "--free", "u1", "--risk", "direct"], "leave out --risk direct"),
        (["DATA", *COLUMNS, "--free", "u1", "--projections", "u1"], "--projections and --free both say"),
    ],
)
def test_a_mistake_is_one_sentence_exit_code_2_and_no_file(
    run, movements, policy, tmp_path, arguments, sentence
):
    before = {p.name: p.stat().st_mtime_ns for p in tmp_path.iterdir()}
    code, _, err = run("fit", *(movements if argument == "DATA" else argument for argument in arguments))
    assert code == 2, err
    assert sentence in err
    assert "Traceback" not in err
    assert {p.name: p.stat().st_mtime_ns for p in tmp_path.iterdir()} == before
