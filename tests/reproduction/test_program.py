"""The program: what it prints, how it ends, and options that do not belong."""

import signal
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest

from reproduction.program import run

ROOT = Path(__file__).parents[2]


@pytest.fixture
def program(monkeypatch, capsys, tmp_path):
    """Run the program in an empty folder: exit code, what it printed, what it complained."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "300")

    def call(*arguments):
        code = run([str(argument) for argument in arguments])
        return code, *capsys.readouterr()

    return call


def test_an_experiment_goes_on_from_kept_trials(program, tmp_path):
    code, out, _ = program("toy", "--trials", 1, "--jobs", 1, "--adaptive", 0)
    assert code == 0
    assert "inconsistency, 40 trajectories" in out
    assert "kept from before" not in out
    folder = tmp_path / "out" / "reproduction" / "toy"
    assert f"written: {folder.relative_to(tmp_path) / 'trials.json'}" in out
    first = (folder / "table.md").read_text()
    code, out, _ = program("toy", "--datasets", 1, "--jobs", 1, "--adaptive", 0)
    assert code == 0
    assert "toy: 1 of 1 are kept from before" in out
    assert (folder / "table.md").read_text() == first


def test_results_go_where_they_are_told_to(program, tmp_path):
    code, out, _ = program("finger", "--movements", 3, "--out", "in [a] folder/of mine")
    assert code == 0
    assert "3 movements with an obstacle each" in out
    assert (tmp_path / "in [a] folder" / "of mine" / "fig1.png").stat().st_size > 10_000


def test_help_lists_the_experiments_and_their_own_options(program):
    code, out, _ = program()
    assert code == 0
    for name in (
        "toy",
        "finger",
        "arm",
        "grasp",
        "posture",
        "constraints",
        "identifiability",
        "adaptive",
        "regressors",
        "all",
        "view",
    ):
        assert f"\n  {name} " in out
    assert "--physics" in program("arm", "--help")[1]
    assert "--physics" not in program("toy", "--help")[1]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["toe"], "No such command 'toe'"),
        (["toy", "--physics"], "No such option '--physics'"),
        (["toy", "--trials", 0], "0 is not in the range x>=1"),
        (["toy", "--out", "FILE"], "cannot keep trials in FILE/trials.jsonl"),
        (["finger", "--out", "FILE"], "cannot make the folder FILE"),
        (["finger", "--trials", 3], "No such option '--trials'"),
        (["all", "--model", "auto"], "No such option '--model'"),
        (["all", "--recordings", "."], "there is no recording planer_circle.csv: give the folder"),
        (["all", "--out", "FILE"], "cannot make the folder FILE"),
        (["arm", "--model", "best"], "'best' is not one of 'published', 'auto'"),
        (["arm", "--constraint", "1-9"], "no task row 9"),
        (["arm", "--physics", "--model", "auto"], "leave out --constraint and --model"),
        (["posture", "--video", "a.mp4"], "No such option '--video'"),
        (["constraints", "--recordings", "."], "as --recordings"),
        (["identifiability", "--recordings", "nowhere"], "there is no recording nowhere/planer_circle.csv"),
        (["identifiability", "--part", "toy"], "there is no part 'toy': choose one of report, advice"),
        (["adaptive", "--data", "nowhere"], "there is no folder nowhere: give the folder"),
        (["adaptive", "--part", "toy"], "there is no part 'toy': choose one of cycle, cycle400"),
        (["regressors", "--plant", "leg"], "there is no plant 'leg': choose one of cycle, arm, grasp"),
        (
            ["regressors", "--regressor", "oracle"],
            "there is no regressor 'oracle': choose one of extra-trees",
        ),
        (["adaptive", "--part", "handwriting"], "'handwriting' cannot be run: give the folder"),
    ],
)
def test_a_mistake_is_one_sentence_and_exit_code_2(program, tmp_path, arguments, sentence):
    (tmp_path / "FILE").touch()
    code, out, err = program(*arguments)
    assert code == 2
    assert out == ""
    assert sentence in err
    assert err.startswith("error: ")
    assert len(err.splitlines()) <= 2
    assert [path.name for path in tmp_path.iterdir()] == ["FILE"]


def test_mistakes_about_the_robot_are_told_before_the_first_trial(program, tmp_path):
    pytest.importorskip("mink")
    for arguments, sentence in (
        (["grasp", "--video", "a.gif"], "end the name in .mp4"),
        (["grasp", "--robot", "none.xml", "--hands", "a,b"], "there is no robot file 'none.xml'"),
        (["posture", "--lock", "tail"], "there is no joint 'tail' to lock"),
    ):
        code, _, err = program(*arguments)
        assert code == 2
        assert sentence in err
        assert not list(tmp_path.iterdir())


def test_pages_are_not_begun_at_a_port_that_is_taken(program):
    pytest.importorskip("viser")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        for experiment in ("grasp", "cycle"):
            code, _, err = program("view", experiment, "--port", port)
            assert code == 2
            assert f"port {port}" in err
            assert len(err.splitlines()) == 1


def test_ctrl_c_ends_with_one_line_and_says_what_is_kept(tmp_path):
    command = [
        sys.executable,
        "-m",
        "reproduction",
        "toy",
        "--trials",
        "200",
        "--jobs",
        "1",
        "--out",
        tmp_path / "toy",
    ]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    kept, until = tmp_path / "toy" / "trials.jsonl", time.monotonic() + 60
    while not (kept.is_file() and kept.stat().st_size) and time.monotonic() < until:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "of 200 are kept in" in out
    assert err.strip().splitlines()[-1] == "interrupted: finished trials are kept"
    assert "Traceback" not in err


def test_the_cycle_s_page_is_served_until_ctrl_c():
    pytest.importorskip("viser")
    command = [sys.executable, "-m", "reproduction", "view", "cycle", "--movements", "10", "--port", "0"]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        told = next(line for line in process.stdout if line.startswith("page: "))
        with urllib.request.urlopen(told.removeprefix("page: ").strip(), timeout=10) as page:
            assert page.status == 200
    finally:
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert "Traceback" not in err
