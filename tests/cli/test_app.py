import os
import signal
import subprocess
import sys
import time

import click
import pytest

import unconstrain as uc
from tests.cli.commands import COLUMNS, start
from unconstrain.cli.app import program
from unconstrain.cli.command import in_words_of_options


def test_version(run):
    assert run("--version")[1].strip() == uc.__version__


def test_help_lists_each_command_with_one_whole_line(run, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    code, out, _ = run("--help")
    assert code == 0
    listed = out.split("Commands:\n")[1].strip("\n").splitlines()
    assert [line.split()[0] for line in listed] == [
        "demo",
        "inspect",
        "fit",
        "evaluate",
        "diagnose",
        "constraints",
        "rollout",
        "view",
        "convert",
    ]
    assert all(line.endswith(".") and not line.endswith("...") for line in listed)
    code, shown, err = run()
    assert (code, err) == (2, "")
    assert shown == out


def test_every_option_is_explained(run):
    for name, command in program.commands.items():
        assert command.params
        for option in command.params:
            assert isinstance(option, click.Argument) or len(option.help.split()) > 2
        assert run(name, "--help")[0] == 0


NOTHING_HEAVY = """
import sys
from unconstrain.cli.app import run
code = run(sys.argv[1:])
print(code, *sorted({"numpy", "scipy", "sklearn", "pyarrow", "matplotlib", "rich", "joblib"} & {*sys.modules}))
"""


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["--help"], 0),
        (["--version"], 0),
        ([], 2),
        (["fit", "--help"], 0),
        (["fry"], 2),
        (["fit"], 2),
        (["fit", "a.csv", "--bogus"], 2),
        (["fit", "a.csv", "--model", "forest"], 2),
        (["fit", "a.csv", "--risk", "constrained"], 2),
        (["fit", "a.csv", "--folds", "halves"], 2),
        (["fit", "a.csv", "--centers", "here"], 2),
        (["fit", "a.csv", "--alpha", "some"], 2),
        (["fit", "a.csv", "--alpha", "-1"], 2),
        (["fit", "a.csv", "--n-centers", "0"], 2),
        (["fit", "a.csv", "--state", "x,,y"], 2),
        (["fit", "a.csv", "--time-unit", "h"], 2),
        (["fit", "a.csv", "--window", "nan"], 2),
        (["fit", "a.csv", "--model", "linear", "--width", "1"], 2),
        (["fit", "a.csv", "--force", "f"], 2),
        (["fit", "a.csv", "--figure", "f.docx"], 2),
        (["fit", "a.csv", "--out", "nowhere/p.skops"], 2),
        (["diagnose", "a.csv", "--model", "auto"], 2),
        (["constraints", "a.csv", "--n-centers", "3"], 2),
        (["rollout", "p.skops", "--start", "a"], 2),
        (["rollout", "p.skops", "--start", "0", "--dt", "0"], 2),
    ],
)
def test_help_and_mistakes_import_nothing_heavy(tmp_path, arguments, code):
    ended = subprocess.run(
        [sys.executable, "-c", NOTHING_HEAVY, *arguments], capture_output=True, text=True, cwd=tmp_path
    )
    assert ended.stdout.splitlines()[-1] == str(code)
    assert ended.stderr.startswith("error: ") == (code == 2 and bool(arguments))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "name", ["plain[bold].csv", r"x\[foo].csv", "[/b]x.csv", "-a.csv", "esc\x1b[31m.csv"]
)
def test_names_are_printed_as_they_are_and_steer_nothing(run, movements, tmp_path, name):
    (tmp_path / name).parent.mkdir(exist_ok=True)
    os.rename(movements, tmp_path / name)
    code, out, err = run("fit", *COLUMNS, "--model", "linear", "--out", f"{name}.skops", "--", name)
    assert code == 0, err
    visible = name.replace("\x1b", r"\x1b")
    assert f"policy: {visible}.skops" in out
    assert "\x1b" not in out
    code, out, err = run("fit", *COLUMNS, "--overwrite", "--", f"no{name}")
    assert code == 2
    assert f"no{visible}" in err
    assert "\x1b" not in err


