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
    "wiping": Part("Wiping on two surfaces (rim, fender)", ("wiping/demos_*.mat",), _run("wiping")),
    "mechanisms": Part(
        "Lid (hinge), and other mechanisms",
        (
            "reaching/box_closing.mat",
            "reaching/reaching_cluttered.mat",
            "planer_circle.csv",
            "curve_circle.csv",
            "handwriting/*.mat",
        ),
        _run("mechanisms"),
    ),
}
"""By the name that `--part` takes, in the order of the page."""
