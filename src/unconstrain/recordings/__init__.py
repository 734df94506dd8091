"""Recordings in, demonstrations out: one reader per format, one function `load` for all."""

from typing import TYPE_CHECKING

from unconstrain import lazy

if TYPE_CHECKING:
    from unconstrain.recordings.loading import load
    from unconstrain.recordings.saved import save

__all__ = ["load", "save"]

_HOMES = {"unconstrain.recordings.loading": ("load",), "unconstrain.recordings.saved": ("save",)}

if not TYPE_CHECKING:  # a checker that sees __getattr__ takes any name for one of ours
    __getattr__, __dir__ = lazy.attach(__name__, _HOMES)