def test_names_of_columns_steer_nothing(run, tmp_path):
    (tmp_path / "c.csv").write_text(
        "x\x1b[2J,y,[red]u,v\n" + "1,2,3,4\n2,1,5,3\n4,1,2,2\n5,5,1,3\n0,1,1,1\n3,1,2,1\n"
    )
    code, out, err = run("fit", "c.csv", "--state", "0,1", "--action", "2,3", "--model", "linear")
    assert code == 0, err
    assert r"states x\x1b[2J, y, actions [red]u, v" in out
    assert "\x1b" not in out


def test_every_letter_is_printed_whatever_the_encoding(movements, tmp_path):
    arguments = ("fit", movements, *COLUMNS, "--model", "linear", "--out", tmp_path / "p.skops")
    ended = start(*arguments, env={"PYTHONIOENCODING": "ascii"}, capture_output=True)
    assert ended.returncode == 0
    assert r"\u03bb: " in ended.stdout


@pytest.mark.parametrize(
    ("raised", "code", "sentence"),
    [
        (
            MemoryError("Unable to allocate 9 EiB"),
            2,
            "error: there is not enough memory for this (Unable to allocate 9 EiB)",
        ),
        (RecursionError(), 2, "error: something in the files is nested too deeply"),
        (OverflowError("int too large"), 2, "error: a number is too large to compute with (int too large)"),
        (
            PermissionError(13, "Permission denied", "a.csv"),
            2,
            "error: cannot read or write a.csv: permission denied",
        ),
        (EOFError(), 2, "error: a file ends too early"),
        (uc.errors.DataError("give action= here"), 2, "error: give --action here"),
        (KeyboardInterrupt(), 130, "interrupted: nothing was left half written"),
    ],
)
def test_what_goes_wrong_anywhere_is_one_sentence(run, movements, monkeypatch, raised, code, sentence):
    def fail(*args, **kwargs):
        raise raised

    monkeypatch.setattr("unconstrain.evaluation.comparison.select_policy", fail)
    ended, _, err = run("fit", movements, *COLUMNS)
    assert ended == code
    assert err.startswith(sentence)
    assert err.count("\n") == 1


def test_ctrl_c_while_importing_is_one_line(tmp_path):
    blocked = "import sys, time\nprint('importing', flush=True)\ntime.sleep(60)\n"
    (tmp_path / "numpy.py").write_text(blocked)
    (tmp_path / "d.csv").write_text("x,u\n1,2\n")
    command = [sys.executable, "-m", "unconstrain", "fit", "d.csv", "--state", "x", "--action", "u"]
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": f"{tmp_path}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"},
    )
    assert process.stdout.readline() == "importing\n"
    time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 130
    assert err == "interrupted: nothing was left half written\n"


@pytest.mark.parametrize(
    ("sentence", "told"),
    [
        ("give action=", "give --action"),
        ("leave out action=, alpha= or time_unit=.", "leave out --action, --alpha or --time-unit."),
        ('alpha="cv" needs them', '--alpha "cv" needs them'),
        ("action=/tmp/x is read", "--action /tmp/x is read"),
        ("time_unit must be s", "--time-unit must be s"),
        ("alpha must be a number", "--alpha must be a number"),
        ("the action is long, and alpha too", "the action is long, and alpha too"),
        ("no column 'time_unit' in /a/time_unit.csv", "no column 'time_unit' in /a/time_unit.csv"),
        ("save it with save(path, resumable=True)", "save it with save(path, --resumable)"),
    ],
)
def test_arguments_are_named_as_options(sentence, told):
    names = ("action", "alpha", "time_unit", "resumable")
    assert in_words_of_options(sentence, {name: f"--{name.replace('_', '-')}" for name in names}) == told


@pytest.mark.parametrize("closed", [1, 2])
def test_closed_streams_lose_nothing(movements, tmp_path, closed):
    arguments = ["fit", movements, *COLUMNS, "--model", "linear", "--out", tmp_path / "p.skops"]
    shell = f'exec "$@" {closed}>&-'
    command = ["sh", "-c", shell, "sh", sys.executable, "-m", "unconstrain", *map(str, arguments)]
    ended = subprocess.run(command, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    assert "Traceback" not in ended.stderr + ended.stdout
    assert uc.load_policy(tmp_path / "p.skops").n_features_in_ == 2
