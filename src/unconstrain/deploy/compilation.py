"""From a fitted policy to arrays: which kind of compiled policy it is, and a check that the two agree."""

from math import factorial

import numpy as np
from scipy.interpolate import BSpline
from sklearn.preprocessing import SplineTransformer
from sklearn.utils.validation import check_is_fitted

from unconstrain.deploy.compiled import (
    Additive,
    CompiledPolicy,
    Linear,
    LocallyLinear,
    Potential,
    RadialBasis,
)
from unconstrain.errors import PolicyError
from unconstrain.features import DecoupledFeatures, FullFeatures, NormalizedRBF, PotentialFeatures

AGREEMENT = 1e-12
"""How far the compiled policy may be from `predict`, as a share of the largest term either adds up."""

N_CHECKED = 64
EXTRAPOLATIONS = ("linear", "constant", "continue")


def compile_policy(policy) -> CompiledPolicy:
    """What `policy.compile()` returns: the fitted policy as arrays, found to agree with `predict`.

    Raises `PolicyError` for features that cannot be compiled, and where the two do not agree.
    """
    check_is_fitted(policy)
    step = _compiled(policy)
    _validate(policy, step)
    return step


def _compiled(policy) -> CompiledPolicy:
    features = policy.features_
    if hasattr(policy, "centers_"):
        return LocallyLinear(
            centers=policy.centers_, width=policy.width_, coef=policy.coef_, intercept=policy.intercept_
        )
    w = policy.weights_
    if isinstance(features, DecoupledFeatures):
        n = features.n_actions_
        coefficients = np.zeros((n, w.size // n, n))
        own = w.reshape(n, -1) @ features.to_coefficients_.T
        coefficients[np.arange(n), :, np.arange(n)] = own
        return Additive(**_polynomials(features.splines_, coefficients))
    if isinstance(features, PotentialFeatures):
        return _potential(features.transformer_, w)
    if isinstance(features, FullFeatures):
        basis, W = features.transformer_, w.reshape(features.n_actions_, -1)
        if basis is None:
            return Linear(coef=W[:, :-1], intercept=W[:, -1])
        if isinstance(basis, NormalizedRBF):
            return RadialBasis(centers=basis.centers_, width=basis.width_, weights=W)
        if isinstance(basis, SplineTransformer):
            if basis.degree < 2 and basis.extrapolation == "linear" and len(basis.bsplines_) > 1:
                raise PolicyError(
                    "scikit-learn (as of 1.9) gets splines of degree 0 or 1 with linear extrapolation wrong in all but "
                    "the first dimension, so they are not compiled: fit with degree 2 or more"
                )
            return Additive(**_polynomials(basis, W.T.reshape(len(basis.bsplines_), -1, len(W))))
        features = basis
    raise _unknown(features)


def _potential(basis, w: np.ndarray) -> CompiledPolicy:
    if isinstance(basis, NormalizedRBF):
        return Potential(centers=basis.centers_, width=basis.width_, weights=w)
    if not isinstance(basis, SplineTransformer):
        raise _unknown(basis)
    n = len(basis.bsplines_)
    heights = _polynomials(basis, w.reshape(n, -1, 1))
    order = heights["polynomials"].shape[2]
    slopes = heights["polynomials"][:, :, 1:, 0] * np.arange(1, order)
    down = np.zeros((*slopes.shape, n))
    down[np.arange(n), :, :, np.arange(n)] = -slopes
    return Additive(**{**heights, "polynomials": down})


def _unknown(features) -> PolicyError:
    return PolicyError(
        "linear, NormalizedRBF, SplineTransformer, decoupled, potential (of RBFs or splines) and locally linear "
        f"policies can be compiled, one with {type(features).__name__} features cannot: use predict, or one of those"
    )


def _polynomials(splines: SplineTransformer, coefficients: np.ndarray) -> dict[str, np.ndarray]:
    """The splines with coefficients (n, k, d) as polynomials between breaks, outer pieces by their extrapolation."""
    if splines.extrapolation not in EXTRAPOLATIONS:
        raise PolicyError(
            f"splines with extrapolation={splines.extrapolation!r} cannot be compiled: use one of "
            f"{', '.join(map(repr, EXTRAPOLATIONS))}"
        )
    breaks, origins, polynomials = [], [], []
    for spline, own in zip(splines.bsplines_, coefficients, strict=True):
        knots, degree = spline.t, spline.k
        if not splines.include_bias:
            own = np.vstack([own, np.zeros((1, own.shape[1]))])
        whole = BSpline(knots, own, degree)
        edges = knots[degree : len(knots) - degree]
        starts = edges[:-1]
        taylor = [whole(starts, nu=p) / factorial(p) for p in range(degree + 1)]
        pieces = np.stack(taylor, axis=1)  # (K-1, p, d)
        if splines.extrapolation == "continue":
            outer, outer_origins = pieces[[0, -1]], starts[[0, -1]]
        else:
            outer, outer_origins = np.zeros((2, *pieces.shape[1:])), edges[[0, -1]]
            outer[:, 0] = whole(outer_origins)
            if splines.extrapolation == "linear" and degree > 0:
                outer[:, 1] = whole(outer_origins, nu=1)
        # The last edge itself still belongs to the last spline.
        breaks.append(np.r_[edges[:-1], np.nextafter(edges[-1], np.inf)])
        origins.append(np.r_[outer_origins[0], starts, outer_origins[1]])
        polynomials.append(np.concatenate([outer[:1], pieces, outer[1:]]))
    return {"breaks": np.array(breaks), "origins": np.array(origins), "polynomials": np.array(polynomials)}


def _validate(policy, step: CompiledPolicy) -> None:
    """Compare with `predict` at random states where the policy was learnt, one by one and as a batch."""
    rng = np.random.default_rng(0)
    X = rng.standard_normal((N_CHECKED, step.n_states))
    if "centers" in step.arrays:
        centers, width = step.arrays["centers"], step.arrays["width"]
        X = centers[rng.integers(len(centers), size=N_CHECKED)] + width * X
    elif "breaks" in step.arrays:
        low, high = step.arrays["breaks"][:, 0], step.arrays["breaks"][:, -1]
        X = low + (high - low) * rng.uniform(-0.2, 1.2, size=X.shape)
    expected = policy.predict(X).reshape(N_CHECKED, -1)
    tolerance = AGREEMENT * max(step.magnitude(X), np.abs(expected).max())
    single = np.array([step(x) for x in X])
    off = max(np.abs(step(X) - expected).max(), np.abs(single - expected).max())
    if not off <= tolerance:
        raise PolicyError(
            f"the compiled policy is {off:.2g} from predict, where {tolerance:.2g} is what rounding explains: "
            "fit with a larger alpha, or report this"
        )
