"""Constraints found in the actions themselves, where none were measured.

What is constrained does not move: rows ``A(x)`` with ``A(x) u = 0`` for all recorded ``(x, u)`` under one constraint
are directions the actions never take. `ConstantConstraint` looks for them once for all states, `FeatureConstraint` for
rows linear in features of the state, among them the rows of a task Jacobian, and `MechanismConstraint` for a hinge, a
drawer or a surface in the positions. Where the constraint is itself a task
that moves, ``u = A⁺b + N π``, `NullspaceComponent` first separates what stays from what varies. `ConstraintChain` does
all of it, and learns the policy with the projections found.

What a person chose not to do looks the same as what could not be done: no method here can tell the two apart, and one
movement repeated over and over is "constrained" in all directions but its own.
"""

from unconstrain.constraints.learnt.base import load_constraint
from unconstrain.constraints.learnt.chain import ConstraintChain
from unconstrain.constraints.learnt.component import NullspaceComponent
from unconstrain.constraints.learnt.constant import ConstantConstraint
from unconstrain.constraints.learnt.feature import FeatureConstraint
from unconstrain.constraints.learnt.mechanism import MechanismConstraint

__all__ = [
    "ConstantConstraint",
    "ConstraintChain",
    "FeatureConstraint",
    "MechanismConstraint",
    "NullspaceComponent",
    "load_constraint",
]
