"""The parts there are; what runs them is imported when it is run."""

import importlib
from collections.abc import Callable
from pathlib import Path

from reproduction.real.part import Outcome, Part, Run


def _run(module: str) -> Run:
    def run(folder: Path, repetitions: int, out: Path, progress: Callable[[str], None]) -> Outcome:
        found: Run = importlib.import_module(f"reproduction.real.{module}").run
        return found(folder, repetitions, out, progress)

    return run


PARTS = {
    "handwriting": Part("Handwriting (LASA)", ("handwriting/*.mat",), _run("handwriting")),
    "reaching": Part("Reaching among boxes (CLAMP)", ("reaching/reaching_cluttered.mat",), _run("reaching")),
}
"""By the name that `--part` takes, in the order of the page."""
