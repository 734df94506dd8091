"""Policies linear in their parameters, seen along a direction."""

from unconstrain.features.base import PolicyFeatures
from unconstrain.features.decoupled import DecoupledFeatures
from unconstrain.features.full import FullFeatures
from unconstrain.features.potential import PotentialFeatures
from unconstrain.features.rbf import NormalizedRBF

__all__ = ["DecoupledFeatures", "FullFeatures", "NormalizedRBF", "PolicyFeatures", "PotentialFeatures"]
