"""Figures of docs/when.md are what the command beside them measures."""

import re
from pathlib import Path

import numpy as np
import pytest

from benchmarks.rivals import simulated
from benchmarks.rivals.methods import METHODS
from benchmarks.rivals.plants import PLANTS, measure

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "when.md").read_text(encoding="utf-8")
README = (ROOT / "README.md").read_text(encoding="utf-8")
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


def test_the_readme_states_figures_of_the_page():
    short = README[README.index("| | limit cycle, half free |") :].split("\n\n")[0].splitlines()[2:]
    told = {
        row.split("|")[1].strip(): re.findall(r"\d[\d.]*", row.partition("|")[2].partition("|")[2])
        for row in short
    }
    table = PAGE[PAGE.index("*nUPE*") : PAGE.index("*nCPE*")]
    rows = {row.split("|")[1].strip(): row.split("|") for row in table.splitlines() if row.startswith("| ")}
    names = {
        "adaptive (default)": ["ours: adaptive"],
        "told every constraint": ["ours: told"],
        "Gaussian mixture regression": ["GMR"],
        "LPV-DS, told the goal": ["LPV-DS"],
        "behaviour cloning: network; trees": ["cloning: network", "cloning: trees"],
    }
    for short_name, figures in told.items():
        columns = [[rows[name][k].strip() for name in names[short_name]] for k in (3, 6, 7)]
        assert figures == [figure for column in columns for figure in column if figure != "-"]
