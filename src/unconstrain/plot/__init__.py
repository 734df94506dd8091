"""Pictures of policies, movements, contact, constraints and of what recordings determine, on matplotlib.

Each function draws one picture, takes `ax=` and returns the axes; without `ax` it makes new ones. `save` writes a
figure, as the command line does. matplotlib is imported when a picture is drawn.

Pictures of two states are to one scale where both have the same unit. Units are taken from names such as "x [m]", and
of angles from the space of the states.

The colours are those of Okabe and Ito, which stay apart for colour-blind readers and in greyscale.
"""

from typing import TYPE_CHECKING

from unconstrain.lazy import attach
from unconstrain.plot.saving import save

if TYPE_CHECKING:
    from unconstrain.plot.constraints import constraint
    from unconstrain.plot.contacts import contact
    from unconstrain.plot.diagnostics import identifiability
    from unconstrain.plot.movements import demonstrations, rollout
    from unconstrain.plot.policies import comparison, policy

__all__ = [
    "comparison",
    "constraint",
    "contact",
    "demonstrations",
    "identifiability",
    "policy",
    "rollout",
    "save",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "unconstrain.plot.constraints": ("constraint",),
        "unconstrain.plot.contacts": ("contact",),
        "unconstrain.plot.diagnostics": ("identifiability",),
        "unconstrain.plot.movements": ("demonstrations", "rollout"),
        "unconstrain.plot.policies": ("comparison", "policy"),
    },
)
