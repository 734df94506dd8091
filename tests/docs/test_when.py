"""Figures of docs/when.md are what the command beside them measures."""

import re
from pathlib import Path

import numpy as np
import pytest

from benchmarks.rivals import simulated
from benchmarks.rivals.methods import METHODS
from benchmarks.rivals.plants import PLANTS, measure

PAGE = (Path(__file__).parents[2] / "docs" / "when.md").read_text(encoding="utf-8")
ROW = "limit cycle, 50% free"


@pytest.mark.parametrize(("method", "option"), [("ours: direct", None), ("GMR", 2)])
def test_errors_are_those_of_the_benchmark(method, option):
    head, *rows = re.findall(
        r"^\|.*\|$", PAGE[PAGE.index("*nUPE*") : PAGE.index("*nCPE*")], flags=re.MULTILINE
    )
    names, column = [row.split("|")[1].strip() for row in rows], head.split("|").index(f" {ROW} ")
    shown = float(rows[names.index(method)].split("|")[column])
    plants = [PLANTS[ROW](seed) for seed in range(simulated.SETS)]
    errors = [measure(METHODS[method].learn(plant.recorded, option), plant).nupe for plant in plants]
    assert np.median(errors) == pytest.approx(shown, rel=0.05)
