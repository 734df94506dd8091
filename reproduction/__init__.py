"""The paper's experiments, and those that go beyond it: one module each.

Every module has

    reproduce(out: Path, *, trials: int | None = None, jobs: int = 1, console: Console, **options) -> Outcome

which writes into the folder `out`, keeps finished trials there and goes on from them, and takes the published number
of trials where none is given. `options` are the experiment's own (`model`, `physics`, `robot`, `video`, ...).
"""

import importlib
from types import ModuleType

from unconstrain.errors import UnconstrainError

EXPERIMENTS = {
    "finger": "the idea, on a finger that meets an obstacle (Fig. 1)",
    "toy": "a limit cycle in the plane (Figs. 3 and 4)",
    "arm": "a 7-DOF arm, its hand constrained (Table I)",
    "grasp": "a humanoid reaches for a ball through a gap (Table II, Figs. 5 and 6)",
    "posture": "27 joints, a wall in the hands' way (Sec. IV-D)",
    "constraints": "constraints learnt from data",
    "identifiability": "what recordings cannot tell",
}


def experiment(name: str) -> ModuleType:
    """The module of the experiment called `name`. Raises `UnconstrainError` listing those there are."""
    if name not in EXPERIMENTS:
        raise UnconstrainError(
            f"there is no experiment {name!r}: choose one of {', '.join(EXPERIMENTS)}, or all"
        )
    return importlib.import_module(f"{__name__}.{name}")
