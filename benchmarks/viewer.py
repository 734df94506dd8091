"""How long the page takes from a start that is dragged to the rollout that follows it, without the browser.

The yardstick is a thirtieth of a second: 30 rollouts a second are as many as an eye takes for a movement.
"""

from collections.abc import Callable

import numpy as np

import unconstrain as uc
from benchmarks.ratio import Ratio, medians
from unconstrain import limit_cycle as toy
from unconstrain.viewer.obstacles import BOTH, NOTHING

FRAME = 1.0 / 30.0
PLACES = 40
SECONDS = 3.0


def drag_freely() -> Ratio:
    """Drag the start of a policy of 50 local models."""
    return _drag("view-drag", "a start dragged, 50 local models, 150 steps", NOTHING)


def drag_among_barriers() -> Ratio:
    """Drag it with a plane and a box in the way."""
    return _drag("view-drag-barriers", "the same, a plane and a box in the way", BOTH)


def _drag(name: str, work: str, in_the_way: str) -> Ratio:
    demos = toy.demonstrate(40, random_state=0)
    policy = uc.LocallyLinearPolicy(n_centers=50, alpha=1e-6, risk="inconsistency").fit(demos)
    page = uc.view(policy, demos, port=0)
    page.set_seconds(SECONDS)
    page.put_in_the_way(in_the_way)
    page.settle()
    angles = np.linspace(0.0, 2 * np.pi, PLACES)
    circle = 0.7 * np.stack([np.cos(angles), np.sin(angles), np.zeros(PLACES)], axis=1)

    def drag() -> None:
        for point in circle:
            page.start.drag_to(point)
            page.settle()

    (ours,) = medians(drag, repeats=5)
    page.close()
    return Ratio(name, work, "a thirtieth of a second", ours / PLACES / FRAME, 1.0, ours / PLACES, FRAME)


BENCHMARKS: dict[str, Callable[[], Ratio]] = {
    "view-drag": drag_freely,
    "view-drag-barriers": drag_among_barriers,
}
