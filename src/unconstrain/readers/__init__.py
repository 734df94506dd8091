"""Recordings in, demonstrations out: one reader per format, one function `load` for all."""

from unconstrain.readers.differentiate import differentiate
from unconstrain.readers.loading import load
from unconstrain.readers.saved import save

__all__ = ["differentiate", "load", "save"]
