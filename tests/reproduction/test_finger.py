"""The finger: a linear policy behind obstacles is found exactly."""

import json

from rich.console import Console

from reproduction.finger import experiment


def test_finger(tmp_path):
    outcome = experiment.reproduce(tmp_path / "new", console=Console(quiet=True))
    assert {path.name for path in outcome.figures} == {"fig1.png"}
    errors = json.loads((tmp_path / "new" / "errors.json").read_text())
    assert errors["inconsistency"]["nUPE"] < 1e-6
    assert errors["direct"]["nUPE"] > 1000 * errors["inconsistency"]["nUPE"]
