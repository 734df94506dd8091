"""Means over data sets, and whether they are what was to be reached."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from reproduction.adaptive.settings import Part, Reach, Result
from reproduction.adaptive.ways import ADAPTIVE, DIRECT, INCONSISTENCY, TOLD, WAYS, Cell

EXACT = 1e-9
"""Errors below this are rounding, whatever multiple of another's rounding they are: the paper's "order of 1e-9"."""

ALIKE = 1e-3
"""Share by which figures may differ that are the same: a policy solved on the way of two risks."""

DETERMINED = 0.99
"""Share of the policy's directions that the known projections must determine for the bound to be asked for."""

MEAN = "mean"
"""The row of the mean over all cells."""


def average(results: Sequence[Result]) -> dict[str, Cell]:
    """Average every figure of every cell over the trials that have it."""
    cells = dict.fromkeys(name for result in results for name in result)
    return {name: _mean([result[name] for result in results if name in result]) for name in cells}


def average_cells(means: Mapping[str, Cell]) -> Cell:
    """Average the errors of all cells."""
    return _mean([{way: cell[way] for way in WAYS if way in cell} for cell in means.values()])


def _mean(cells: Sequence[Cell]) -> Cell:
    names = dict.fromkeys(name for cell in cells for name in cell)
    return {name: float(np.mean([cell[name] for cell in cells if name in cell])) for name in names}


def bound_ratio(cell: Cell) -> float | None:
    """Divide the bound without the projections by that with them."""
    return cell["bound"] / cell["told bound"] if "bound" in cell else None


def has_noise(cell: Cell) -> bool:
    """Whether the bounds are those of the noise there was, not of so little that its size does not matter."""
    return "bound" in cell and cell["true noise"] > 0


@dataclass(frozen=True)
class Verdict:
    """What was to be reached in a cell, and whether it was.

    Attributes
    ----------
    reach : str
        In words; empty where nothing was asked for.
    reached : bool or None
        None where nothing was asked for, or adaptive was not tried.
    impossible : bool
        The limit lies below the Cramér-Rao bound: no unbiased way can reach it on average.
    weak : bool
        The limit lies above the error of another risk: staying below it shows little.
    """

    reach: str
    reached: bool | None
    impossible: bool = False
    weak: bool = False

    def __str__(self) -> str:
        if self.reached is None:
            return ""
        if self.reached:
            return "yes, weak" if self.weak else "yes"
        return "no"


def judge(cell: Cell, reach: Reach) -> Verdict:
    """Judge the means of a cell."""
    if reach.likelihood:
        others = max(cell[DIRECT], cell[INCONSISTENCY])
        reached = cell[ADAPTIVE] >= others - ALIKE * abs(others) if ADAPTIVE in cell else None
        return Verdict("≥ both others", reached)
    if reach.inside is not None:
        least, largest = reach.inside
        return Verdict(f"{100 * least:g}..{100 * largest:g} %", bool(least <= cell["inside"] <= largest))
    limits = _list_limits(cell, reach)
    words = [f"≤ {words}" for words, _ in limits]
    limit = max(min((limit for _, limit in limits), default=np.inf), EXACT)
    impossible = has_noise(cell) and limit < cell["bound"]
    if impossible:
        words[int(np.argmin([limit for _, limit in limits]))] += " (below the bound)"
    if reach.contact is not None:
        words.append(f"contact ≥ {100 * reach.contact:g} %")
    if not words or ADAPTIVE not in cell:
        return Verdict(", ".join(words), None, impossible)
    reached = cell[ADAPTIVE] <= (1 + ALIKE) * limit
    if reach.contact is not None:
        reached = reached and cell["contact right"] >= reach.contact
    return Verdict(
        ", ".join(words),
        bool(reached),
        impossible,
        weak=limit >= min(cell[DIRECT], cell[INCONSISTENCY]) > EXACT
        and reach.best is None
        and reach.direct is None,
    )


def judge_part(part: Part, means: Mapping[str, Cell]) -> dict[str, Verdict]:
    """Judge every cell of a part, and the mean over them where something is asked of it."""
    verdicts = {name: judge(cell, part.reaches.get(name, part.otherwise)) for name, cell in means.items()}
    if part.overall is not None:
        verdicts[MEAN] = judge(average_cells(means), part.overall)
    return verdicts


def _list_limits(cell: Cell, reach: Reach) -> list[tuple[str, float]]:
    """List what adaptive's error is to stay below, in words and as a figure."""
    limits = []
    if reach.told is not None:
        limits.append((f"{reach.told:g} x told", reach.told * cell[TOLD]))
    ratio = bound_ratio(cell)
    if reach.bound is not None and ratio is not None and cell["determined"] >= DETERMINED:
        limits.append((f"{reach.bound:g} x bound x told", reach.bound * ratio * cell[TOLD]))
    if reach.best is not None:
        limits.append((f"{reach.best:g} x best other", reach.best * min(cell[DIRECT], cell[INCONSISTENCY])))
    if reach.direct is not None:
        limits.append((f"{reach.direct:g} x direct", reach.direct * cell[DIRECT]))
    if reach.inconsistency is not None:
        limits.append((f"{reach.inconsistency:g} x inconsistency", reach.inconsistency * cell[INCONSISTENCY]))
    return limits
