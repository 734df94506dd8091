"""Policies as scikit-learn estimators."""

from unconstrain.deploy.compiled import CompiledPolicy, load_compiled
from unconstrain.policies.gaussian_process import GaussianProcessPolicy
from unconstrain.policies.locally_linear import LocallyLinearPolicy
from unconstrain.policies.network import TorchPolicy
from unconstrain.policies.parametric import ParametricPolicy
from unconstrain.policies.regressor import RegressorPolicy
from unconstrain.policies.saving import load_policy

__all__ = [
    "CompiledPolicy",
    "GaussianProcessPolicy",
    "LocallyLinearPolicy",
    "ParametricPolicy",
    "RegressorPolicy",
    "TorchPolicy",
    "load_compiled",
    "load_policy",
]
