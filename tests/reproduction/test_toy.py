"""The toy in small: it writes what it says, and reaches the published figures."""

import json

from rich.console import Console

from reproduction.toy import experiment, trial
from reproduction.toy.figures import plot_sweeps
from reproduction.toy.trial import name_noise
from unconstrain.demo import FEW, MOVEMENTS

QUIET = Console(quiet=True)


def test_toy_in_small(tmp_path):
    outcome = experiment.reproduce(tmp_path, trials=2, console=QUIET, adaptive=0)
    for name in ("fig3.png", "fig3.svg", "fig4.png", "fig4.svg", "trials.json", "table.md"):
        assert (tmp_path / name).stat().st_size > 0
    assert all(path.is_file() for path in (*outcome.figures, *outcome.files))
    trials = json.loads((tmp_path / "trials.json").read_text())["trials"]
    assert len(trials) == 2
    for errors in trials:
        ours = errors["inconsistency, 40 trajectories"]
        assert ours["nUPE"] < 0.0027
        assert ours["nCPE"] <= ours["nUPE"]
        assert errors["direct, 40 trajectories"]["nUPE"] > 0.3
    assert "adaptive" not in outcome.table
    again = experiment.reproduce(tmp_path, trials=2, console=QUIET, adaptive=0)
    assert again.table == outcome.table


def test_fewer_data_sets_are_learnt_adaptively_as_the_table_and_the_figure_say(tmp_path, monkeypatch):
    monkeypatch.setattr(experiment, "run_trial", numbers)
    outcome = experiment.reproduce(tmp_path, trials=3, console=QUIET, adaptive=2)
    assert "| adaptive, 4 trajectories |" in outcome.table
    assert "over 3 data sets; of adaptive over the first 2 data sets." in outcome.table
    assert "on the same 2 data sets: 4 trajectories 0.15 (0.15)" in outcome.findings[-1]
    trials = json.loads((tmp_path / "trials.json").read_text())
    labels = [text.get_text() for text in plot_sweeps(trials["trials"], trials["adaptive"]).legends[0].texts]
    assert "adaptive, nUPE (2 data sets)" in labels
    assert "inconsistency, nUPE (3 data sets)" in labels
    assert "direct, nCPE (3 data sets)" in labels


def test_the_adaptive_risk_withstands_noise_and_the_inconsistency_does_not(monkeypatch):
    monkeypatch.setattr(trial, "SHARES", ())
    monkeypatch.setattr(trial, "NOISE", (0.1,))
    one = trial.run_trial(0, ("inconsistency", "adaptive"))
    assert one[name_noise("adaptive", 0.1)]["nUPE"] < one[name_noise("inconsistency", 0.1)]["nUPE"] / 5


def numbers(seed, ways=trial.WAYS):
    """What a trial measures, made up: 0.1, 0.2, ... in every row."""
    errors = {"nUPE": 0.1 * (seed + 1), "nCPE": 0.05 * (seed + 1)}
    rows = [trial.name_row(way, movements) for way in ways for movements in (FEW, MOVEMENTS)]
    rows += [trial.name_share(way, share) for way in ways for share in trial.SHARES]
    rows += [name_noise(way, noise) for way in ways for noise in trial.NOISE]
    return dict.fromkeys(rows, errors)
