"""From what is known of constraints to the projections that realise them.

A constraint says which directions of action are impossible: the rows of ``A`` satisfy ``A u = 0``. What is
left of a policy under it is ``u = N π(x)``, with ``N = I - A⁺A`` the projection onto the nullspace of ``A``.

`projection` takes the rows themselves; `from_normals`, `from_jacobian`, `from_forces`, `from_flags` and
`from_obstacles` start from what is measured. `find_payload`, `find_friction` and `find_stuck` say what of a measured
force is no contact, and `find_mechanism` names the hinge, the drawer or the surface that positions moved along. Where a
sample's constraint is not known its projection is all NaN, and ``policy.fit(X, U, projections=N)`` learns from that
sample what its direction of motion says. Constraints that are found in the actions themselves are in
`unconstrain.constraints.learnt`.
"""

from unconstrain.constraints.contacts import contact
from unconstrain.constraints.forces import from_forces
from unconstrain.constraints.friction import Friction, find_friction
from unconstrain.constraints.measured import first_known, from_flags, from_jacobian, from_normals
from unconstrain.constraints.mechanisms import Mechanism, find_mechanism
from unconstrain.constraints.nullspace import (
    NEGLIGIBLE_ROW,
    RANK_TOLERANCE,
    combine,
    projection,
    unconstrained,
)
from unconstrain.constraints.obstacles import from_obstacles, obstacle_distances
from unconstrain.constraints.payload import Payload, find_payload
from unconstrain.constraints.recorded import from_recording
from unconstrain.constraints.stuck import find_stuck

__all__ = [
    "NEGLIGIBLE_ROW",
    "RANK_TOLERANCE",
    "Friction",
    "Mechanism",
    "Payload",
    "combine",
    "contact",
    "find_friction",
    "find_mechanism",
    "find_payload",
    "find_stuck",
    "first_known",
    "from_flags",
    "from_forces",
    "from_jacobian",
    "from_normals",
    "from_obstacles",
    "from_recording",
    "obstacle_distances",
    "projection",
    "unconstrained",
]
