import numpy as np
import pytest

from tests.cli.commands import COLUMNS, share
from unconstrain import limit_cycle as toy
from unconstrain.recordings.text import write_csv


def test_recordings_are_read_as_when_the_policy_was_fitted(run, movements, tmp_path):
    code, _, err = run("fit", movements, *COLUMNS, "--model", "rbf")
    assert code == 0, err
    code, out, _ = run("evaluate", "policy.skops", movements)
    assert code == 0
    assert "1600 samples, 40 episodes" in out
    assert "... 20 more" in out
    others = tmp_path / "others.npz"
    toy.demonstrate(5, random_state=1).save(others)
    code, out, _ = run("evaluate", "policy.skops", others, "--state", "states", "--action", "actions")
    assert code == 0
    (everything,) = (line for line in out.splitlines() if line.startswith("│ policy "))
    assert share(everything) > 0.9
    assert "°" in everything
    assert "of the recordings it was learnt from" in out
    assert "noise: " in out
    code, out, _ = run("evaluate", "policy.skops", movements, "--min-speed", "0.5")
    assert code == 0
    assert "slower than 0.5" in out


def test_options_of_the_fit_are_kept_unless_given_anew(run, tmp_path):
    demos = toy.demonstrate(6, random_state=0)
    write_csv(demos, tmp_path / "d.csv")
    moving = ("--state", "x1,x2", "--time", "t", "--episode", "episode", "--window", "0.1")
    assert run("fit", "d.csv", *moving, "--min-speed", "0.3", "--model", "linear")[0] == 0
    same, other = (
        run("evaluate", "policy.skops", "d.csv", *more)[1] for more in ((), ("--min-speed", "0.4"))
    )
    assert "slower than 0.3" in same
    assert "slower than 0.4" in other
    assert "of 240 samples" in other


def test_notes_are_in_the_words_of_the_options(run, tmp_path):
    demos = toy.demonstrate(6, random_state=0)
    write_csv(demos, tmp_path / "d.csv")
    columns = (
        "--state",
        "x1,x2",
        "--action",
        "u1,u2",
        "--time",
        "t",
        "--time-unit",
        "ns",
        "--episode",
        "episode",
    )
    code, out, err = run("fit", "d.csv", *columns, "--model", "linear")
    assert code == 0, err
    assert "give --time-unit" in out


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["nowhere.skops", "DATA"], "no such policy file"),
        (["DATA", "DATA"], "holds no policy saved by unconstrain"),
        (["POLICY", "DATA", "--state", "x1", "--action", "u1"], "maps 2 states to 2 actions"),
    ],
)
def test_mistakes(run, movements, policy, arguments, sentence):
    places = {"DATA": movements, "POLICY": policy}
    code, _, err = run("evaluate", *(places.get(argument, argument) for argument in arguments))
    assert code == 2
    assert sentence in err
    assert "Traceback" not in err


def test_columns_in_another_order_are_refused(run, tmp_path):
    t = np.arange(300) * 0.02
    numbers = np.column_stack([np.sin(2 * t), np.cos(3 * t), 1000 * t])
    for header in ("x,y,t", "y,x,t", "a,b,t"):
        rows = numbers if header == "x,y,t" else numbers[:, [1, 0, 2]]
        lines = [header, *(",".join(map(str, row)) for row in rows.tolist())]
        (tmp_path / f"{header[0]}.csv").write_text("\n".join(lines) + "\n")
    reading = ("--time", "t", "--model", "linear", "--overwrite")
    code, out, err = run("fit", "x.csv", "--state", "0,1", *reading)
    assert code == 0, err
    assert "read: 300 samples, 1 episode, 1 file, 50 Hz, 5.98 s, time in ms" in out
    assert "--time-unit" in out
    for other, found in (("y.csv", "y, x"), ("a.csv", "a, b")):
        code, _, err = run("evaluate", "policy.skops", other)
        assert code == 2
        assert f"learnt from the states x, y, and these recordings have {found} in their place" in err
    assert run("evaluate", "policy.skops", "a.csv", "--state", "b,a", "--time", "t")[0] == 0
