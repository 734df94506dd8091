"""Pictures of policies, movements, constraints and of what recordings determine, on matplotlib.

Functions that draw one picture take `ax=` and return the axes; functions whose name ends in `_figure` compose several
of them and return a figure, as the command line saves it with `save`. matplotlib is imported when a picture is drawn.

The colours are those of Okabe and Ito, which stay apart for colour-blind readers and in greyscale.
"""

from typing import TYPE_CHECKING

from unconstrain.lazy import attach
from unconstrain.plot.saving import check_suffix, save

if TYPE_CHECKING:
    from unconstrain.plot.constraints import constraint, constraint_figure, shares_of_motion
    from unconstrain.plot.diagnostics import identifiability_figure, standard_deviation
    from unconstrain.plot.policies import agreement, comparison, field, policy, policy_figure
    from unconstrain.plot.trajectories import rollout_figure, trajectory

__all__ = [
    "agreement",
    "check_suffix",
    "comparison",
    "constraint",
    "constraint_figure",
    "field",
    "identifiability_figure",
    "policy",
    "policy_figure",
    "rollout_figure",
    "save",
    "shares_of_motion",
    "standard_deviation",
    "trajectory",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "unconstrain.plot.constraints": ("constraint", "constraint_figure", "shares_of_motion"),
        "unconstrain.plot.diagnostics": ("identifiability_figure", "standard_deviation"),
        "unconstrain.plot.policies": ("agreement", "comparison", "field", "policy", "policy_figure"),
        "unconstrain.plot.trajectories": ("rollout_figure", "trajectory"),
    },
)
