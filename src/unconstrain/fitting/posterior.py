"""How sure a fit is: the posterior of the Bayesian linear model, from moments alone.

With `V_n w = Q_n Φ(x_n) w` seen through Gaussian noise of variance σ² and the prior `w ~ N(0, σ²/λ I)`,

    w | data ~ N(m, Σ),    m = (H + λI)⁻¹ g,    Σ = σ² (H + λI)⁻¹,
    -2 log p(data | λ) = n log σ² + Σ_i log(1 + h_i / λ) + const,    σ² = (s - gᵀ(H + λI)⁻¹g) / n,

for the eigenvalues h of H and n observed numbers: σ² maximises the likelihood in closed form, λ is searched for on one
axis. H, g, s and n are moments, so streams and clusters know how sure they are as well.
Source: MacKay, Bayesian interpolation, Neural Computation 4, 1992; with σ² profiled out.

What is reported of the policy at x is the second moment of its deviation from what `predict` returns,

    E (π(x) - p(x)) (π(x) - p(x))ᵀ = Φ Σ Φᵀ + (Φm - p)(Φm - p)ᵀ,

since the policy was solved for a λ of its own. Local models are taken as a mixture, `Σ_m ω_m(x) (...)_m`: neighbours
learn from shared samples, so their errors do not average out, and by convexity this is an upper bound on the blend's
second moment however they depend on each other; where neighbours disagree, that disagreement is part of it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import elementwise

from unconstrain.arrays import check_number
from unconstrain.features import FullFeatures, PolicyFeatures
from unconstrain.fitting.kernels.products import distinct_products, pairs
from unconstrain.fitting.moments import Moments
from unconstrain.receptive import normalized_activations

# Where λ is searched, relative to the largest eigenvalue of H, and at how many values before the search is refined.
SMALLEST, LARGEST, N_TRIED = 1e-14, 1e6, 41

BLOCK_ROWS = 1024


@dataclass(frozen=True)
class Posterior:
    """`w ~ N(m, Σ)`, of one model or of several along leading axes.

    mean: m, (..., P, K). covariance: Σ, (..., P, P), of each of the K targets that share H.
    noise: σ², (...,), in squared units of the action. decay: λ, (...,).
    log_evidence: `log p(data | λ, σ²)`, (...,).
    """

    mean: np.ndarray
    covariance: np.ndarray
    noise: np.ndarray
    decay: np.ndarray
    log_evidence: np.ndarray

    @classmethod
    def of(cls, moments: Moments, numbers_per_sample: int = 1) -> "Posterior":
        """From moments, whose samples show `numbers_per_sample` numbers each: 1, or d where nothing is projected."""
        batch, P = moments.squares.shape, moments.H.shape[-1]
        search = _Evidence(moments, numbers_per_sample)
        decay = search.decay()
        noise = search.noise(np.log(decay), search.every)
        log_evidence = -search.surprise(np.log(decay), search.every)
        # Cholesky, not the eigenvectors at hand: it leaves Σ positive however wide the eigenvalues lie apart.
        regular = moments.H.reshape(-1, P, P) + decay[:, None, None] * np.eye(P)
        inverse = np.stack([cho_solve(cho_factor(one), np.eye(P)) for one in regular])
        inverse = ((inverse + inverse.swapaxes(-1, -2)) / 2).reshape(moments.H.shape)
        noise = noise.reshape(batch)
        return cls(
            inverse @ moments.g,
            noise[..., None, None] * inverse,
            noise,
            decay.reshape(batch),
            log_evidence.reshape(batch),
        )


class _Evidence:
    """`-log p(data | λ)` of S models side by side, as a function of log λ."""

    def __init__(self, moments: Moments, numbers_per_sample: int):
        spectrum, P = moments.decompose(), moments.H.shape[-1]
        self.values = np.maximum(spectrum.values.reshape(-1, P), 0.0)
        pulls = np.sum(spectrum.along**2, axis=-1) * spectrum.determined
        self.pulls = pulls.reshape(-1, P)
        self.squares = moments.squares.reshape(-1)
        tiny = np.finfo(np.float64).tiny
        self.n = np.maximum(moments.weight.reshape(-1) * numbers_per_sample, tiny)
        self.floor = np.maximum(P * np.finfo(np.float64).eps * self.squares, tiny)
        self.n_targets = moments.g.shape[-1]
        self.every = np.arange(len(self.squares))

    def noise(self, log_decay: np.ndarray, models: np.ndarray) -> np.ndarray:
        """σ² of the largest likelihood for λ, never below the rounding of s."""
        explained = self.pulls[models] / (self.values[models] + np.exp(log_decay)[..., None])
        return np.maximum(self.squares[models] - explained.sum(axis=-1), self.floor[models]) / self.n[models]

    def surprise(self, log_decay: np.ndarray, models: np.ndarray) -> np.ndarray:
        shrunk = np.sum(np.log1p(self.values[models] * np.exp(-log_decay)[..., None]), axis=-1)
        misfit = np.log(2 * np.pi * self.noise(log_decay, models)) + 1.0
        return 0.5 * (self.n[models] * misfit + self.n_targets * shrunk)

    def decay(self) -> np.ndarray:
        """λ of the largest evidence, (S,): the best of a coarse grid, then refined between its neighbours."""
        top = np.where(self.values[:, -1] > 0, self.values[:, -1], 1.0)
        tried = np.log(np.geomspace(SMALLEST, LARGEST, N_TRIED)[:, None] * top)
        best = np.argmin([self.surprise(row, self.every) for row in tried], axis=0)
        inside = np.clip(best, 1, N_TRIED - 2)
        bracket = tuple(tried[inside + offset, self.every] for offset in (-1, 0, 1))
        found = elementwise.find_minimum(
            self.surprise, bracket, args=(self.every,), tolerances={"xatol": 1e-3}
        )
        # An evidence that only falls, or only grows, has no minimum inside: then the grid's end is kept.
        return np.exp(np.where(found.success, found.x, tried[best, self.every]))


class Unsure:
    """Where a policy is not known well enough to follow it: `rollout(..., stop_when=Unsure(policy, 0.5))`.

    policy: fitted. share: of the predicted speed, that the standard deviation (the root of the summed variances of all
        actions) may not exceed.
    """

    def __init__(self, policy: Any, share: float):
        self.policy = policy
        self.share = check_number(share, "the share of the speed", positive=True)
        self.posterior = policy.posterior()

    def __call__(self, X: np.ndarray) -> np.ndarray:
        """A mask (N,) of states X (N, n)."""
        deviation, speed = self.measure(X)
        return deviation > self.share * speed

    def measure(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Standard deviation and predicted speed at states X (N, n), each (N,), in units of the action."""
        P = np.reshape(self.policy.predict(X), (len(X), -1))
        variance = np.einsum(
            "njj->n", self.policy._deviation(np.asarray(X, dtype=np.float64), P, self.posterior)
        )
        return np.sqrt(np.maximum(variance, 0.0)), np.linalg.norm(P, axis=1)


