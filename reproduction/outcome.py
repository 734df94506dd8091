"""What an experiment leaves behind, the same for all, so that one page can show them all."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from unconstrain import atomic


@dataclass(frozen=True)
class Outcome:
    """The results of one experiment, all files already written.

    title: as a heading, "The toy limit cycle (Figs. 3 and 4)".
    table: Markdown, "published | ours", or whatever the experiment compares.
    figures: PNG files, in the order to be shown, with the caption of each.
    choices: what was chosen where the paper is silent, a sentence each.
    findings: what is worth saying about the figures, a sentence each; reached or missed targets among them.
    files: everything else that was written (JSON of all trials, SVG, video).
    """

    title: str
    table: str
    figures: dict[Path, str] = field(default_factory=dict)
    choices: tuple[str, ...] = ()
    findings: tuple[str, ...] = ()
    files: tuple[Path, ...] = ()


def write_results(out: Path, results: dict[str, Any], table: str) -> tuple[Path, Path]:
    """Write `trials.json` and `table.md` into the folder `out`, each whole or not at all; their paths."""
    texts = {"trials.json": json.dumps(results, indent=1) + "\n", "table.md": table}
    for name, text in texts.items():
        with atomic.replacing(out / name) as temporary:
            temporary.write_text(text, encoding="utf-8")
    return out / "trials.json", out / "table.md"
