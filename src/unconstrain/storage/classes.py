"""The closed list of classes that files may hold, and what is checked of them once they are restored.

A file holds a name such as ``unconstrain.NormalizedRBF`` or ``sklearn.Pipeline``: the distribution and the class,
whatever module the class lives in. The name only chooses from the lists below; no module is ever imported, and nothing
looked up, by a name that a file holds. A class belongs here if its state is data and its methods do with it what they
say, however the state was made up.
"""

import math
from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from typing import Any

_HOMES: Mapping[str, tuple[str, ...]] = {
    "unconstrain.policies.parametric": ("ParametricPolicy",),
    "unconstrain.policies.regressor": ("RegressorPolicy",),
    "unconstrain.policies.locally_linear": ("LocallyLinearPolicy",),
    "unconstrain.policies.network": ("TorchPolicy",),
    "unconstrain.networks.inferring": ("Candidate",),
    "unconstrain.networks.model": ("NetworkModel",),
    "unconstrain.policies.gaussian_process": ("GaussianProcessPolicy",),
    "unconstrain.gaussian_process.kernels": ("CurlFree", "CurlFreeQuadratic", "Separable"),
    "unconstrain.gaussian_process.model": ("GaussianProcessModel",),
    "unconstrain.gaussian_process.process": ("Process",),
    "unconstrain.features.full": ("FullFeatures",),
    "unconstrain.features.decoupled": ("DecoupledFeatures",),
    "unconstrain.features.potential": ("PotentialFeatures",),
    "unconstrain.features.rbf": ("NormalizedRBF",),
    "unconstrain.features.scaling": ("Scaling",),
    "unconstrain.fitting.moments": ("Moments",),
    "unconstrain.fitting.solve": ("EpisodeFolds",),
    "unconstrain.fitting.sums": ("Sums",),
    "unconstrain.fitting.global_model": ("GlobalModel",),
    "unconstrain.fitting.local_models": ("LocalModels",),
    "unconstrain.fitting.accumulator": ("Accumulator", "Record", "Solution"),
    "unconstrain.fitting.chain": ("Chain", "Counts"),
    "unconstrain.fitting.contact": ("Belief", "Tally"),
    "unconstrain.fitting.corrected": ("CorrectedMoments",),
    "unconstrain.fitting.drift": ("Drift", "Drifts"),
    "unconstrain.fitting.in_space": ("InSpace", "LinearInSpace"),
    "unconstrain.fitting.inference": ("Inference", "Run"),
    "unconstrain.fitting.noise": ("Noise", "Squares"),
    "unconstrain.fitting.region": ("Region",),
    "unconstrain.fitting.observation": ("AlongMotion", "Expanded", "Projected"),
    "unconstrain.fitting.wide.held": ("HeldSamples", "Piece"),
    "unconstrain.fitting.regression": ("Regressed", "Regression", "Trend"),
    "unconstrain.constraints.learnt.constant": ("ConstantConstraint",),
    "unconstrain.constraints.learnt.feature": ("FeatureConstraint",),
    "unconstrain.constraints.learnt.jacobian": ("JacobianFeatures",),
    "unconstrain.constraints.learnt.mechanism": ("MechanismConstraint",),
    "unconstrain.recordings.columns": ("Columns",),
    "unconstrain.recordings.preparation": ("Preparation",),
    "unconstrain.spaces.angle": ("Angle",),
    "unconstrain.spaces.numbers": ("Numbers",),
    "unconstrain.spaces.phased": ("Phased",),
    "unconstrain.spaces.product": ("Pose", "Product"),
    "unconstrain.spaces.rotation": ("Rotation",),
    "unconstrain.spaces.second_order": ("SecondOrder",),
    "unconstrain.stability.cycle": ("Cycle",),
    "unconstrain.stability.lyapunov": ("Lyapunov",),
    "unconstrain.stability.stabilizing": ("Stability",),
    "sklearn.compose": ("ColumnTransformer",),
    "sklearn.decomposition": ("PCA", "TruncatedSVD"),
    "sklearn.gaussian_process.kernels": (
        "ConstantKernel",
        "DotProduct",
        "ExpSineSquared",
        "Exponentiation",
        "Matern",
        "Product",
        "RBF",
        "RationalQuadratic",
        "Sum",
    ),
    "sklearn.kernel_approximation": ("Nystroem", "RBFSampler"),
    "sklearn.pipeline": ("FeatureUnion", "Pipeline"),
    "sklearn.preprocessing": (
        "Binarizer",
        "FunctionTransformer",
        "KBinsDiscretizer",
        "MaxAbsScaler",
        "MinMaxScaler",
        "Normalizer",
        "OneHotEncoder",
        "PolynomialFeatures",
        "PowerTransformer",
        "QuantileTransformer",
        "RobustScaler",
        "SplineTransformer",
        "StandardScaler",
    ),
}

_MODULES = {f"{home.partition('.')[0]}.{name}": home for home, names in _HOMES.items() for name in names}

