"""The command line: `unconstrain demo | fit | evaluate | rollout | reproduce`."""

from unconstrain.cli.app import main

__all__ = ["main"]
