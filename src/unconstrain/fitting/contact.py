"""Which samples were free, inferred: what a sample says of the policy hangs on how the policy so far explains it.

Each sample is free or constrained, and which is hidden. A belief (parameters, noise, chain) gives the probability γ
that a sample was free, and with it what the sample says: an expansion of its expected log-likelihood about the
prediction p,

    ℓ(p') ≈ ℓ(p) + gᵀ(p' - p) - (p' - p)ᵀ A (p' - p) / 2,
    g = γ ∇log p(u | free) + (1 - γ) ∇log p(ρ | constrained),
    A = γ S⁻¹ + (1 - γ) (n nᵀ + ε I) / s²,

with the exact gradients, and informations in place of curvatures: n is the gradient of the distance to the sphere.
So a fit is again a sum of moments, `H = Σ Φᵀ A Φ` and `Σ Φᵀ (A p + g)`, and repeating it is expectation
maximisation, each maximisation one step of Fisher scoring.

References
----------
Dempster, Laird, Rubin, Maximum likelihood from incomplete data via the EM algorithm, J. R. Stat. Soc. B 39, 1977.
"""

import itertools
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from unconstrain.fitting.chain import Chain, Counts, smooth
from unconstrain.fitting.drift import Drift, Drifts, Steps
from unconstrain.fitting.likelihood import Views
from unconstrain.fitting.model import Model
from unconstrain.fitting.noise import Noise, Squares
from unconstrain.fitting.observation import Expanded, unknown
from unconstrain.samples import Samples
from unconstrain.waiting import each

Floats = NDArray[np.float64]

MOST_CORRELATED = 0.999

SOME = 2**16
"""Samples that are judged at a time, but for what it takes to end an episode."""


@dataclass(frozen=True)
class Belief:
    """Where an inference stands.

    Parameters
    ----------
    w : object
        Parameters of the model.
    noise : Noise
        Variances by which samples are judged to be free or not.
    chain : Chain
        Probabilities of being free.
    drift : Drift, optional
        How constrained samples follow each other on the sphere; without one each may be anywhere.
    held : {"free", "constrained"}, optional
        What all samples are taken for that are not known to be otherwise.
    is_cooling : bool
        Whether the noise is still being lowered, and so is larger than that of the samples.
    residual : Noise, optional
        Variances as they appear meanwhile, by which the policy is learnt; by default those of `noise`. The gradient of
        a constrained sample is corrected for `(d - 1) s²`, and in many dimensions a variance that is too large makes
        policies too large.
    """

    w: Any
    noise: Noise
    chain: Chain = field(default_factory=Chain)
    drift: Drift | None = None
    held: str | None = None
    is_cooling: bool = False
    residual: Noise | None = None


@dataclass(frozen=True)
class Tally:
    """What a pass over samples adds up besides moments. Tallies add.

    Parameters
    ----------
    log_likelihood : float
        Of all samples.
    counts : Counts
        Of hidden states.
    squares : Squares
        Of residuals.
    drifts : Drifts
        Of constrained samples that follow each other.
    echo : float
        `Σ e_t · e_{t-1}` of residuals in units of their deviation, and
    energy : float
        `Σ (e_t² + e_{t-1}²) / 2`.
    shown, meant : float
        Sums of squared lengths, of actions and of predictions.
    n_samples : float
        How many, each counted by its weight.
    echoing : float
        How many numbers the residuals e_t have of which `echo` is the sum.
    """

    log_likelihood: float
    counts: Counts
    squares: Squares
    drifts: Drifts
    echo: float
    energy: float
    shown: float
    meant: float
    n_samples: float
    echoing: float = 0.0

    def __add__(self, other: "Tally") -> "Tally":
        return Tally(
            self.log_likelihood + other.log_likelihood,
            self.counts + other.counts,
            self.squares + other.squares,
            self.drifts + other.drifts,
            self.echo + other.echo,
            self.energy + other.energy,
            self.shown + other.shown,
            self.meant + other.meant,
            self.n_samples + other.n_samples,
            self.echoing + other.echoing,
        )

    @property
    def mean(self) -> float:
        """Log-likelihood of a sample."""
        return self.log_likelihood / self.n_samples

    @property
    def free_share(self) -> float:
        """Share of the samples that were free."""
        return float(self.counts.states[0] / self.counts.states.sum())

    @property
    def size(self) -> float:
        """How many times larger the policy is than what is recorded, root mean square."""
        return float(np.sqrt(self.meant / self.shown)) if self.shown > 0 else 0.0

    @property
    def evidence(self) -> float:
        """How many independent samples one is worth: `(1 - φ) / (1 + φ)` for residuals of correlation φ in a row."""
        correlation = np.clip(self.echo / self.energy, 0.0, MOST_CORRELATED) if self.energy > 0 else 0.0
        return float((1 - correlation) / (1 + correlation))

    @property
    def repeated(self) -> float:
        """Mean product of residuals that follow each other, in units of their variance, never below zero."""
        return max(self.echo, 0.0) / self.echoing if self.echoing > 0 else 0.0


