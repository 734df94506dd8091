"""Handwriting from everywhere; skipped where the recordings are not."""

from pathlib import Path

import pytest

from reproduction import stability
from reproduction.program import run
from unconstrain.errors import UnconstrainError

DATA = Path(__file__).parents[2].parent / "shared" / "data"


@pytest.mark.skipif(not DATA.is_dir(), reason="the recordings are not part of the project")
def test_every_start_reaches_the_goal_and_errors_stay_what_they_were(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(stability, "GRID", 5)
    monkeypatch.setattr(stability, "LONGEST", 5.0)
    for shape in ("GShape", "Sharpc"):
        row = stability.measure(DATA, shape, 0)
        assert row.stable == 1.0
        assert row.rises == 0
        assert row.stable_error < 1.02 * row.plain_error
    figure = tmp_path / "levels.png"
    assert (
        run(["stability", str(DATA), "--repetitions", "1", "--shape", "GShape", "--figure", str(figure)]) == 0
    )
    printed = capsys.readouterr().out
    assert "| GShape | 32 | 0.0% | 100.0% |" in printed
    assert figure.is_file()


def test_mistakes(tmp_path, capsys):
    with pytest.raises(UnconstrainError, match="does not hold handwriting"):
        stability.list_shapes(tmp_path)
    assert run(["stability", str(tmp_path), "--shape", "Nothing"]) == 2
    assert "Nothing.mat" in capsys.readouterr().err


def test_the_page_has_the_table_of_what_the_command_prints():
    page = (Path(__file__).parents[2] / "docs" / "stability.md").read_text(encoding="utf-8")
    row = stability.Row("x", 1, 0.0, 1.0, 5.0, 1.0, 1.0, 1.0, 0.1, 0.1, 10.0, 0)
    assert stability.tabulate([row]).splitlines()[0] in page
