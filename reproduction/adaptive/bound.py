"""The least error that any unbiased way to learn can have, with projections known and unknown (Cramér and Rao).

With Gaussian noise of variance σ² on the actions, a sample informs about the policy at its state by `Q / σ²`:

| the sample                             | Q                     |
| -------------------------------------- | --------------------- |
| free, and inferred to be               | I                     |
| constrained, its projection unknown    | (‖u‖² / ‖π‖²) û ûᵀ     |
| its projection N is known              | N                     |

with the clean action u. The second is the gradient of the distance of u from the sphere with diameter π, on which all
`N π` lie: `δ = ‖u - π/2‖ - ‖π‖/2`, `∂δ/∂π = -(‖u‖ / ‖π‖) û`. For a policy `π = Φ w` the parameters' covariance is at
least `(Σ ΦᵀQΦ / σ² + I / v)⁻¹`, the error at other states the trace of that behind Φ. Without a prior (v infinite)
features that overlap would have an error of any size. Its variance v is the most probable one of the true policy's own
parameters, if all of it were seen through the same noise (MacKay): smooth policies may need large parameters.

Local models are each fitted alone: each has a bound of its own, with its samples weighted by its receptive field, and
that of the blend is taken to be the blend of theirs. That is no theorem; the ratio of two such bounds is still what
knowing the projections is worth.

What is inferred costs something as well, so where free samples cannot surely be told from others the bound is
optimistic.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unconstrain.demonstrations import Demonstrations
from unconstrain.fitting.model import LinearModel
from unconstrain.fitting.observation import Projected, observe
from unconstrain.fitting.posterior import Posterior

Array = NDArray[np.float64]

ROUNDS = 100
"""Of expectation and maximisation; v enters through `σ² / v` alone, and need not be exact."""


@dataclass(frozen=True)
class Bounds:
    """The bounds of the nUPE on the same data.

    Attributes
    ----------
    unknown : float
        With the projections of constrained samples unknown, and free samples recognised.
    told : float
        With all projections known.
    """

    unknown: float
    told: float


def is_free(projections: Array) -> NDArray[np.bool_]:
    """Find the samples (N,) whose projections (N, d, d) are the identity: of trace d, and of less otherwise."""
    return np.trace(projections, axis1=1, axis2=2) > projections.shape[1] - 0.5


def informative_rows(clean: Demonstrations) -> Array:
    """Compute `Q^½` of samples whose projections are unknown, (N, d, d), from clean actions and the true policy.

    A sample that the constraint holds still has none: it shows that the policy is blocked, and not where it points.
    """
    assert clean.policy is not None
    assert clean.projections is not None
    U, d = clean.actions, clean.actions.shape[1]
    length, whole = (np.linalg.norm(each, axis=1) for each in (U, clean.policy))
    # (‖u‖ / ‖π‖) û = u / ‖π‖: no division by the length of short actions.
    rows = np.zeros((len(U), d, d))
    rows[:, 0] = np.divide(U, whole[:, None], out=np.zeros_like(U), where=(whole > 0)[:, None])
    rows[length == 0] = 0.0
    rows[is_free(clean.projections)] = np.eye(d)
    return rows


def compute_bounds(model: LinearModel, clean: Demonstrations, test: Demonstrations, noise: float) -> Bounds:
    """Compute both bounds of the nUPE.

    Parameters
    ----------
    model : LinearModel
        The features, fitted: `policy.model_`.
    clean : Demonstrations
        What is learnt from, before noise is added, with the true policy and projections.
    test : Demonstrations
        Where the error is measured, with the true policy.
    noise : float
        Standard deviation σ of the noise, in units of the action; above 0.

    Returns
    -------
    Bounds
        As shares of the variance of the true policy, like the nUPE.
    """
    assert clean.policy is not None
    assert clean.projections is not None
    assert test.policy is not None
    prior = find_prior_variance(model, clean.states, clean.policy, noise)
    variance = float(test.policy.var(axis=0).sum())
    unknown, told = (
        _error(model, test.states, _covariance(model, clean.states, rows, noise, prior)) / variance
        for rows in (informative_rows(clean), clean.projections)
    )
    return Bounds(unknown, told)


def find_prior_variance(model: LinearModel, X: Array, Pi: Array, noise: float) -> Array:
    """Find the most probable variance of a policy's parameters, that of each of S models by itself.

    Parameters
    ----------
    model : LinearModel
        Fitted features.
    X : ndarray of shape (N, n)
        States.
    Pi : ndarray of shape (N, d)
        The policy there.
    noise : float
        Standard deviation σ of the noise that it is seen through.

    Returns
    -------
    ndarray of shape () or (S,)
        v, of largest evidence, by expectation and maximisation.
    """
    moments = model.moments(X, observe("direct", Pi))
    values, vectors = np.linalg.eigh(moments.H)
    targets = moments.g.shape[-1]
    # Sums over the targets that share a basis, along each eigenvector.
    squares = np.sum((vectors.swapaxes(-1, -2) @ moments.g) ** 2, axis=-1) / noise**4
    precision = np.maximum(values, 0.0) / noise**2
    v = np.mean(squares / (precision + precision.max(axis=-1, keepdims=True)) ** 2, axis=-1)
    for _ in range(ROUNDS):
        sharpness = precision + 1 / v[..., None]
        v = np.mean(squares / sharpness**2 / targets + 1 / sharpness, axis=-1)
    return v


def _covariance(model: LinearModel, X: Array, rows: Array, noise: float, prior: Array) -> Array:
    """Compute the least covariance of the parameters, (P, P), or (S, P, P) of S local models."""
    H = model.moments(X, Projected(rows, np.zeros(rows.shape[:2]))).H
    inverse = np.linalg.inv(H + (noise**2 / prior)[..., None, None] * np.eye(H.shape[-1]))
    return noise**2 * (inverse + inverse.swapaxes(-1, -2)) / 2


def _error(model: LinearModel, X: Array, covariance: Array) -> float:
    """Compute the mean squared error `tr Φ Σ Φᵀ` that parameters of this covariance make at states X."""
    batch = covariance.shape[:-2]
    about_zero = Posterior(
        np.zeros((*covariance.shape[:-1], 1)), covariance, np.ones(batch), np.ones(batch), np.zeros(batch)
    )
    spread = model.covariance(X, np.zeros((len(X), model.n_actions)), about_zero)
    return float(np.trace(spread, axis1=1, axis2=2).mean())
