"""Table I on little data: the protocol, the tables, and that learning does what is claimed of it."""

import json
from functools import partial

import numpy as np
import pytest
from rich.console import Console
from threadpoolctl import threadpool_limits

from reproduction import published
from reproduction.arm import experiment, tables, trial
from reproduction.arm.trial import CONSTRAINTS, POWERS, Recordings, name_row
from unconstrain.errors import UnconstrainError

QUIET = Console(quiet=True)

RISKS = {"published": ("inconsistency", "direct", "oracle"), "adaptive": ("adaptive",)}
"""What the trials of Table I learn by."""


@pytest.fixture(autouse=True)
def _one_thread():
    """As in a run of trials; several threads of BLAS and several tests at a time are in each other's way."""
    with threadpool_limits(1):
        yield


def _make_two_candidates():
    """The paper's model and one that knows more: enough to choose between, in a second."""
    everything = trial.make_candidates()
    return {name: everything[name] for name in ("locally linear", "decoupled, 15 knots")}


def test_recordings_are_held_out():
    recordings = Recordings.simulate(1.8, "1-3-5", seed=0, episodes=8)
    assert len(recordings.training) == 560
    assert len(recordings.test) == 240
    together = np.vstack([recordings.training.states, recordings.test.states])
    assert len(np.unique(together.round(9), axis=0)) == 800, "no sample is in both"
    J_rows = np.einsum("nij,nj->ni", recordings.complementary.projections, recordings.complementary.policy)
    np.testing.assert_allclose(J_rows, recordings.complementary.actions, atol=1e-15)
    new = recordings.new.states[0]
    assert not np.any(np.all(np.isclose(together, new), axis=1))


def test_a_linear_policy_is_learnt_to_rounding_from_every_constraint():
    for constraint in CONSTRAINTS:
        result = trial.run_published(2.0, constraint, seed=0, episodes=20)
        assert result["inconsistency nUPE"] < 1e-8
        assert result["inconsistency complementary nCPE"] < 1e-8
        assert result["direct nUPE"] > 0.7


def test_one_full_data_set_is_within_the_published_figures():
    result = trial.run_published(1.8, "2-4-6", seed=0)
    for error in tables.ERRORS:
        mean, spread = published.ARM[1.8, "2-4-6"][error]
        assert result[f"inconsistency {error}"] < mean + 3 * spread
    assert result["oracle nUPE"] < result["inconsistency nUPE"] < result["direct nUPE"]
    assert 40 <= result["local models"] <= 60


def test_what_is_chosen_by_inconsistency_beats_the_published_model_tenfold(monkeypatch):
    few = _make_two_candidates()
    monkeypatch.setattr(trial, "make_candidates", lambda: few)
    result = trial.run_auto(1.5, "4-5-6", seed=0, episodes=40)
    chosen = result[f"{result['chosen']} nUPE"]
    assert chosen < published.ARM[1.5, "4-5-6"]["nUPE"][0] / 10
    assert chosen < result["locally linear nUPE"] / 10


@pytest.mark.parametrize(("model", "powers"), [("published", POWERS), ("auto", POWERS[:2])])
def test_reproduce_writes_tables_figures_and_trials(tmp_path, monkeypatch, model, powers):
    fake = partial(_numbers, model)
    monkeypatch.setattr(trial, "run_published_rows" if model == "published" else "run_auto_rows", fake)
    monkeypatch.setattr(trial, "run_adaptive_rows", partial(_numbers, "adaptive"))
    outcome = experiment.reproduce(tmp_path, trials=3, console=QUIET, model=model)
    for text in ("64.33 ± 32.03", "1.42 ± 0.31"):
        assert text in outcome.table
    assert all(path.stat().st_size > 1000 for path in outcome.figures)
    (written,) = [path for path in outcome.files if path.suffix == ".json"]
    everything = json.loads(written.read_text())
    trials = everything["trials"]
    assert len(everything["adaptive"]) == (3 if model == "published" else 0)
    assert len(trials) == 3
    assert set(trials[0]) == {name_row(p, c) for p in powers for c in CONSTRAINTS}
    assert outcome.findings
    assert outcome.choices


