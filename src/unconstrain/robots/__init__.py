"""Robots described by MJCF or URDF, and the constraints that their tasks impose."""

from typing import TYPE_CHECKING

from unconstrain import lazy

if TYPE_CHECKING:
    from unconstrain.robots.robot import Robot, RobotError
    from unconstrain.robots.task import TaskConstraint

__all__ = ["Robot", "RobotError", "TaskConstraint"]

_HOMES = {
    "unconstrain.robots.robot": ("Robot", "RobotError"),
    "unconstrain.robots.task": ("TaskConstraint",),
}

if not TYPE_CHECKING:  # a checker that sees __getattr__ takes any name for one of ours
    __getattr__, __dir__ = lazy.attach(__name__, _HOMES)
