"""From files to demonstrations: `open` is the one gateway, `load` reads all at once."""

from typing import TYPE_CHECKING

from unconstrain import lazy

if TYPE_CHECKING:
    from unconstrain.recordings.columns import Columns
    from unconstrain.recordings.derivative import differentiate
    from unconstrain.recordings.inspection import Inspection, inspect
    from unconstrain.recordings.notes import Note
    from unconstrain.recordings.preparation import Preparation
    from unconstrain.recordings.source import Recordings, load, open

__all__ = [
    "Columns",
    "Inspection",
    "Note",
    "Preparation",
    "Recordings",
    "differentiate",
    "inspect",
    "load",
    "open",
]

_HOMES = {
    "unconstrain.recordings.columns": ("Columns",),
    "unconstrain.recordings.derivative": ("differentiate",),
    "unconstrain.recordings.inspection": ("Inspection", "inspect"),
    "unconstrain.recordings.notes": ("Note",),
    "unconstrain.recordings.preparation": ("Preparation",),
    "unconstrain.recordings.source": ("Recordings", "load", "open"),
}

if not TYPE_CHECKING:  # a checker that sees __getattr__ takes any name for one of ours
    __getattr__, __dir__ = lazy.attach(__name__, _HOMES)
