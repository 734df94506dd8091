"""Risk "adaptive" in the paper's tables, over the first few data sets: its fits take 30 to 100 times as long."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from reproduction.trials import Result, run_trials

ADAPTIVE = "adaptive"
"""The risk, and how its results are named."""


def run_adaptive(
    trial: Callable[[int], Result],
    asked: int | None,
    default: int,
    trials: int,
    out: Path,
    *,
    settings: dict[str, Any],
    jobs: int,
    console: Console,
    label: str,
    file: str = "adaptive.jsonl",
) -> list[Result]:
    """Run the trials of risk "adaptive", on the same data sets as those of the other risks.

    Parameters
    ----------
    trial : callable
        As for `run_trials`.
    asked : int, optional
        How many data sets the user wants; 0 for none.
    default : int
        How many there are if the user says nothing.
    trials : int
        Data sets of the other risks; there are never more.
    out : Path
        Folder of finished trials.
    settings, jobs, console, label
        As for `run_trials`.
    file : str
        Name of the file of finished trials in `out`.

    Returns
    -------
    list of dict
        A result a data set.
    """
    count = min(default if asked is None else asked, trials)
    if not count:
        return []
    return run_trials(
        trial,
        count,
        out / file,
        settings={**settings, "risk": ADAPTIVE},
        jobs=jobs,
        console=console,
        label=f"{label}, {ADAPTIVE}",
    )


def name_data_sets(results: Sequence[Any]) -> str:
    """Say over how many data sets the results are: "1 data set", "10 data sets"."""
    return f"{len(results)} data set{'s' if len(results) > 1 else ''}"
