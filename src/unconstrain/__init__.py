"""Learn the policy behind constrained demonstrations.

Everything below is imported when it is first used, so that importing the package costs next to nothing.

>>> import unconstrain as uc
>>> demos = uc.load("wipe.csv", state=["x", "y", "z"], time="t", episode="run")   # doctest: +SKIP
>>> policy = uc.LocallyLinearPolicy()                                               # doctest: +SKIP
>>> policy.fit(demos)                                                               # doctest: +SKIP
"""

from unconstrain import lazy

TYPE_CHECKING = False  # as in typing, whose import would cost more than all else here

if TYPE_CHECKING:
    from unconstrain import (
        constraints,
        datasets,
        errors,
        features,
        metrics,
        plot,
        robots,
        spaces,
        torch,
        viewer,
    )
    from unconstrain.constraints.learnt import (
        ConstantConstraint,
        ConstraintChain,
        FeatureConstraint,
        MechanismConstraint,
        NullspaceComponent,
        load_constraint,
    )
    from unconstrain.demonstrations import Demonstrations
    from unconstrain.diagnostics import identifiability
    from unconstrain.evaluation import Evaluation, evaluate
    from unconstrain.features import DecoupledFeatures, NormalizedRBF, PotentialFeatures
    from unconstrain.fitting import moments
    from unconstrain.gaussian_process import kernels
    from unconstrain.policies import (
        GaussianProcessPolicy,
        LocallyLinearPolicy,
        ParametricPolicy,
        RegressorPolicy,
        TorchPolicy,
        load_compiled,
        load_policy,
    )
    from unconstrain.recordings import Columns, Inspection, Preparation, Recordings, inspect, load, open
    from unconstrain.scaling import cluster as distributed
    from unconstrain.scaling.stream import fit_stream
    from unconstrain.selection import select_policy
    from unconstrain.viewer import view
    from unconstrain.waiting import verbose

    __version__: str

__all__ = [
    "Columns",
    "ConstantConstraint",
    "ConstraintChain",
    "DecoupledFeatures",
    "Demonstrations",
    "Evaluation",
    "FeatureConstraint",
    "GaussianProcessPolicy",
    "Inspection",
    "LocallyLinearPolicy",
    "MechanismConstraint",
    "NormalizedRBF",
    "NullspaceComponent",
    "ParametricPolicy",
    "PotentialFeatures",
    "Preparation",
    "Recordings",
    "RegressorPolicy",
    "TorchPolicy",
    "constraints",
    "datasets",
    "distributed",
    "errors",
    "evaluate",
    "features",
    "fit_stream",
    "identifiability",
    "inspect",
    "kernels",
    "load",
    "load_compiled",
    "load_constraint",
    "load_policy",
    "metrics",
    "moments",
    "open",
    "plot",
    "robots",
    "select_policy",
    "spaces",
    "torch",
    "verbose",
    "view",
    "viewer",
]

_HOMES = {
    "unconstrain.constraints.learnt": (
        "ConstantConstraint",
        "ConstraintChain",
        "FeatureConstraint",
        "MechanismConstraint",
        "NullspaceComponent",
        "load_constraint",
    ),
    "unconstrain.demonstrations": ("Demonstrations",),
    "unconstrain.diagnostics": ("identifiability",),
    "unconstrain.evaluation": ("Evaluation", "evaluate"),
    "unconstrain.features": ("DecoupledFeatures", "NormalizedRBF", "PotentialFeatures"),
    "unconstrain.policies": (
        "GaussianProcessPolicy",
        "LocallyLinearPolicy",
        "ParametricPolicy",
        "RegressorPolicy",
        "TorchPolicy",
        "load_compiled",
        "load_policy",
    ),
    "unconstrain.recordings": (
        "Columns",
        "Inspection",
        "Preparation",
        "Recordings",
        "inspect",
        "load",
        "open",
    ),
    "unconstrain.scaling.stream": ("fit_stream",),
    "unconstrain.selection": ("select_policy",),
    "unconstrain.version": ("__version__",),
    "unconstrain.viewer": ("view",),
    "unconstrain.waiting": ("verbose",),
}

_NAMESPACES = {
    "constraints": "unconstrain.constraints",
    "datasets": "unconstrain.datasets",
    "distributed": "unconstrain.scaling.cluster",
    "errors": "unconstrain.errors",
    "features": "unconstrain.features",
    "kernels": "unconstrain.gaussian_process.kernels",
    "metrics": "unconstrain.metrics",
    "moments": "unconstrain.fitting.moments",
    "plot": "unconstrain.plot",
    "robots": "unconstrain.robots",
    "spaces": "unconstrain.spaces",
    "torch": "unconstrain.torch",
    "viewer": "unconstrain.viewer",
}

if not TYPE_CHECKING:  # a checker that sees __getattr__ takes any name for one of ours
    __getattr__, __dir__ = lazy.attach(__name__, _HOMES, _NAMESPACES)
