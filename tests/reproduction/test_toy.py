"""The toy in small: it writes what it says, and reaches the published figures."""

import json

from rich.console import Console

from reproduction.toy import experiment

QUIET = Console(quiet=True)


def test_toy_in_small(tmp_path):
    outcome = experiment.reproduce(tmp_path, trials=2, console=QUIET)
    for name in ("fig3.png", "fig3.svg", "fig4.png", "fig4.svg", "trials.json", "table.md"):
        assert (tmp_path / name).stat().st_size > 0
    assert all(path.is_file() for path in (*outcome.figures, *outcome.files))
    trials = json.loads((tmp_path / "trials.json").read_text())["trials"]
    assert len(trials) == 2
    for trial in trials:
        ours = trial["inconsistency, 40 trajectories"]
        assert ours["nUPE"] < 0.0027
        assert ours["nCPE"] <= ours["nUPE"]
        assert trial["direct, 40 trajectories"]["nUPE"] > 0.3
    again = experiment.reproduce(tmp_path, trials=2, console=QUIET)
    assert again.table == outcome.table
