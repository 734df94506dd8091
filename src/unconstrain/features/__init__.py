"""Policies linear in their parameters, seen along a direction."""

from unconstrain.features.base import PolicyFeatures
from unconstrain.features.full import FullFeatures
from unconstrain.features.rbf import NormalizedRBF

__all__ = ["FullFeatures", "NormalizedRBF", "PolicyFeatures"]
