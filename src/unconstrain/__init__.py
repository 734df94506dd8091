"""Learn the policy behind constrained demonstrations.

>>> import unconstrain as uc
>>> demos = uc.load("wipe.csv", state=["x", "y", "z"], time="t", episode="run")   # doctest: +SKIP
>>> policy = uc.LocallyLinearPolicy(alpha="cv")                                     # doctest: +SKIP
>>> policy.fit(demos.states, demos.actions, groups=demos.episodes)                  # doctest: +SKIP
"""

from importlib.metadata import version

from unconstrain import constraints, distributed, errors, features, moments, risk
from unconstrain.comparison import select_policy
from unconstrain.demonstrations import Demonstrations
from unconstrain.features import DecoupledFeatures, NormalizedRBF, PotentialFeatures
from unconstrain.identifiability import identifiability
from unconstrain.learnt_constraints import (
    ConstantConstraint,
    ConstraintChain,
    FeatureConstraint,
    NullspaceComponent,
    load_constraint,
)
from unconstrain.policies import LocallyLinearPolicy, ParametricPolicy, load_compiled, load_policy
from unconstrain.readers import load, save
from unconstrain.stream import fit_stream

__version__ = version("unconstrain")

__all__ = [
    "ConstantConstraint",
    "ConstraintChain",
    "DecoupledFeatures",
    "Demonstrations",
    "FeatureConstraint",
    "LocallyLinearPolicy",
    "NormalizedRBF",
    "NullspaceComponent",
    "ParametricPolicy",
    "PotentialFeatures",
    "constraints",
    "distributed",
    "errors",
    "features",
    "fit_stream",
    "identifiability",
    "load",
    "load_compiled",
    "load_constraint",
    "load_policy",
    "moments",
    "risk",
    "save",
    "select_policy",
]
