"""Policies as scikit-learn estimators."""

from unconstrain.policies.locally_linear import LocallyLinearPolicy
from unconstrain.policies.parametric import ParametricPolicy
from unconstrain.policies.persistence import load_policy

__all__ = ["LocallyLinearPolicy", "ParametricPolicy", "load_policy"]