class Found(NamedTuple):
    """What a belief finds in samples.

    Parameters
    ----------
    views : Views
        The samples as seen from the predictions.
    free : ndarray of shape (N,)
        Probability that each was free.
    taken_whole : ndarray of shape (N,)
        The same, but 1 where the projection is known: behind it a sample is seen whole.
    known : ndarray of shape (N,), bool
        Where the projection is known.
    projections : ndarray of shape (K, d, d)
        The projections of these.
    tally : Tally
        What the samples add up to.
    residual : Noise, optional
        Variances that the policy is learnt with, where they are not those of the views.
    """

    views: Views
    free: Floats
    taken_whole: Floats
    known: NDArray[np.bool_]
    projections: Floats
    tally: Tally
    residual: Noise | None = None

    @property
    def gradient(self) -> Floats:
        """The gradient of expected log-likelihoods by the predictions, in units of what a free sample says, (N, d)."""
        return _expected_gradient(self._learnt_by, self.taken_whole)

    @property
    def _learnt_by(self) -> Views:
        return self.views if self.residual is None else self.views.under(self.residual)

    def expand(self) -> Expanded:
        """Expand expected log-likelihoods about the predictions, in units of what a free sample says.

        Returns
        -------
        Expanded
            Of N samples.
        """
        free = self.taken_whole
        views = self._learnt_by
        unit, whole, bent, sphere = views.noise.action, views.whole, views.constrained, views.sphere
        not_free = 1 - free
        along = free * (unit * whole.information - 1)
        towards = not_free * unit / bent.variance
        # Where noise is as large as the sphere, an action tells something in every direction.
        blunt = towards * 0.25 * bent.variance / (bent.variance + sphere.radius**2)
        error = free * (whole.across + unit / whole.variance * whole.along) + towards * bent.square
        parts = (free + blunt, along, towards, sphere.ahead, sphere.normal)
        gradient = _expected_gradient(views, free)
        return Expanded.of(views.P, gradient, error, *parts, known=self.known, projections=self.projections)

    def judge(self, scale: float, variance: float | None = None) -> Expanded:
        """Make the observation by which parameters are judged that were not learnt from these samples.

        It does not weigh samples by what is predicted, as likelihoods do, so that no prediction can make itself matter
        less; and it is corrected for noise, so that its expectation is least at the true policy:
        `γ ‖u - p‖² + (1 - γ) (uᵀ(u - p))² / scale`, less what noise adds to the latter that hangs on p.

        Parameters
        ----------
        scale : float
            Mean squared length of the actions.
        variance : float, optional
            Variance of the noise that it is corrected for; by default that of the belief. A variance larger than that
            of the samples prefers policies that are too short, so an upper bound will not do.

        Returns
        -------
        Expanded
            Of N samples.

        References
        ----------
        Kukush, Markovsky, Van Huffel, Consistent estimation in an implicit quadratic measurement error model,
        Computational Statistics and Data Analysis 47, 2004.
        """
        U, free = self.views.U, self.taken_whole
        d, v = U.shape[1], self.views.noise.action if variance is None else variance
        y = np.einsum("nd,nd->n", U, U)
        bent = (1 - free) / scale
        pulls = (free + bent * (y - (d + 2) * v))[:, None] * U
        squares = free * y + bent * (y**2 - (2 * d + 4) * v * y + d * (d + 2) * v**2)
        # Corrected, the least risk would be next to zero, and any difference a large share of it. So what noise leaves
        # of any policy is kept, and "as good as the least" means beside that.
        squares = squares + bent * v * y
        zero = np.zeros_like(free)
        return Expanded(
            free - bent * v, zero, bent, np.zeros_like(U), U, pulls, squares, self.known, self.projections
        )


