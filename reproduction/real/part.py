"""What a part is, and what it leaves behind."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Outcome:
    """The results of a part.

    Attributes
    ----------
    title : str
        As a heading: "Handwriting (LASA)".
    table : str
        Markdown.
    findings : tuple of str
        What is worth saying, a sentence each, bad ones too; those about a target end with "reached" or "missed" and
        the target.
    figures : tuple of Path
        Pictures, already written.
    """

    title: str
    table: str
    findings: tuple[str, ...] = ()
    figures: tuple[Path, ...] = ()


Run = Callable[[Path, int, Path, Callable[[str], None]], Outcome]
"""From the folder of recordings, how many repetitions, the folder for results and pictures, and what takes a sentence
on how far it is."""


@dataclass(frozen=True)
class Part:
    """One kind of recordings, and what is measured on it.

    Attributes
    ----------
    title : str
        As a heading.
    files : tuple of str
        Patterns in the folder of recordings; each has to match a file.
    run : Run
        Measures it. Finished repetitions are kept in the folder for results, and a later call goes on from them.
    """

    title: str
    files: tuple[str, ...]
    run: Run

    def find_missing(self, folder: Path) -> str | None:
        """Return the first pattern that no file in the folder matches."""
        return next((pattern for pattern in self.files if not any(folder.glob(pattern))), None)
