"""Policies that go round and round: every start comes nearer to the cycle, and keeps its pace."""

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.cli.app import run
from unconstrain.spaces import Pose

PERIOD, DT = 1.5, 0.02


def record(space=None, turns=8.0):
    """Uneven turns of an uneven loop in space, some with a hand that turns too."""
    t = np.arange(0, turns * PERIOD, DT)
    theta = 2 * np.pi * t / PERIOD + 0.3 * np.sin(2 * np.pi * t / PERIOD)
    uneven = 1 + 0.05 * np.sin(0.7 * t)
    x = np.column_stack([np.cos(theta), 0.6 * np.sin(theta), 0.2 * np.cos(2 * theta)]) * uneven[:, None]
    x += [3.0, -1.0, 2.0]
    if space is not None:
        half = 0.15 * np.sin(theta)
        x = np.column_stack([x, np.sin(half), 0 * half, 0 * half, np.cos(half)])
    X = space or uc.Demonstrations(x, x).space
    u = X.difference(x[:-1], x[1:]) / DT
    return uc.Demonstrations(x[:-1], u, time=t[:-1], space=X)


@pytest.mark.parametrize("space", [None, Pose()], ids=["numbers", "poses"])
def test_every_start_comes_nearer_and_keeps_period_and_amplitude(space):
    demos = record(space)
    plain = uc.LocallyLinearPolicy(risk="direct", alpha=1e-4).fit(demos)
    stable = plain.stabilized("cycle", demos)
    cycle = stable.stability_
    assert cycle.period == pytest.approx(PERIOD, rel=0.02)
    starts = demos.states[[0, 30, 50]] + np.append([0.0, 0.4, -0.3], np.zeros(demos.states.shape[1] - 3))
    dt = 0.05
    movement = stable.rollout(starts, round(10 * PERIOD / dt), dt)
    assert not movement.stopped  # though they begin outside of what was recorded
    for number in range(3):
        X = movement.states[movement.episodes == number]
        away = cycle.held_for(dt).distance(X)
        assert (np.diff(away) <= 1e-9).all()
        assert away[-1] < 1e-3 * away[0]
        phases = np.unwrap(cycle.phase(X))
        assert 2 * np.pi * len(X) * dt / (phases[-1] - phases[0]) == pytest.approx(PERIOD, rel=0.06)
        last = cycle.amplitude(X[-round(PERIOD / dt) :])
        assert last == pytest.approx(cycle.amplitude(demos.states), rel=0.05)


def test_a_cycle_is_compiled_and_saved_like_the_rest(tmp_path):
    demos = record()
    stable = uc.LocallyLinearPolicy(risk="direct", alpha=1e-4).fit(demos).stabilized("cycle", demos)
    stable.save(tmp_path / "round.skops")
    step = stable.compile()
    step.save(tmp_path / "round.npz")
    X = demos.states[:50]
    np.testing.assert_array_equal(uc.load_policy(tmp_path / "round.skops").predict(X), stable.predict(X))
    np.testing.assert_array_equal(uc.load_compiled(tmp_path / "round.npz")(X), step(X))
    far = np.concatenate([X + np.array([0.0, 0.7, -0.4]), 20 * X])
    np.testing.assert_allclose([step(x) for x in far], stable.predict(far), rtol=1e-9, atol=1e-9)
    assert np.isnan(step(np.full(3, np.nan))).all()
    N = np.broadcast_to(uc.constraints.projection([[0.0, 0.0, 1.0]]), (50, 3, 3))
    assert np.abs(stable.predict_constrained(X, N)[:, 2]).max() < 1e-12


def test_the_program_says_how_a_movement_goes_round(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    demos = record()
    np.savetxt(
        "loops.csv", np.column_stack([demos.time, demos.states]), delimiter=",", header="t,x,y,z", comments=""
    )
    fit = ["fit", "loops.csv", "--state", "x,y,z", "--time", "t", "--risk", "direct", "--out", "p.skops"]
    assert run([*fit, "--stable-at", "cycle"]) == 0
    assert "note: the cycle is the mean of 7.9" in capsys.readouterr().out
    assert run(["rollout", "p.skops", "--start=4,-1,2.1", "--steps", "150"]) == 0
    told = capsys.readouterr().out
    assert "the movement goes round " in told
    assert "of the recorded period), and ends " in told


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda d: d.select(slice(0, 60)), r"do not go round and round: 0\.8"),
        (lambda d: d.select(np.r_[0:90, 90:0:-1, 0:90]), "do not go round and round"),
        (lambda d: d.states, "put on one where it is fitted"),
    ],
    ids=["too short", "to and fro", "no times"],
)
def test_what_is_no_cycle_is_refused(change, sentence):
    demos = record()
    policy = uc.LocallyLinearPolicy(risk="direct", alpha=1e-4).fit(demos)
    with pytest.raises(uc.errors.DataError, match=sentence):
        policy.stabilized("cycle", change(demos))
    with pytest.raises(uc.errors.PolicyError, match=r"cannot follow a cycle of 1\.\d+ s"):
        policy.stabilized("cycle", demos, hold=0.5)
