"""From what is known of constraints to the projections that realise them.

A constraint says which directions of action are impossible: the rows of ``A`` satisfy ``A u = 0``. What is
left of a policy under it is ``u = N π(x)``, with ``N = I - A⁺A`` the projection onto the nullspace of ``A``.

`projection` takes the rows themselves; `from_normals`, `from_jacobian`, `from_forces` and `from_flags` start from what
is measured. Where a sample's constraint is not known its projection is all NaN, and ``policy.fit(X, U,
projections=N)`` learns from that sample what its direction of motion says. Constraints that are found in the actions
themselves are in `unconstrain.constraints.learnt`.
"""

from unconstrain.constraints.contacts import contact
from unconstrain.constraints.forces import from_forces
from unconstrain.constraints.measured import first_known, from_flags, from_jacobian, from_normals
from unconstrain.constraints.mechanisms import Mechanism, find_mechanism
from unconstrain.constraints.nullspace import (
    NEGLIGIBLE_ROW,
    RANK_TOLERANCE,
    combine,
    projection,
    unconstrained,
)
from unconstrain.constraints.recorded import from_recording

__all__ = [
    "NEGLIGIBLE_ROW",
    "RANK_TOLERANCE",
    "Mechanism",
    "combine",
    "contact",
    "find_mechanism",
    "first_known",
    "from_flags",
    "from_forces",
    "from_jacobian",
    "from_normals",
    "from_recording",
    "projection",
    "unconstrained",
]
