"""`fit --stable-at` and `rollout --stable-at`."""

import numpy as np
import pytest

import unconstrain as uc


@pytest.fixture
def reaches(tmp_path):
    """Five reaches, curved, that end within 0.1 of (1, 2)."""
    t, rng, rows = np.linspace(0, 2, 120), np.random.default_rng(0), []
    for episode in range(5):
        start, end = rng.uniform(-3, 3, size=2), np.array([1.0, 2.0]) + 0.05 * rng.normal(size=2)
        bow = np.sin(np.pi * t / 2)[:, None] * rng.normal(scale=0.3, size=2)
        share = (10 * (t / 2) ** 3 - 15 * (t / 2) ** 4 + 6 * (t / 2) ** 5)[:, None]
        x = start + share * (end - start) + bow
        rows.append(np.column_stack([np.full(len(t), episode), t, x]))
    np.savetxt("reach.csv", np.concatenate(rows), delimiter=",", header="run,t,x,y", comments="")
    return ("fit", "reach.csv", "--state", "x,y", "--time", "t", "--episode", "run", "--risk", "direct")


def ends(name="rollout.csv"):
    path = np.genfromtxt(name, delimiter=",", names=True)
    return path["x"][-1], path["y"][-1]


def test_the_goal_is_the_end_of_the_episodes(run, reaches):
    code, out, err = run(*reaches, "--stable-at", "end", "--out", "reach.skops")
    assert code == 0, err
    assert "stable at: x 1.0" in out or "stable at: x 0.9" in out
    assert "note: the goal is the mean of where the 5 episodes end; the farthest of them ends 0.0" in out
    assert "of the actions lead towards the goal as they are" in out
    goal = uc.load_policy("reach.skops").stability_.goal
    code, out, err = run("rollout", "reach.skops", "--start=-3,-3", "--steps", 1500)
    assert code == 0, err
    assert "the goal is reached after " in out
    assert np.allclose(ends(), goal, atol=0.01)
    code, out, err = run("rollout", "reach.skops", "--start=-3,-3", "--steps", 5, "--overwrite")
    assert "the goal is not reached yet, 1.06 of the extent" in out
    assert "give more --steps" in out
    block = ("--block=1,0", "--overwrite", "--steps", 2000)
    code, out, err = run("rollout", "reach.skops", "--start=-3,-3", *block)
    assert code == 0, err
    assert "the goal cannot be reached under this constraint" in out
    assert ends()[0] == -3.0
    code, out, err = run("evaluate", "reach.skops", "reach.csv")
    assert code == 0, err


def test_a_goal_in_numbers_also_of_a_policy_that_was_saved_without(run, reaches):
    assert run(*reaches, "--stable-at", "0.5,1.5", "--out", "told.skops")[0] == 0
    assert run(*reaches, "--out", "plain.skops")[0] == 0
    for policy, option in (("told.skops", ()), ("plain.skops", ("--stable-at", "0.5,1.5"))):
        code, out, err = run("rollout", policy, "--start=-2,3", *option, "--steps", 3000, "--overwrite")
        assert code == 0, err
        assert "the goal is reached after " in out
        assert ("stable at: x 0.5, y 1.5" in out) == bool(option)
        assert np.allclose(ends(), (0.5, 1.5), atol=0.06)
    code, out, _ = run("rollout", "plain.skops", "--start=-2,3", "--overwrite", "--beyond", "anywhere")
    assert code == 0
    assert "the goal" not in out


def test_the_goal_of_a_policy_that_is_relative_to_it(run, reaches):
    arguments = (*reaches, "--relative-to", "goal")
    code, out, err = run(*arguments, "--stable-at", "end", "--out", "reach.skops")
    assert code == 0, err
    assert "stable at: the goal that states are relative to" in out
    assert run(*arguments, "--out", "plain.skops")[0] == 0
    for policy, option in (
        ("reach.skops", ()),
        ("plain.skops", ("--stable-at", "end")),
        ("plain.skops", ("--stable-at", "7,8")),
    ):
        place = ("--start=5,5", "--goal=7,8", "--steps", 2000, "--overwrite")
        code, out, err = run("rollout", policy, *place, *option)
        assert code == 0, err
        assert "the goal is reached after " in out
        assert np.allclose(ends(), (7, 8), atol=0.01)


@pytest.mark.parametrize(
    ("option", "sentence"),
    [
        (["--stable-at", "1"], "--stable-at must have 2 numbers, as the policy has states, got 1"),
        (["--stable-at", "home"], "it must be numbers separated by commas"),
        (["--stable-at", "end", "--checkpoint", "c"], "--stable-at needs all data in memory"),
    ],
)
def test_mistakes_of_fit(run, reaches, tmp_path, option, sentence):
    code, _, err = run(*reaches, *option)
    assert code == 2
    assert sentence in err
    assert {path.name for path in tmp_path.iterdir()} == {"reach.csv"}


def test_mistakes_of_rollout(run, reaches, policy):
    assert run(*reaches, "--out", "plain.skops")[0] == 0
    for path, goal, sentence in (
        ("plain.skops", "end", "give the goal in numbers, or fit with --stable-at end"),
        ("plain.skops", "1", "--stable-at must have 2 numbers"),
        (policy, "0,0", "does not hold the states that it was learnt over"),
    ):
        code, _, err = run("rollout", path, "--start", "1,1", "--stable-at", goal)
        assert code == 2
        assert sentence in err