def test_the_column_of_the_adaptive_risk_says_over_how_many_data_sets_it_is(tmp_path, monkeypatch):
    monkeypatch.setattr(trial, "run_published_rows", partial(_numbers, "published"))
    monkeypatch.setattr(trial, "run_adaptive_rows", partial(_numbers, "adaptive"))
    outcome = experiment.reproduce(tmp_path, trials=3, console=QUIET, adaptive=2)
    assert "ours over 3 data sets, adaptive over the first 2 data sets." in outcome.table
    assert "| nUPE published | nUPE ours | nUPE adaptive |" in outcome.table
    assert "on the same 2 data sets: 1-2-3" in outcome.findings[-1]
    assert "no contact in 2" in outcome.findings[-1]
    without = experiment.reproduce(tmp_path, trials=3, console=QUIET, adaptive=0)
    assert "adaptive" not in without.table
    assert not any("adaptive" in finding for finding in without.findings)
    with pytest.raises(UnconstrainError, match="adaptive= belongs to the published model"):
        experiment.reproduce(tmp_path, console=QUIET, model="auto", adaptive=2)


def test_any_constraint_can_be_asked_for(tmp_path, monkeypatch):
    monkeypatch.setattr(trial, "run_published_rows", partial(_numbers, "published"))
    outcome = experiment.reproduce(tmp_path, trials=2, console=QUIET, constraint="0,0,1", adaptive=0)
    assert "| 1.5 | 0,0,1 | – |" in outcome.table
    assert {path.stem for path in outcome.files} == {"table1_0_0_1"}
    one = [_numbers("auto", ("0,0,1",), seed) for seed in range(2)]
    assert len(tables.list_auto_findings(one)) == 1
    with pytest.raises(UnconstrainError, match="no task row 9"):
        experiment.reproduce(tmp_path, trials=2, console=QUIET, constraint="1-9")
    with pytest.raises(UnconstrainError, match="leave out constraint= and model="):
        experiment.reproduce(tmp_path, trials=2, console=QUIET, constraint="1-2-3", physics=True)


def test_a_wrong_choice_is_counted():
    results = [_numbers("auto", CONSTRAINTS, seed) for seed in range(3)]
    results[1][name_row(1.5, "1-2-3")]["chosen"] = "RBF"
    assert "In 1 of 24 data sets another candidate was nearer" in tables.list_auto_findings(results)[1]


def _numbers(model, constraints, seed):
    """Trials' numbers, to write tables of: errors that differ by row and candidate."""
    rng = np.random.default_rng(seed)
    names = RISKS.get(model) or tuple(trial.make_candidates())
    keys = ("nUPE", "nCPE", "complementary nCPE", "new nUPE", "inconsistency", "seconds")
    scale = dict(zip(names, 10.0 ** np.arange(len(names)), strict=True))
    one = {f"{name} {key}": scale[name] * rng.uniform(0.01, 0.02) for name in names for key in keys}
    one |= {"local models": 50, "alpha": 0.1, "free": 1.0} if model in RISKS else {"chosen": "locally linear"}
    powers = POWERS if model in RISKS else POWERS[:2]
    return {name_row(p, c): dict(one) for p in powers for c in constraints}


def test_an_unknown_model_is_told(tmp_path):
    with pytest.raises(UnconstrainError, match="no model 'best' for the arm: choose published or auto"):
        experiment.reproduce(tmp_path, console=QUIET, model="best")


def test_physics_is_learnt_as_well(monkeypatch):
    pytest.importorskip("mujoco")
    from reproduction.arm.physics import figures
    from reproduction.arm.physics import tables as physical
    from reproduction.arm.physics import trial as physics

    few = _make_two_candidates()
    monkeypatch.setattr(physics, "make_candidates", lambda: few)
    result = physics.run_trial((physics.TABLE,), seed=0, episodes=10)[physics.TABLE]
    assert result["auto nUPE"] < 0.1 < result["direct nUPE"]
    assert result["angle, median"] < 2.0
    both = [dict.fromkeys(physical.SCENARIOS, result)] * 2
    assert "hand gripped (1-2-3)" in physical.write_table(both)
    assert len(physical.list_findings(both)) == 2
    assert figures.plot_errors(both).axes
