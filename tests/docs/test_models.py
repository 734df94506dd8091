"""A figure of each table of docs/models.md is what the commands beside it measure."""

import re
from pathlib import Path

import pytest

from benchmarks import models
from reproduction.regressors import problems, trial

PAGE = (Path(__file__).parents[2] / "docs" / "models.md").read_text(encoding="utf-8")


def read_row(title, start):
    """The cells of the first row that begins so, below a title."""
    table = PAGE[PAGE.index(title) :]
    (line,) = re.findall(rf"^\| {re.escape(start)} \|(.*)\|$", table, flags=re.MULTILINE)[:1]
    return [cell.strip() for cell in line.split("|")]


def test_errors_are_those_of_the_benchmark():
    row = models.measure("linear", models.ROWS[0], 2, models.NOISE)
    inside, outside = (
        float(read_row(f"\n{title}:\n", "500 | 2 | 3%")[0]) for title in ("nUPE", "nUPE outside")
    )
    assert inside == pytest.approx(row.inside, rel=0.05)
    assert outside == pytest.approx(row.outside, rel=0.05)


def test_errors_of_regressors_are_those_of_the_experiment():
    problem = problems.draw_cycle(0.4, problems.NOISE, seed=0)
    cell = trial.measure("neighbours", "linear", problem)
    told = [float(cell) for cell in read_row("prior = 'linear'", "40 % free, 3 % noise | neighbours")[:4]]
    assert told == pytest.approx([cell[way] for way in trial.WAYS], rel=0.06)
