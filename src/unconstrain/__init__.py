"""Learn the policy behind constrained demonstrations.

>>> import unconstrain as uc
>>> demos = uc.load("wipe.csv", state=["x", "y", "z"], time="t", episode="run")   # doctest: +SKIP
>>> policy = uc.LocallyLinearPolicy(alpha="cv")                                     # doctest: +SKIP
>>> policy.fit(demos.states, demos.actions, groups=demos.episodes)                  # doctest: +SKIP
"""

from importlib.metadata import version

from unconstrain import constraints, errors, features
from unconstrain import metrics as risk
from unconstrain.constraints.learnt import (
    ConstantConstraint,
    ConstraintChain,
    FeatureConstraint,
    NullspaceComponent,
    load_constraint,
)
from unconstrain.demonstrations import Demonstrations
from unconstrain.diagnostics import identifiability
from unconstrain.features import DecoupledFeatures, NormalizedRBF, PotentialFeatures
from unconstrain.fitting import moments
from unconstrain.policies import LocallyLinearPolicy, ParametricPolicy, load_compiled, load_policy
from unconstrain.recordings import load, save
from unconstrain.scaling import cluster as distributed
from unconstrain.scaling.stream import fit_stream
from unconstrain.selection import select_policy

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
