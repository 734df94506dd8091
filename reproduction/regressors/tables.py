"""The regressors' results as Markdown, and what is to be said about them."""

from collections.abc import Mapping, Sequence

import numpy as np

from reproduction import markdown
from reproduction.regressors.problems import PLANTS, TITLES
from reproduction.regressors.trial import PRIORS, TOLD, WAYS, WRAPPED, Result

MOST_TOLD, MOST_FITS = 2.0, 50
"""What a wrapped regressor is to stay below: times the error of the one that is told, and fits."""

Results = Mapping[str, Sequence[Result]]
"""Of a plant, by regressor."""


def write_plant(plant: str, results: Results) -> str:
    """Write the tables of a plant under its heading: regressors beside a linear prior, and by themselves."""
    parts = [f"### {TITLES[plant]}\n"]
    for prior in PRIORS:
        rows = [
            _row(row, kind, average(trials, row, prior))
            for row in PLANTS[plant]
            for kind, trials in results.items()
        ]
        heads = ["", "regressor", *WAYS, "wrapped / told", "fits", "seconds"]
        many = max(len(trials) for trials in results.values())
        parts.append(f"prior = {prior!r}, mean nUPE over {many} data set{'s' if many > 1 else ''}:\n")
        parts.append(markdown.table(heads, rows) + "\n")
    return "\n".join(parts)


def average(trials: Sequence[Result], row: str, prior: str) -> dict[str, float]:
    """Average what was measured of one regressor in one row."""
    cells = [trial[row][prior] for trial in trials]
    return {name: float(np.mean([cell[name] for cell in cells])) for name in cells[0]}


def list_findings(results: Mapping[str, Results]) -> tuple[str, ...]:
    """Say in which rows a wrapped regressor stays below twice the told one, and how often it is fitted."""
    findings = []
    for prior in PRIORS:
        cells = {
            f"{plant}, {row}, {kind}": average(trials, row, prior)
            for plant, of_plant in results.items()
            for row in PLANTS[plant]
            for kind, trials in of_plant.items()
        }
        missed = [
            f"{name} ({cell[WRAPPED] / cell[TOLD]:.2g})"
            for name, cell in cells.items()
            if cell[WRAPPED] > MOST_TOLD * cell[TOLD]
        ]
        reached = f"{len(cells) - len(missed)} of {len(cells)} rows"
        sentence = f"prior {prior!r}: at most {MOST_TOLD:g} times told in {reached}"
        findings.append(f"{sentence}; missed: {'; '.join(missed)}." if missed else f"{sentence}.")
        if cells:
            most = max(cell["fits"] for cell in cells.values())
            findings.append(f"prior {prior!r}: at most {most:g} fits of {MOST_FITS} allowed.")
    return tuple(findings)


def _row(row: str, kind: str, cell: Mapping[str, float]) -> list[str]:
    errors = [f"{cell[way]:.2g}" for way in WAYS]
    ratio = f"{cell[WRAPPED] / cell[TOLD]:.2g}"
    return [row, kind, *errors, ratio, f"{cell['fits']:.0f}", f"{cell['seconds']:.1f}"]