def infer(model: Model, belief: Belief, samples: Samples) -> Found:
    """Infer which samples were free.

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
    return judge(model.evaluate(samples.states, belief.w), belief, samples)


def infer_free(model: Model, belief: Belief, samples: Samples) -> Floats:
    """Infer how surely each sample was free, some episodes at a time, whose arrays then stay in the processor's cache.

    Parameters
    ----------
    model : Model
        Whose parameters the belief has.
    belief : Belief
        So far.
    samples : Samples
        In the order of time within each episode.

    Returns
    -------
    ndarray of shape (N,)
        Probabilities.
    """
    N = len(samples.states)
    begins = np.append(np.flatnonzero(episode_starts(samples)), N)
    cuts = np.unique(begins[np.searchsorted(begins, np.arange(0, N + SOME, SOME)).clip(max=len(begins) - 1)])
    free = np.empty(N)
    pieces = list(itertools.pairwise(cuts.tolist()))
    for start, stop in each(pieces, "telling which samples were free", unit="pieces"):
        part = samples.select(slice(start, stop))
        free[start:stop] = _smooth(model.evaluate(part.states, belief.w), belief, part, counts=False).free
    return free


def judge(P: Floats, belief: Belief, samples: Samples) -> Found:
    """Infer which samples were free, by predictions of their actions.

    Parameters
    ----------
    P : ndarray of shape (N, d)
        Predictions.
    belief : Belief
        So far; its parameters are not looked at.
    samples : Samples
        In the order of time within each episode. Without groups each is taken by itself.

    Returns
    -------
    Found
        Of N samples.
    """
    smoothed = _smooth(P, belief, samples)
    views, free, starts, steps = smoothed.views, smoothed.free, smoothed.starts, smoothed.steps
    U, P, N = views.U, views.P, len(free)
    omega = np.ones(N) if samples.weights is None else samples.weights
    known = smoothed.known
    taken = np.where(known, 1.0, free)
    echo, energy, echoing = _echo(views, taken, starts, omega)
    tally = Tally(
        float(omega @ smoothed.log_likelihood),
        smoothed.counts,
        _squares(views, taken, omega),
        Drifts() if steps is None else steps.sum(np.where(smoothed.apart, 0.0, omega * smoothed.kept)),
        echo,
        energy,
        float(omega @ np.einsum("nd,nd->n", U, U)),
        float(omega @ np.einsum("nd,nd->n", P, P)),
        float(omega.sum()),
        echoing,
    )
    return Found(views, free, taken, known, smoothed.projections, tally, belief.residual)


class _Smoothed(NamedTuple):
    """How surely samples were free, and what led to it."""

    views: Views
    free: Floats
    log_likelihood: Floats
    counts: Counts
    kept: Floats
    starts: NDArray[np.bool_]
    apart: NDArray[np.bool_]
    steps: Steps | None
    known: NDArray[np.bool_]
    projections: Floats


def _smooth(P: Floats, belief: Belief, samples: Samples, *, counts: bool = True) -> _Smoothed:
    """Compute how surely samples were free, by predictions of their actions; without counts, that alone."""
    U = samples.actions.astype(np.float64, copy=False)
    N, d = U.shape
    ranks, known, rows = np.full(N, float(d)), np.zeros(N, dtype=bool), np.empty((0, d, d))
    if samples.projections is not None:
        known = ~unknown(samples.projections)
        rows = samples.projections[known]
        U, P = U.copy(), P.copy()
        U[known] = np.einsum("nij,nj->ni", rows, U[known])
        P[known] = np.einsum("nij,nj->ni", rows, P[known])
        ranks[known] = np.einsum("nii->n", rows)
    omega = np.ones(N) if samples.weights is None else samples.weights
    views = Views(U, P, belief.noise, ranks)
    log_free, log_bent = views.whole.log.copy(), views.constrained.log.copy()
    if belief.held is not None:
        (log_bent if belief.held == "free" else log_free)[~known] = -np.inf
    if len(rows):
        is_free = ranks[known] > d - 0.5
        log_bent[known] = np.where(is_free, -np.inf, log_free[known])
        log_free[known] = np.where(is_free, log_free[known], -np.inf)
    starts = episode_starts(samples)
    steps = None
    # Behind a known projection an action says nothing of where on the sphere it lies.
    apart = starts | known
    apart[1:] |= known[:-1]
    if belief.drift is not None and d > 1 and not starts.all():
        # Along the sphere there is no noise of speed.
        steps = Steps.of(views.sphere, np.full(N, belief.noise.action), apart, belief.drift)
    free, log_likelihood, counted, kept = smooth(
        log_free,
        log_bent,
        starts,
        belief.chain,
        None if steps is None else steps.log_kept,
        omega,
        counts=counts,
    )
    return _Smoothed(views, free, log_likelihood, counted, kept, starts, apart, steps, known, rows)


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


def _expected_gradient(views: Views, free: Floats) -> Floats:
    gamma = free[:, None]
    return views.noise.action * (gamma * views.whole.gradient + (1 - gamma) * views.constrained.gradient)


def _squares(views: Views, free: Floats, omega: Floats) -> Squares:
    """Sum up what squared residuals say of the variances."""
    noise, whole, bent = views.noise, views.whole, views.constrained
    taken, bends = omega * free, omega * (1 - free)
    one, zero = np.ones_like(free), np.zeros_like(free)
    r2 = np.einsum("nd,nd->n", views.U, views.U)
    parts = [
        (
            taken * np.maximum(views.ranks - 1, 0),
            taken * whole.across,
            np.full_like(one, noise.action),
            (one, zero),
        ),
        (taken * (views.ranks > 0.5), taken * whole.along, whole.variance, (one, whole.length**2)),
        (bends, bends * bent.square, bent.variance, (one, views.sphere.share * r2)),
    ]
    return Squares.sum(parts)


def _echo(views: Views, free: Floats, starts: NDArray[np.bool_], omega: Floats) -> tuple[float, float, float]:
    """Sum up how residuals agree with those before them, their squares, and how many numbers they have."""
    follows = omega[1:] * ~starts[1:]
    both, neither = free[1:] * free[:-1] * follows, (1 - free[1:]) * (1 - free[:-1]) * follows
    as_free = (views.U - views.P) / np.sqrt(views.noise.action)
    as_bent = (views.sphere.distance / np.sqrt(views.constrained.variance))[:, None]
    echo = energy = 0.0
    for weight, e in ((both, as_free), (neither, as_bent)):
        square = np.einsum("nd,nd->n", e, e)
        echo += float(weight @ np.einsum("nd,nd->n", e[1:], e[:-1]))
        energy += float(weight @ (square[1:] + square[:-1])) / 2
    return echo, energy, float(both @ views.ranks[1:] + neither.sum())
