"""The page in the browser: movements, the learnt field, and a rollout that follows a start that is dragged.

opening.py      the function `view`: checks, server, page
page.py         the page and its life: url, wait(), close()
server.py       viser, started on a port of this computer
stage.py        what all parts of the page share
coordinates.py  which of the states are shown, and how actions move them
hand.py         the place of a robot's hand instead, by forward kinematics
frame.py        from what is shown to places in the scene
samples.py      which samples are shown, and how surely each was free
movements.py, arrows.py, streams.py, diagnosis.py, obstacles.py, start.py, path.py   what is drawn, a part each
camera.py      where it is looked at from
surroundings.py grid, ticks and names of the axes
palette.py      what the colours stand for
legend.py       what the page says in words
sureness.py     how sure the policy is: from 0, where nothing was recorded, to 1
following.py    the rollout from a start
barriers.py     a plane and a box as constraints of the rollout
newest.py       a thread that works on the newest of what it is given
timeline.py     play, pause, speed
exporting.py    picture and rollout as files
controls.py     what is shown, by checkboxes and dropdowns

robot_scene.py, shapes.py   a robot in viser's scene, moved by its joints
rerun_log.py, rerun_entities.py, rerun_layout.py   the same for Rerun's viewer, as a file
"""

from typing import TYPE_CHECKING

from unconstrain import lazy

if TYPE_CHECKING:
    from unconstrain.viewer.opening import view
    from unconstrain.viewer.page import Page
    from unconstrain.viewer.rerun_log import log_rerun
    from unconstrain.viewer.robot_scene import RobotScene

__all__ = ["Page", "RobotScene", "log_rerun", "view"]

_HOMES = {
    "unconstrain.viewer.opening": ("view",),
    "unconstrain.viewer.page": ("Page",),
    "unconstrain.viewer.rerun_log": ("log_rerun",),
    "unconstrain.viewer.robot_scene": ("RobotScene",),
}

if not TYPE_CHECKING:  # a checker that sees __getattr__ takes any name for one of ours
    __getattr__, __dir__ = lazy.attach(__name__, _HOMES)
