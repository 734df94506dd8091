"""The experiments there are, and what they have in common."""

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from unconstrain.errors import UnconstrainError

if TYPE_CHECKING:
    from rich.console import Console

    from reproduction.outcome import Outcome

EXPERIMENTS = {
    "finger": "The idea, on a finger that meets an obstacle (Fig. 1).",
    "toy": "A limit cycle in the plane (Figs. 3 and 4).",
    "arm": "A 7-DOF arm whose hand is constrained (Table I).",
    "grasp": "A humanoid reaches for a ball through a gap (Table II, Figs. 5 and 6).",
    "posture": "27 joints, and a wall in the way of the hands (Sec. IV-D).",
    "constraints": "Constraints learnt, measured and used.",
    "identifiability": "What recordings cannot tell.",
    "adaptive": "Which samples were free, inferred.",
    "regressors": "Regressors of others, wrapped as they are.",
}
"""In the order of the report."""

RECORDED = {"constraints": "recordings", "identifiability": "recordings", "adaptive": "data"}
"""Those that also look at recordings, where they are given, and the option that names their folder."""


class Reproduce(Protocol):
    """The function of that name in every experiment's module `experiment`."""

    def __call__(
        self, out: Path, *, trials: int | None = None, jobs: int = 1, console: "Console", **options: Any
    ) -> "Outcome":
        """Run the experiment, and write its results into the folder `out`.

        Finished trials are kept there, and a later call goes on from them. Without `trials` there are as many as
        published. `options` are the experiment's own.
        """


def find_experiment(name: str) -> Reproduce:
    """Return what runs the experiment of this name. Raises `UnconstrainError` if there is none."""
    if name not in EXPERIMENTS:
        raise UnconstrainError(
            f"there is no experiment {name!r}: choose one of {', '.join(EXPERIMENTS)}, or all"
        )
    return importlib.import_module(f"reproduction.{name}.experiment").reproduce
