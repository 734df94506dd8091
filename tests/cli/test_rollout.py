import numpy as np
import pytest

import unconstrain as uc
from unconstrain.policies import load_policy


def test_a_movement_under_a_constraint(run, policy, tmp_path):
    code, out, err = run(
        *("rollout", policy, "--start", "0.1,0.1", "--steps", 50, "--block", "1,0", "--figure", "r.svg"),
        *("--beyond", "anywhere"),
    )
    assert code == 0, err
    path = np.genfromtxt("rollout.csv", delimiter=",", names=True)
    assert path.dtype.names == ("t", "x1", "x2", "x1_velocity", "x2_velocity")
    assert len(path) == 51
    np.testing.assert_allclose(path["x1"], 0.1)
    assert np.ptp(path["x2"]) > 0.01
    assert (tmp_path / "r.svg").exists()
    assert "after 1 s: x1 0.1, x2 " in out
    before = (tmp_path / "rollout.csv").read_text()
    code, _, err = run("rollout", policy, "--start", "0.2,0.1")
    assert code == 2
    assert "rollout.csv exists: give --overwrite to replace it, or another name with --out" in err
    assert (tmp_path / "rollout.csv").read_text() == before
    assert run("rollout", policy, "--start", "0.2,0.1", "--overwrite", "--beyond", "anywhere")[0] == 0
    assert (tmp_path / "rollout.csv").read_text() != before


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--start", "0.1"], "--start must have 2 numbers"),
        (["--start", "a,b"], "it must be numbers separated by commas"),
        (["--start", "0,nan"], "its numbers must be finite"),
        (["--start", "0,0", "--block", "1"], "--block must have 2 numbers"),
        (["--start", "0,0", "--dt", "0"], "'--dt': it must be a positive number"),
        (["--start", "0,0", "--steps", "0"], "'--steps'"),
        (["--start", "0,0", "--beyond", "far"], 'it must be a positive number or "anywhere"'),
        (
            ["--start", "0,0", "--limits", "-1:1"],
            "--limits must have a least and a largest value for each of 2",
        ),
        (["--start", "0,0", "--limits", "z=-1:1"], "--limits names 'z', and the states are x1, x2"),
        (
            ["--start", "0,0", "--limits", "1:2,:"],
            "the start is outside: the movement leaves the limits: x1 would be",
        ),
        (["--start", "0,0", "--steps", str(10**12)], "take fewer steps"),
        (["--start", "0,0", "--figure", "r.txt"], "r.txt"),
        (["--start", "0,0", "--out", "kept.skops", "--overwrite"], "choose another name for --out"),
        (["--start", "0,0", "--out", "a.png", "--figure", "./a.png"], "--out and --figure are the same file"),
    ],
)
def test_mistakes(run, policy, tmp_path, arguments, sentence):
    code, _, err = run("rollout", policy, *arguments)
    assert code == 2, err
    assert sentence in err
    assert {p.name for p in tmp_path.iterdir()} == {policy.name}
    assert load_policy(policy).n_features_in_ == 2


def test_a_movement_that_has_to_stop_is_kept_up_to_there(run, tmp_path):
    x = np.random.default_rng(0).uniform(-1, 1, size=(300, 2))
    uc.ParametricPolicy(risk="direct", alpha=1e-6).fit(x, x @ [[0.0, 1.0], [0.0, 0.5]]).save("away.skops")
    move = ("rollout", "away.skops", "--start=0.5,0.1", "--steps", 9000, "--overwrite")
    lengths = {}
    for option, value, sentence in (
        ("--beyond", 0.5, "leaves what was recorded: it leads 0.5"),
        ("--beyond", "anywhere", "diverges: it leads"),
        ("--limits", "x2=:0.7", "leaves the limits: x2 would be 0.70"),
    ):
        code, out, err = run(*move, option, value)
        assert code == 3, err
        (said,) = (line for line in out.splitlines() if line.startswith("stopped after "))
        assert sentence in said
        assert ("say with --beyond how far" in said) == ("recorded: " in sentence)
        path = np.genfromtxt("rollout.csv", delimiter=",", names=True)
        lengths[value] = len(path)
        assert f"stopped after {len(path) - 1} of 9000 steps" in said
        assert np.isfinite(path["x2"]).all()
    assert path["x2"][-1] <= 0.7
    assert lengths["x2=:0.7"] < lengths[0.5] < lengths["anywhere"] < 9000
    assert (tmp_path / "rollout.png").stat().st_size > 0


def test_the_limits_of_a_robot_are_those_of_its_joints(run, policy):
    pytest.importorskip("mujoco")
    joint = '<joint name="{}" type="hinge" limited="true" range="-0.5 0.11"/><geom size="0.1"/>'
    body = f"<body>{joint.format('x1')}<body>{joint.format('x2')}</body></body>"
    head = '<mujoco><compiler angle="radian"/><worldbody>'
    for name, text in (("named.xml", body), ("other.xml", body.replace("x1", "q1").replace("x2", "q2"))):
        with open(name, "w") as file:
            file.write(f"{head}{text}</worldbody></mujoco>")
        move = ("--start", "0.1,0.1", "--beyond", "anywhere", "--overwrite", "--limits", name)
        code, out, err = run("rollout", policy, *move)
        assert code == 3, err
        assert "its upper limit is 0.11" in out
        assert ("note: limits are taken in the order of the joints, so x1 is q1" in out) == (
            name == "other.xml"
        )


def test_a_policy_that_is_relative_to_its_goal_is_told_where_that_is(run, tmp_path):
    t = np.arange(0, 4, 0.02)
    rows = []
    for episode, goal in enumerate([(1.0, 2.0), (-3.0, 1.0), (0.0, -2.0)]):
        x = goal + np.exp(-t)[:, None] * np.array([1.0, -1.0 + episode])
        rows.append(np.column_stack([np.full(len(t), episode), t, x]))
    np.savetxt("reach.csv", np.concatenate(rows), delimiter=",", header="run,t,x,y", comments="")
    code, out, err = run(
        *("fit", "reach.csv", "--state", "x,y", "--time", "t", "--episode", "run", "--relative-to", "goal"),
        *("--model", "linear", "--out", "reach.skops", "--resumable"),
    )
    assert code == 0, err
    assert "states are relative to where each episode ends" in out
    assert '--goal="0,0"' in out
    code, _, err = run("rollout", "reach.skops", "--start", "6,5")
    assert code == 2
    assert "say where that is with --goal" in err
    code, _, err = run("rollout", "reach.skops", "--start", "6,5", "--goal", "5,5", "--steps", 400)
    assert code == 0, err
    path = np.genfromtxt("rollout.csv", delimiter=",", names=True)
    assert path["x"][0] == 6.0
    assert abs(path["x"][-1] - 5.0) < 0.1
    # Where the policy is unsure does not hang on where in the room the goal is.
    stops = []
    for far in (0, 1000):
        place = (f"--start={6 + far},5", f"--goal={5 + far},5")
        _, out, _ = run("rollout", "reach.skops", *place, "--stop-when-unsure", 1e-3, "--overwrite")
        stops += [line for line in out.splitlines() if "as it was recorded" in line]
    assert len(stops) == 2
    assert stops[0] == stops[1]
