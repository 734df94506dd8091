"""Which samples were free, inferred: what a sample says of the policy hangs on how the policy so far explains it.

Each sample is free or constrained, and which is hidden. A belief (parameters, noise, chain) gives the probability γ that
a sample was free, and with it what the sample says: an expansion of its expected log-likelihood about the
prediction p,

    ℓ(p') ≈ ℓ(p) + gᵀ(p' - p) - (p' - p)ᵀ A (p' - p) / 2,
    g = γ ∇log p(u | free) + (1 - γ) ∇log p(u | constrained),
    A = γ S⁻¹ + (1 - γ) (n nᵀ + ε I) / s²,

with the exact gradients, and informations in place of curvatures: n is the gradient of the distance to the sphere.
So a fit is again a sum of moments, `H = Σ Φᵀ A Φ` and `Σ Φᵀ (A p + g)`, and repeating it climbs the likelihood of the
recordings (expectation maximisation, each maximisation one step of Fisher scoring).

References
----------
Dempster, Laird, Rubin, Maximum likelihood from incomplete data via the EM algorithm, J. R. Stat. Soc. B 39, 1977.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from unconstrain.fitting.chain import Chain, Counts, smooth
from unconstrain.fitting.model import Model
from unconstrain.fitting.noise import Noise, Squares, Views
from unconstrain.fitting.observation import Expanded, unknown
from unconstrain.samples import Samples

Floats = NDArray[np.float64]

# What the log-likelihood of a state that is known not to hold is.
IMPOSSIBLE = -1e9


@dataclass(frozen=True)
class Belief:
    """Where an inference stands.

    Parameters
    ----------
    w : ndarray
        Parameters of the model.
    noise : Noise
        Variances.
    chain : Chain
        Probabilities of being free; a free share of 1 or 0 takes all samples as free or as constrained.
    """

    w: Floats
    noise: Noise
    chain: Chain
    drift: "Drift" = None
    share: float = 1.0


@dataclass(frozen=True)
class Drift:
    square: float = 0.01
    jump: float = 0.5

@dataclass(frozen=True)
class DriftSums:
    pairs: float
    near: float
    square: float
    weight: float
    def __add__(self,o): return DriftSums(self.pairs+o.pairs,self.near+o.near,self.square+o.square,self.weight+o.weight)
    def estimate(self):
        sq=(self.square)/(self.weight+1e-300)
        return Drift(float(np.clip(sq,1e-8,1.)), float((self.pairs-self.near+1)/(self.pairs+2)))


class Found(NamedTuple):
    """What a belief finds in samples.

    Parameters
    ----------
    observation : Expanded
        What they say of the policy.
    free : ndarray of shape (N,)
        Probability that each was free.
    log_likelihood : ndarray of shape (N,)
        Of each sample, given those before it in its episode.
    counts : Counts
        Of hidden states.
    squares : Squares
        Of residuals.
    """

    observation: Expanded
    free: Floats
    log_likelihood: Floats
    counts: Counts
    squares: Squares
    drifts: DriftSums | None = None
    auto: Floats | None = None


def infer(model: Model, belief: Belief, samples: Samples) -> Found:
    """Infer which samples were free, and what they say of the policy.

    Parameters
    ----------
    model : Model
        Whose parameters the belief has.
    belief : Belief
        So far.
    samples : Samples
        In the order of time within each episode. Without groups each is taken by itself.

    Returns
    -------
    Found
        Of N samples.
    """
    U = samples.actions.astype(np.float64, copy=False)
    P = model.evaluate(samples.states, belief.w)
    N, d = U.shape
    ranks, known, rows = np.full(N, float(d)), np.zeros(N, dtype=bool), np.empty((0, d, d))
    if samples.projections is not None:
        known = ~unknown(samples.projections)
        rows = samples.projections[known]
        U, P = U.copy(), P.copy()
        U[known] = np.einsum("nij,nj->ni", rows, U[known])
        P[known] = np.einsum("nij,nj->ni", rows, P[known])
        ranks[known] = np.einsum("nii->n", rows)
    views = Views(U, P, belief.noise, ranks)
    log_free, log_bent = views.whole.log, views.bent.log
    if known.any():
        log_free, log_bent = log_free.copy(), log_bent.copy()
        is_free = ranks[known] > d - 0.5
        log_bent[known] = np.where(is_free, IMPOSSIBLE, log_free[known])
        log_free[known] = np.where(is_free, log_free[known], IMPOSSIBLE)
    starts = episode_starts(samples)
    log_kept = None
    drifts = None
    if belief.drift is not None and not starts.all():
        from unconstrain.fitting.sphere import scaled_bessel
        out, R2 = views.sphere.out, np.maximum(views.sphere.radius**2, 1e-300)
        chord = np.zeros(N)
        chord[1:] = ((out[1:] - out[:-1]) ** 2).sum(axis=1)
        blur = views.bent.variance / R2
        own = np.zeros(N); own[1:] = 1.5 * (blur[1:] + blur[:-1])
        kappa = 1 / (belief.drift.square + own)
        log_mean, _ = scaled_bessel(d, kappa)
        near = np.log1p(-belief.drift.jump + 1e-12) - kappa * chord / 2 - log_mean
        far = np.log(belief.drift.jump + 1e-12)
        log_kept = np.logaddexp(near, far)
    T = belief.share
    free, log_likelihood, counts, kept = smooth(log_free * T, log_bent * T, starts, belief.chain, None if log_kept is None else log_kept * T)
    ef = (views.U - views.P) / np.sqrt(belief.noise.across)
    eb = views.sphere.distance / np.sqrt(views.bent.variance)
    both = np.zeros(N); both[1:] = free[1:] * free[:-1] * ~starts[1:]
    neither = np.zeros(N); neither[1:] = (1 - free[1:]) * (1 - free[:-1]) * ~starts[1:]
    sf = (ef**2).sum(1); 
    cf = np.zeros(N); cf[1:] = (ef[1:] * ef[:-1]).sum(1); mf = np.zeros(N); mf[1:] = (sf[1:] + sf[:-1]) / 2
    cb = np.zeros(N); cb[1:] = eb[1:] * eb[:-1]; mb = np.zeros(N); mb[1:] = (eb[1:]**2 + eb[:-1]**2) / 2
    auto = np.array([(both * cf + neither * cb).sum(), (both * mf + neither * mb).sum()])
    if log_kept is not None:
        resp = kept * np.exp(near - log_kept)
        e2 = chord / max(d - 1, 1)
        drifts = DriftSums(float(kept.sum()), float(resp.sum()), float((resp * (e2 - own) * kappa**2).sum()), float((resp * kappa**2).sum()))
    # A sample whose projection is known is seen whole behind it.
    taken = np.where(known, 1.0, free)
    observation = _expand(views, taken, known, rows)
    squares = _squares(views, taken, samples.weights)
    return Found(observation, free, log_likelihood, counts, squares, drifts, auto)


def episode_starts(samples: Samples) -> NDArray[np.bool_]:
    """Tell where episodes begin; without groups every sample is one.

    Parameters
    ----------
    samples : Samples
        N samples.

    Returns
    -------
    ndarray of shape (N,), bool
        True for the first sample of each.
    """
    groups: Any = samples.groups
    starts = np.ones(len(samples.states), dtype=bool)
    if groups is not None:
        starts[1:] = groups[1:] != groups[:-1]
    return starts


def _expand(views: Views, free: Floats, known: NDArray[np.bool_], rows: Floats) -> Expanded:
    """Expand expected log-likelihoods about predictions, in units of what a free sample says."""
    unit, whole, bent, sphere = views.noise.across, views.whole, views.bent, views.sphere
    not_free = 1 - free
    along = free * (unit * whole.information - 1)
    towards = not_free * unit / bent.variance
    # The sphere is curved: where noise is as large as its radius, an action tells something in every direction.
    blunt = towards * 0.25 * bent.variance / (bent.variance + sphere.radius**2)
    gradient = unit * (free[:, None] * whole.gradient + not_free[:, None] * bent.gradient)
    error = free * (whole.across + unit / whole.variance * whole.along) + towards * bent.square
    parts = (free + blunt, along, towards, sphere.ahead, sphere.normal)
    return Expanded.of(views.P, gradient, error, *parts, known=known, projections=rows)


def judge(U: Floats, free: Floats, noise: Noise, scale: float, known: NDArray[np.bool_], rows: Floats) -> Expanded:
    """Risk of any policy, unbiased by noise."""
    d = U.shape[1]
    y = np.einsum("nd,nd->n", U, U)
    bent = (1 - free) / scale
    v = noise.across
    pulls = (free + bent * (y - (d + 2) * v))[:, None] * U
    squares = free * y + bent * (y**2 - (2 * d + 4) * v * y + d * (d + 2) * v**2)
    zero = np.zeros_like(free)
    return Expanded(free - bent * v, zero, bent, np.zeros_like(U), U, pulls, squares, known, rows)


def _squares(views: Views, free: Floats, weights: Floats | None) -> Squares:
    """Sum up what squared residuals say of the variances."""
    noise, whole, bent = views.noise, views.whole, views.bent
    omega = np.ones_like(free) if weights is None else weights
    taken, bends = omega * free, omega * (1 - free)
    ranks = np.maximum(views.ranks - 1, 0)
    one = np.ones_like(free)
    r2 = np.einsum("nd,nd->n", views.U, views.U)
    share = views.sphere.share
    parts = [
        (taken * ranks, taken * whole.across, np.full_like(one, noise.across), (one, 0 * one, one)),
        (taken * (views.ranks > 0), taken * whole.along, whole.variance, (one, whole.length**2, one)),
        (bends, bends * bent.square, bent.variance, (one, share * r2, share)),
    ]
    matrix, vector, total, count = np.zeros((3, 3)), np.zeros(3), 0.0, 0.0
    for number, square, variance, contributions in parts:
        c = np.stack(contributions) / variance
        matrix += (c * number) @ c.T
        vector += c @ (square / variance)
        total += float(np.sum(square / variance))
        count += float(np.sum(number))
    return Squares(matrix, vector, total, count)
