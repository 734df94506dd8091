"""What an experiment leaves behind, the same for all, so that one page can show them all."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from unconstrain import atomic, plot
from unconstrain.errors import UnconstrainError


@dataclass(frozen=True)
class Outcome:
    """The results of one experiment, all files already written.

    Attributes
    ----------
    title : str
        As a heading: "The toy limit cycle (Figs. 3 and 4)".
    table : str
        Markdown: published | ours, or whatever the experiment compares.
    figures : dict of Path to str
        PNG files in the order to be shown, with the caption of each.
    choices : tuple of str
        What was chosen where the paper is silent, a sentence each.
    findings : tuple of str
        What is worth saying about the figures, a sentence each; reached or missed targets among them.
    files : tuple of Path
        Everything else that was written: all trials as JSON, SVG, video.
    """

    title: str
    table: str
    figures: dict[Path, str] = field(default_factory=dict)
    choices: tuple[str, ...] = ()
    findings: tuple[str, ...] = ()
    files: tuple[Path, ...] = ()


def make_folder(out: Path) -> None:
    """Make the folder that results are written into. Raises `UnconstrainError` where it cannot be made."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UnconstrainError(f"cannot make the folder {out}: {error.strerror}") from error


def write_text(path: Path, text: str) -> Path:
    """Write a text file, whole or not at all, and return its path."""
    with atomic.replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def write_json(path: Path, results: Any) -> Path:
    """Write results as JSON, whole or not at all, and return the path."""
    return write_text(path, json.dumps(results, indent=1) + "\n")


def write_results(out: Path, results: Mapping[str, Any], table: str) -> tuple[Path, Path]:
    """Write `trials.json` and `table.md` into the folder `out`, and return their paths."""
    return write_json(out / "trials.json", results), write_text(out / "table.md", table)


def write_figures(
    out: Path, figures: Mapping[str, tuple[Figure, str]]
) -> tuple[dict[Path, str], tuple[Path, ...]]:
    """Write figures, as PNG and as SVG, into the folder `out`.

    Parameters
    ----------
    out : Path
        The folder.
    figures : mapping of str to (Figure, str)
        A figure and its caption, by the name of its file.

    Returns
    -------
    shown : dict of Path to str
        The PNG files with their captions.
    files : tuple of Path
        The SVG files.
    """
    shown = {plot.save(figure, out / f"{name}.png"): caption for name, (figure, caption) in figures.items()}
    return shown, tuple(plot.save(figure, out / f"{name}.svg") for name, (figure, _) in figures.items())
