"""Which mechanism recordings moved under: a drawer, a hinge, a plane, a sphere, a cylinder, or none."""

from unconstrain.constraints.mechanisms.finding import find_mechanism
from unconstrain.constraints.mechanisms.mechanism import Candidate, Mechanism
from unconstrain.constraints.mechanisms.shapes import Shape

__all__ = ["Candidate", "Mechanism", "Shape", "find_mechanism"]
