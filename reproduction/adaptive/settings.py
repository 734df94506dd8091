"""What an adaptive fit is to reach, and what every part of the experiment has in common."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from reproduction.adaptive.ways import Cell

Result = dict[str, Cell]
"""What one trial measured, by cell: a row of the part's table."""


@dataclass(frozen=True)
class Reach:
    """What the mean error of risk "adaptive" is to stay below; None where there is no such demand.

    Attributes
    ----------
    told : float, optional
        Times the error of the same model told all projections.
    bound : float, optional
        Times told's error and the ratio of the two bounds, where the projections determine the policy.
    best : float, optional
        Times the least error of the two other risks.
    direct : float, optional
        Times the error of direct regression.
    inconsistency : float, optional
        Times the error by inconsistency.
    contact : float, optional
        The least share of samples rightly called free or constrained.
    inside : tuple of float, optional
        The least and the largest share of true actions in the intervals of 90 %.
    likelihood : bool
        The figures are mean log-likelihoods, and adaptive's is to be no lower than the others'.
    """

    told: float | None = None
    bound: float | None = None
    best: float | None = None
    direct: float | None = None
    inconsistency: float | None = None
    contact: float | None = None
    inside: tuple[float, float] | None = None
    likelihood: bool = False


@dataclass(frozen=True)
class Part:
    """A part of the experiment: a kind of data.

    Attributes
    ----------
    title : str
        A heading.
    measure : str
        What the figures are.
    run : callable
        From the ways to compare, the folder of recordings and the number of the trial to a `Result`; picklable.
    settings : dict
        What the results depend on besides the seed.
    trials : int
        How many there are, by default; with `fixed` at most.
    reaches : mapping of str to Reach
        By cell.
    otherwise : Reach
        For cells that are not in `reaches`.
    overall : Reach, optional
        For a last row, the mean over cells; without it there is no such row.
    told : str
        What "told" is told.
    needs : str
        "" for what is simulated with NumPy alone, "sim" for the extra of that name, "data" for recordings.
    fixed : bool
        Whether trials are the splits of recordings, of which there are no more, and not data sets.
    ways : tuple of str
        The ways that are compared, if not the usual ones.
    """

    title: str
    measure: str
    run: Callable[[tuple[str, ...], Path | None, int], Result]
    settings: dict[str, object]
    trials: int = 10
    reaches: Mapping[str, Reach] = field(default_factory=dict)
    otherwise: Reach = field(default_factory=Reach)
    overall: Reach | None = None
    told: str = "the true projections"
    needs: str = ""
    fixed: bool = False
    ways: tuple[str, ...] = ()
