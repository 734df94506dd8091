"""What is in a recording of any format, found without being told."""

from typing import TYPE_CHECKING

from unconstrain import lazy

if TYPE_CHECKING:
    from unconstrain.recordings.inspection.inspecting import inspect, list_keys
    from unconstrain.recordings.inspection.kinds import ColumnReport
    from unconstrain.recordings.inspection.result import Inspection

__all__ = ["ColumnReport", "Inspection", "inspect", "list_keys"]

_HOMES = {
    "unconstrain.recordings.inspection.inspecting": ("inspect", "list_keys"),
    "unconstrain.recordings.inspection.kinds": ("ColumnReport",),
    "unconstrain.recordings.inspection.result": ("Inspection",),
}

if not TYPE_CHECKING:  # a checker that sees __getattr__ takes any name for one of ours
    __getattr__, __dir__ = lazy.attach(__name__, _HOMES)