_CIRCUMSTANCES = ("memory", "n_jobs")
"""Attributes of scikit-learn's that say where and by how many a thing is computed: a file must not choose those."""

LARGEST_EXPANSION = 10**6
"""How many columns a transformer may make of one state, at most."""
MOST_FOLDS = 1000
COARSEST = 1000


def names() -> tuple[str, ...]:
    """List the names of all classes that files may hold."""
    return tuple(_MODULES)


@cache
def class_of(name: str) -> type | None:
    """Find the class of a name.

    Parameters
    ----------
    name : str

    Returns
    -------
    type or None
        None where the list does not have the name.
    """
    if name not in _MODULES:
        return None
    found: type = getattr(import_module(_MODULES[name]), name.partition(".")[2])
    return found


def name_of(kind: type) -> str | None:
    """Find the name under which files hold objects of a class.

    Parameters
    ----------
    kind : type
        The class.

    Returns
    -------
    str or None
        None where the list does not have the class.
    """
    name = f"{kind.__module__.partition('.')[0]}.{kind.__qualname__}"
    return name if class_of(name) is kind else None


def without_circumstances(name: str, state: Any) -> Any:
    """Take from a state what says where, and by how many processes, a thing is computed.

    Parameters
    ----------
    name : str
        Of the class.
    state : object
        What `__getstate__` returned.

    Returns
    -------
    object
    """
    if not (name.startswith("sklearn.") and isinstance(state, dict)):
        return state
    return {key: None if key in _CIRCUMSTANCES else value for key, value in state.items()}


def check_restored(made: Any) -> None:
    """Check what an object's methods take for granted, and would run out of time or memory without.

    Parameters
    ----------
    made : object
        Of a listed class, just restored.

    Raises
    ------
    ValueError
        Its state cannot be that of a fitted object.
    """
    check = _CHECKS.get(type(made).__name__)
    if check is not None and not check(vars(made)):
        raise ValueError(f"the state of a {type(made).__name__} is not one it can have")


_POLYNOMIALS = ("n_features_in_", "_min_degree", "_max_degree", "_n_out_full", "n_output_features_")


def _plausible_polynomials(state: Mapping[str, Any]) -> bool:
    fitted: list[Any] = [state.get(name) for name in _POLYNOMIALS]
    if all(each is None for each in fitted):
        return True
    if not all(type(each) is int for each in fitted):
        return False
    n, least, degree, *columns = fitted
    # Where both are more than this, the number of columns is too large even to be computed.
    if min(n, degree) > 20 or not (0 < n <= LARGEST_EXPANSION and 0 <= least <= degree <= LARGEST_EXPANSION):
        return False
    return max(columns) <= math.comb(n + degree, degree) <= LARGEST_EXPANSION


def _plausible_splines(state: Mapping[str, Any]) -> bool:
    if "bsplines_" not in state:
        return True
    splines = state["bsplines_"]
    (k,) = {spline.c.shape[1] for spline in splines}
    columns = len(splines) * (k if state["include_bias"] else k - 1)
    return bool(state["n_features_in_"] == len(splines) and state["n_features_out_"] == columns)


def _plausible_folds(state: Mapping[str, Any]) -> bool:
    n_folds = state["n_folds"]
    return (
        type(n_folds) is int
        and 0 < n_folds <= MOST_FOLDS
        and set(state["fold_of"].values()) <= set(range(n_folds))
    )


def _plausible_corrected(state: Mapping[str, Any]) -> bool:
    along, whole, known, d = (state[name] for name in ("along", "whole", "known", "n_actions"))
    parts = [along, whole] if known is None else [along, whole, known]
    (*batch, P, one), (*others, M, K) = along.g.shape, whole.g.shape
    return (
        type(d) is int
        and d > 0
        and type(state["total_weight"]) is float
        and one == 1
        and (M, K) in ((P, 1), (P / d, d))
        and batch == others
        and state["n_numbers"].shape == along.squares.shape
        and (known is None or known.g.shape == along.g.shape)
        and len({part.everywhere is None for part in parts}) == 1
    )


def _plausible_region(state: Mapping[str, Any]) -> bool:
    unit, boxes, coarseness = (state[name] for name in ("unit", "boxes", "coarseness"))
    return (
        type(coarseness) is int
        and 0 <= coarseness <= COARSEST
        and boxes.ndim == 2
        and len(boxes) > 0
        and unit.shape == boxes.shape[1:]
        and bool((unit > 0).all())
        and all(math.isfinite(each.sum()) for each in (unit, boxes))
    )


_CHECKS: Mapping[str, Callable[[Mapping[str, Any]], bool]] = {
    "CorrectedMoments": _plausible_corrected,
    "EpisodeFolds": _plausible_folds,
    "PolynomialFeatures": _plausible_polynomials,
    "Region": _plausible_region,
    "SplineTransformer": _plausible_splines,
}