def parametric_covariance(
    features: PolicyFeatures, X: np.ndarray, P: np.ndarray, posterior: Posterior
) -> np.ndarray:
    """Second moments (N, d, d) of `π(x) - p(x)` at states X (N, n), for predictions P (N, d)."""
    w = posterior.mean.swapaxes(-1, -2).reshape(-1)
    bias = features.evaluate(X, w) - P
    result = bias[:, :, None] * bias[:, None, :]
    d = P.shape[1]
    for start in range(0, len(X), BLOCK_ROWS):
        rows = slice(start, start + BLOCK_ROWS)
        result[rows] += _seen_through(features, X[rows], posterior.covariance, d)
    return result


def local_covariance(
    centers: np.ndarray, width: float, X: np.ndarray, P: np.ndarray, posterior: Posterior
) -> np.ndarray:
    """Second moments (N, d, d) of the mixture of M local models about predictions P (N, d), at states X (N, n)."""
    M, (d, n) = len(centers), (P.shape[1], X.shape[1])
    # Of Σ_m's entries only their sums over the two orders of a pair of features are needed.
    shared = posterior.mean.shape[-1] > 1
    blocks = posterior.covariance.reshape(M, *((1, n + 1, 1, n + 1) if shared else (d, n + 1, d, n + 1)))
    blocks = blocks.transpose(0, 2, 4, 1, 3)  # (M, b, b', j, j')
    i, j = pairs(n + 1)
    entries = blocks[:, i, j] + np.where(i == j, 0.0, 1.0)[:, None, None] * blocks[:, j, i]
    models = posterior.mean.swapaxes(-1, -2).reshape(M, d, n + 1)
    slopes, offsets = models[:, :, :n].reshape(-1, n).T, models[:, :, n]
    result = np.empty((len(X), d, d))
    for start in range(0, len(X), BLOCK_ROWS):
        block = X[start : start + BLOCK_ROWS]
        blend = normalized_activations(block, centers, width)
        products = distinct_products(np.column_stack([block, np.ones(len(block))]))
        mixed = (blend @ entries.reshape(M, -1)).reshape(len(block), *entries.shape[1:])
        spread = np.einsum("pn,npij->nij", products, mixed)
        if shared:
            spread = spread * np.eye(d)
        apart = (block @ slopes).reshape(len(block), M, d) + offsets - P[start : start + BLOCK_ROWS, None]
        spread += np.swapaxes(apart * blend[:, :, None], 1, 2) @ apart
        result[start : start + BLOCK_ROWS] = (spread + spread.swapaxes(1, 2)) / 2
    return result


def _seen_through(features: PolicyFeatures, X: np.ndarray, covariance: np.ndarray, d: int) -> np.ndarray:
    """`Φ(x) Σ Φ(x)ᵀ`, (N, d, d)."""
    if isinstance(features, FullFeatures):
        B = features.basis(X)
        M = B.shape[1]
        if len(covariance) == M:  # shared by all actions
            return np.einsum("nm,nm->n", B @ covariance, B)[:, None, None] * np.eye(d)
        blocks = covariance.reshape(d, M, d, M)
        result = np.empty((len(X), d, d))
        for j in range(d):
            half = (B @ blocks[j].reshape(M, -1)).reshape(len(X), d, M)
            result[:, j] = np.einsum("nkm,nm->nk", half, B)
        return (result + result.swapaxes(1, 2)) / 2
    V = [features.along(X, np.broadcast_to(row, (len(X), d))) for row in np.eye(d)]
    result = np.empty((len(X), d, d))
    for j in range(d):
        half = V[j] @ covariance
        for k in range(j, d):
            result[:, j, k] = result[:, k, j] = np.einsum("np,np->n", half, V[k])
    return result
