"""Robots from MJCF or URDF files, and constraints on what their hands may do."""

from typing import TYPE_CHECKING

from unconstrain import lazy

if TYPE_CHECKING:
    from unconstrain.errors import RobotError
    from unconstrain.robots.hand import HandFeatures
    from unconstrain.robots.robot import Robot
    from unconstrain.robots.simulator import import_mujoco
    from unconstrain.robots.task import TaskConstraint

__all__ = ["HandFeatures", "Robot", "RobotError", "TaskConstraint", "import_mujoco"]

_HOMES = {
    "unconstrain.errors": ("RobotError",),
    "unconstrain.robots.hand": ("HandFeatures",),
    "unconstrain.robots.robot": ("Robot",),
    "unconstrain.robots.simulator": ("import_mujoco",),
    "unconstrain.robots.task": ("TaskConstraint",),
}

if not TYPE_CHECKING:  # a checker that sees __getattr__ takes any name for one of ours
    __getattr__, __dir__ = lazy.attach(__name__, _HOMES)
