"""How the program talks: text as it is, and commands that can be pasted."""

import shlex
from pathlib import Path

from rich.console import Console

INTERRUPTED = 130
"""The exit code after Ctrl-C, as shells have it."""


def console() -> Console:
    """A console that takes text literally: brackets in names of files and columns are no markup."""
    return Console(markup=False, highlight=False, soft_wrap=True)


def quoted(path: Path) -> str:
    """A path as a shell takes it."""
    return shlex.quote(str(path))
