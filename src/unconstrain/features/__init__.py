"""Feature maps: policies that are linear in their parameters."""

from unconstrain.features.base import Compilable, Features, FullBasis
from unconstrain.features.decoupled import DecoupledFeatures
from unconstrain.features.full import FullFeatures
from unconstrain.features.potential import PotentialFeatures
from unconstrain.features.rbf import NormalizedRBF

__all__ = [
    "Compilable",
    "DecoupledFeatures",
    "Features",
    "FullBasis",
    "FullFeatures",
    "NormalizedRBF",
    "PotentialFeatures",
]
