"""Methods on recordings whose policy is known: `python -m benchmarks rivals`."""

import warnings
from collections.abc import Mapping

import numpy as np
from rich.console import Console
from rich.progress import track

from benchmarks.rivals.learnt import Learnt
from benchmarks.rivals.methods import METHODS, Option, choose
from benchmarks.rivals.plants import PLANTS, Errors, Plant, measure
from benchmarks.rivals.primitives import check_installed
from reproduction import markdown

CHOSEN_ON = (1000, 1001)
"""Numbers of the data sets that options are chosen on, by the true error."""

SETS, ARM_SETS = 5, 3
"""Data sets that are reported, from number 0 on; fewer of the arm, whose adaptive fits take longest."""

Row = dict[str, tuple[Option, Errors]]
"""By method the option that was chosen, and the median of each error."""

TITLES = {
    "nupe": "nUPE: squared error of the action at held-out states, as a share of the policy's variance",
    "ncpe": "nCPE: the same of what the constraints leave of it",
    "path": "path: how far free movements are off, as a share of how far the right ones lead",
}


def cost(learnt: Learnt, plant: Plant) -> float:
    """Compute the nUPE, or where there is none the error of the path."""
    errors = measure(learnt, plant)
    return errors.path if np.isnan(errors.nupe) else errors.nupe


def measure_row(row: str, sets: int, chosen_on: tuple[int, ...] = CHOSEN_ON) -> Row:
    """Measure all methods on a plant.

    Parameters
    ----------
    row : str
        Of `PLANTS`.
    sets : int
        Number of data sets.
    chosen_on : tuple of int
        Numbers of those that options are chosen on.

    Returns
    -------
    Row
        One entry a method; the option is None where there is nothing to choose.
    """
    tried = [PLANTS[row](seed) for seed in chosen_on]
    plants = [PLANTS[row](seed) for seed in range(sets)]
    found: Row = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # iterations of networks and mixtures end before they converge
        for name, method in track(METHODS.items(), row, transient=True, console=Console(stderr=True)):
            option = choose(method, cost, tried)
            learnt = [method.learn(plant.recorded, option) for plant in plants]
            errors = [
                Errors(np.nan, np.nan, np.nan) if each is None else measure(each, plant)
                for each, plant in zip(learnt, plants, strict=True)
            ]
            found[name] = option, Errors(*np.median(errors, axis=0).tolist())
    return found


def print_tables() -> None:
    """Print a table of each error, and the options that were chosen."""
    check_installed()
    print(tabulate({row: measure_row(row, ARM_SETS if row.startswith("arm") else SETS) for row in PLANTS}))


def tabulate(results: Mapping[str, Row]) -> str:
    """Write a table of each error, and the options that were chosen, as Markdown."""
    parts = []
    for error, title in TITLES.items():
        rows = [
            [name, *(_write(getattr(found[name][1], error)) for found in results.values())]
            for name in METHODS
        ]
        shown = [row for row in rows if set(row[1:]) != {"-"}]
        parts.append(f"{title}:\n\n{markdown.table(['', *results], shown)}")
    lines = []
    for row, found in results.items():
        chosen = [
            f"{name} {option}"
            for name, (option, errors) in found.items()
            if option is not None and not np.isnan(errors.path)
        ]
        lines.append(f"- {row}: {'; '.join(chosen)}")
    return "\n\n".join([*parts, "Options:", "\n".join(lines)])


def _write(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.2g}"
