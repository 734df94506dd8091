"""`unconstrain constraints`, and what is known of constraints given to `unconstrain fit`."""

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.recordings.text import write_csv


@pytest.fixture
def wiping(tmp_path):
    """Motion in a plane of which 0.6 x + 0.8 z is constant."""
    rng = np.random.default_rng(0)
    along = np.stack([[0.8, 0.0, -0.6], [0.0, 1.0, 0.0]])
    U = rng.standard_normal((200, 2)) @ along
    write_csv(uc.Demonstrations(rng.standard_normal((200, 3)), U), tmp_path / "wipe.csv")
    return "wipe.csv"


@pytest.mark.parametrize("model", ["constant", "linear", "rbf"])
def test_the_equation_is_found(run, wiping, model, tmp_path):
    code, out, err = run(
        "constraints",
        wiping,
        "--state",
        "x1,x2,x3",
        "--action",
        "u1,u2,u3",
        "--model",
        model,
        "--figure",
        "c.png",
    )
    assert code == 0, err
    assert "0.800 u3 + 0.600 u1 ≈ 0" in out
    assert "rows: 1 (" in out
    assert uc.load_constraint("constraint.skops").n_constraints_ == 1
    assert (tmp_path / "c.png").exists()


def test_centres_are_for_models_that_have_them(run, wiping):
    code, _, err = run("constraints", wiping, "--n-centers", "3")
    assert code == 2
    assert "--n-centers is for --model rbf, and this is constant" in err


@pytest.fixture
def table(tmp_path, monkeypatch):
    """A recording on a tilted table, with forces and flags, in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(6)
    X = rng.uniform(-1, 1, (200, 3))
    U = (np.cos(3 * X) + rng.normal(size=X.shape)) @ uc.constraints.projection([[0.0, 0.6, 0.8]])
    forces = np.where(np.arange(200)[:, None] < 150, [[0.0, 3.0, 4.0]], 0.0)
    free = (np.arange(200) >= 150)[:, None]
    names = "x,y,z,vx,vy,vz,fx,fy,fz,free"
    np.savetxt("table.csv", np.hstack([X, U, forces, free]), delimiter=",", header=names, comments="")
    np.savetxt("any.csv", np.hstack([X, np.random.default_rng(7).normal(size=X.shape), forces, free]), delimiter=",",
               header=names, comments="")  # fmt: skip
    return ["--state", "x,y,z", "--action", "vx,vy,vz"]


def test_fit_takes_forces_and_flags(run, table):
    forces = ["--force", "fx,fy,fz", "--force-threshold", "2"]
    code, out, _ = run("fit", "table.csv", *table, "--model", "linear", *forces)
    assert code == 0
    assert "75.0% in contact, 25.0% free" in out
    assert "verdict: " in out
    assert uc.load_policy("policy.skops").n_known_constraints_ > 0
    for command in (["evaluate", "policy.skops"], ["diagnose"]):
        more = ["--model", "linear"] if command == ["diagnose"] else []
        code, out, err = run(*command, "table.csv", *table, *more, *forces)
        assert code == 0, err
        assert "what was in the way is known of 100% of the samples" in out
    code, out, _ = run("fit", "table.csv", *table, "--model", "linear", "--free", "free", "--overwrite")
    assert "known of 25.0%" in out


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["constraints", "any.csv"], "the actions span all 3 directions"),
        (["constraints", "table.csv", "--rows", "3"], "whole number from 1 to 2"),
        (["constraints", "table.csv", "--n-centers", "3"], "--n-centers is for --model rbf"),
        (
            ["fit", "table.csv", "--force", "fx,fy", "--force-threshold", "2"],
            "there are 2 force columns and 3 actions",
        ),
        (["fit", "table.csv", "--force", "fx,fy,fz"], "--force needs --force-threshold"),
        (["fit", "table.csv", "--force-threshold", "2"], "--force-threshold is for forces"),
    ],
)
def test_mistakes_on_the_command_line_are_one_sentence(run, table, tmp_path, arguments, sentence):
    code, _, err = run(*arguments, *table)
    assert code == 2
    assert sentence in err
    assert "Traceback" not in err
    assert not list(tmp_path.glob("*.skops"))
