"""What was learnt, to be looked at: files for Rerun's viewer."""

from typing import TYPE_CHECKING

from unconstrain.lazy import attach

if TYPE_CHECKING:
    from unconstrain.viewer.rerun_log import log_rerun

__all__ = ["log_rerun"]

__getattr__, __dir__ = attach(__name__, {"unconstrain.viewer.rerun_log": ("log_rerun",)})
