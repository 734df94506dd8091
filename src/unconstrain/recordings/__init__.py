"""Recordings in, demonstrations out: one reader per format, one function `load` for all."""

from unconstrain.recordings.differentiate import differentiate
from unconstrain.recordings.loading import load
from unconstrain.recordings.saved import save

__all__ = ["differentiate", "load", "save"]
