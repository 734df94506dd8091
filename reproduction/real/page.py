"""Run parts one after the other, and write a page about them."""

from collections.abc import Callable, Sequence
from pathlib import Path

from reproduction.outcome import make_folder, write_text
from reproduction.real.part import Outcome
from reproduction.real.parts import PARTS
from unconstrain.errors import UnconstrainError


def run_parts(
    folder: Path, names: Sequence[str], repetitions: int, out: Path, progress: Callable[[str], None]
) -> list[Outcome]:
    """Run parts whose files are there, and write `real.md` anew after each.

    Parameters
    ----------
    folder : Path
        Of recordings.
    names : sequence of str
        Of `PARTS`.
    repetitions : int
        How often what is drawn at random is drawn.
    out : Path
        Folder for results and pictures.
    progress : callable
        Takes sentences: how far it is, and what is left out.

    Returns
    -------
    list of Outcome
        One for each part that was run.

    Raises
    ------
    UnconstrainError
        The folder holds nothing of these parts, or a file is damaged.
    """
    if not folder.is_dir():
        raise UnconstrainError(f"there is no folder {folder}: give the folder of recordings")
    outcomes: list[Outcome] = []
    missing = {name: PARTS[name].find_missing(folder) for name in names}
    for name, pattern in missing.items():
        if pattern is not None:
            progress(f"{name} is left out: {folder} does not hold {pattern}")
    if None not in missing.values():
        raise UnconstrainError(f"{folder} holds nothing to run: give the folder of recordings")
    make_folder(out)
    for name in (name for name, pattern in missing.items() if pattern is None):
        outcomes.append(PARTS[name].run(folder, repetitions, out, progress))
        write_text(out / "real.md", "\n\n".join(map(describe, outcomes)) + "\n")
    return outcomes


def describe(outcome: Outcome) -> str:
    """Write an outcome in Markdown."""
    sections = [f"## {outcome.title}", outcome.table, "\n".join(f"- {each}" for each in outcome.findings)]
    sections += [f"![{path.stem}]({path.name})" for path in outcome.figures]
    return "\n\n".join(section for section in sections if section)
