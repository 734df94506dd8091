"""The command line: one file a command, and what several of them share."""

from unconstrain.cli.app import main

__all__ = ["main"]
