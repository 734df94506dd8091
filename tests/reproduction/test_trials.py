"""Trials that survive an interruption."""

from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from reproduction.trials import run_trials
from unconstrain.errors import UnconstrainError


def quiet():
    return Console(file=StringIO(), width=200)


def drawn(seed):
    return {"value": float(np.random.default_rng(seed).normal())}


class InterruptedAt:
    """The trial during which somebody presses Ctrl-C."""

    def __init__(self, seed):
        self.seed = seed

    def __call__(self, seed):
        if seed == self.seed:
            raise KeyboardInterrupt
        return drawn(seed)


def never(seed):
    raise AssertionError("this trial was kept and must not run again")


def test_interrupted_and_resumed_equals_uninterrupted(tmp_path):
    settings = {"width": 0.6}
    whole = run_trials(drawn, 6, tmp_path / "whole.jsonl", settings=settings, console=quiet())
    console = quiet()
    with pytest.raises(KeyboardInterrupt):
        run_trials(InterruptedAt(3), 6, tmp_path / "kept.jsonl", settings=settings, console=console)
    assert "3 of 6 are kept" in console.file.getvalue()
    assert run_trials(drawn, 6, tmp_path / "kept.jsonl", settings=settings, console=quiet()) == whole
    assert run_trials(never, 6, tmp_path / "kept.jsonl", settings=settings, console=quiet()) == whole


def test_a_trial_cut_short_while_it_was_written_runs_again(tmp_path):
    kept = tmp_path / "kept.jsonl"
    whole = run_trials(drawn, 3, kept, settings={}, console=quiet())
    kept.write_text(kept.read_text()[:-20])
    assert run_trials(drawn, 3, kept, settings={}, console=quiet()) == whole
    assert run_trials(never, 3, kept, settings={}, console=quiet()) == whole


def test_a_changed_setting_never_uses_old_trials(tmp_path):
    kept = tmp_path / "kept.jsonl"
    old = run_trials(drawn, 2, kept, settings={"width": 0.6}, console=quiet())
    new = run_trials(lambda seed: {"value": -1.0}, 2, kept, settings={"width": 0.8}, console=quiet())
    assert new == [{"value": -1.0}] * 2
    assert run_trials(never, 2, kept, settings={"width": 0.6}, console=quiet()) == old


def test_processes_do_not_change_results(tmp_path):
    alone = run_trials(drawn, 4, tmp_path / "a.jsonl", settings={}, console=quiet())
    assert run_trials(drawn, 4, tmp_path / "b.jsonl", settings={}, jobs=2, console=quiet()) == alone


def test_mistakes_are_told_in_a_sentence(tmp_path):
    with pytest.raises(UnconstrainError, match="at least one trial and one job"):
        run_trials(drawn, 0, tmp_path / "kept.jsonl", settings={})
    (tmp_path / "file").write_text("")
    with pytest.raises(UnconstrainError, match="cannot keep trials"):
        run_trials(drawn, 1, tmp_path / "file" / "kept.jsonl", settings={})
    (tmp_path / "folder").mkdir()
    with pytest.raises(UnconstrainError, match="cannot keep trials"):
        run_trials(drawn, 1, tmp_path / "folder", settings={})
