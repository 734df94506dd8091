"""How sure a fit is: the posterior of the Bayesian linear model, from moments alone.

With `V_n w = Q_n Φ(x_n) w` observed through Gaussian noise of variance σ² and the prior `w ~ N(0, σ²/λ I)`,

    w | data ~ N(m, Σ),    m = (H + λI)⁻¹ g,    Σ = σ² (H + λI)⁻¹,
    -2 log p(data | λ) = n log σ² + Σ_i log(1 + h_i / λ) + const,    σ² = (s - gᵀ(H + λI)⁻¹g) / n,

for the eigenvalues h of H and n observed numbers: σ² maximises the likelihood in closed form, λ is searched for on one
axis. H, g, s and n are moments, so streams and clusters know how sure they are as well.

All of this is about the parameters of standardised features (`fitting.decay`), so units do not matter. The prior is
about the intercept too, unlike the weight decay: how far off an intercept may be that no sample shows is a finite
number. Local models that decay to w_0, of all samples together, have it as the mean of their prior: with `w_0 ~ N(m_0,
Σ_0)` and g - H m_0 in place of g, and s likewise,

    m = m_0 + (H + λI)⁻¹ (g - H m_0),    Σ = σ² (H + λI)⁻¹ + A Σ_0 Aᵀ,    A = λ (H + λI)⁻¹,

the second term since where a model knows nothing by itself, it is as unsure as w_0. How far local models are from w_0,
the prior's variance σ²/λ, is the same for all of them and found from all of them: a model whose own data show no
difference may still be as different as the others.

What is reported of the policy at x is the second moment of its deviation from what `predict` returns,

    E (π(x) - p(x)) (π(x) - p(x))ᵀ = Φ Σ Φᵀ + (Φm - p)(Φm - p)ᵀ,

since the policy was solved for a λ of its own. Local models are taken as a mixture, `Σ_m ω_m(x) (...)_m`; where
neighbours disagree, that disagreement is part of it.

References
----------
MacKay, Bayesian interpolation, Neural Computation 4, 1992; here with σ² profiled out.
"""

from dataclasses import dataclass, replace

import numpy as np

from unconstrain.fitting.decay import Decay
from unconstrain.fitting.moments import Moments

# Where λ is searched, relative to the largest eigenvalue of H, and at how many values before the search is refined.
SMALLEST, LARGEST, N_TRIED = 1e-14, 1e6, 41

# Where the variance of what local models differ by from all data is searched, relative to the mean squared action.
NARROWEST, WIDEST = 1e-12, 1e4


@dataclass(frozen=True)
class Posterior:
    """The distribution `w ~ N(m, Σ)` of parameters, of one model or of several along leading axes.

    Parameters
    ----------
    mean : ndarray of shape (..., P, K)
        Means m.
    covariance : ndarray of shape (..., P, P)
        Σ, of each of the K targets that share H.
    noise : ndarray of shape (...,)
        Variance σ² of the noise, in squared units of the action.
    decay : ndarray of shape (...,)
        Weight decay λ.
    log_evidence : ndarray of shape (...,)
        `log p(data | λ, σ²)`.
    apart : float
        How many times the squares count by which local models lie apart from what they predict together.
    """

    mean: np.ndarray
    covariance: np.ndarray
    noise: np.ndarray
    decay: np.ndarray
    log_evidence: np.ndarray
    apart: float = 1.0

    @classmethod
    def of(
        cls,
        moments: Moments,
        numbers_per_sample: int = 1,
        decay: Decay | None = None,
        noise: float | None = None,
    ) -> "Posterior":
        """Compute the posterior that moments determine.

        Parameters
        ----------
        moments : Moments
            Of the samples.
        numbers_per_sample : int
            How many numbers each sample shows: 1, or d where nothing is projected.
        decay : Decay, optional
            Which parameters the prior is about; by default those that the moments are of.
        noise : float, optional
            Variance σ², in squared units of the action, where it is known; by default it is estimated with λ.

        Returns
        -------
        Posterior
            Of the parameters.
        """
        if decay is None:
            return cls._of_standardized(moments, numbers_per_sample, noise)
        found = cls._of_standardized(decay.standardize(moments), numbers_per_sample, noise)
        covariance = decay.restore_covariance(found.covariance)
        return replace(found, mean=decay.restore(found.mean), covariance=covariance)

    @classmethod
    def _of_standardized(cls, moments: Moments, numbers_per_sample: int, noise: float | None) -> "Posterior":
        if moments.everywhere is not None:
            whole = cls._of_standardized(moments.everywhere, numbers_per_sample, noise)
            return cls._about(whole, moments, numbers_per_sample, noise)
        return cls._about_zero(moments, numbers_per_sample, noise)[0]

    @classmethod
    def _about(
        cls, whole: "Posterior", moments: Moments, numbers_per_sample: int, noise: float | None
    ) -> "Posterior":
        """Compute the posterior of local models about that of all samples together."""
        m = whole.mean
        Hm = moments.H @ m
        squares = moments.squares + np.einsum("pk,...pk->...", m, Hm - 2 * moments.g)
        apart = replace(moments, g=moments.g - Hm, squares=np.maximum(squares, 0.0), everywhere=None)
        found, inverse = cls._about_zero(apart, numbers_per_sample, noise, moments.squares, shared=True)
        A = found.decay[..., None, None] * inverse
        spread = A @ whole.covariance @ A
        spread = (spread + spread.swapaxes(-1, -2)) / 2
        return replace(found, mean=m + found.mean, covariance=found.covariance + spread)

    @classmethod
    def _about_zero(
        cls,
        moments: Moments,
        numbers_per_sample: int,
        known_noise: float | None,
        sizes: np.ndarray | None = None,
        *,
        shared: bool = False,
    ) -> tuple["Posterior", np.ndarray]:
        """Compute the posterior about zero, and `(H + λI)⁻¹`; `sizes` are what s is rounded relative to."""
        from scipy.linalg import cho_factor, cho_solve

        batch, P = moments.squares.shape, moments.H.shape[-1]
        search = _Evidence(moments, numbers_per_sample, known_noise, sizes)
        decay = search.decay()
        noise = search.noise(np.log(decay), search.every)
        if shared:
            decay = noise / search.shared_spread(noise)
        log_evidence = -search.surprise(np.log(decay), search.every)
        # Cholesky, not the eigenvectors at hand: it leaves Σ positive however wide the eigenvalues lie apart.
        regular = moments.H.reshape(-1, P, P) + decay[:, None, None] * np.eye(P)
        inverse = np.stack([cho_solve(cho_factor(one), np.eye(P)) for one in regular])
        inverse = ((inverse + inverse.swapaxes(-1, -2)) / 2).reshape(moments.H.shape)
        noise = noise.reshape(batch)
        found = cls(
            inverse @ moments.g,
            noise[..., None, None] * inverse,
            noise,
            decay.reshape(batch),
            log_evidence.reshape(batch),
        )
        return found, inverse


class _Evidence:
    """`-log p(data | λ)` of S models side by side, as a function of log λ."""

    def __init__(
        self,
        moments: Moments,
        numbers_per_sample: int,
        known_noise: float | None,
        sizes: np.ndarray | None = None,
    ):
        self.known_noise = known_noise
        spectrum, P = moments.decompose(), moments.H.shape[-1]
        self.values = np.maximum(spectrum.values.reshape(-1, P), 0.0)
        pulls = np.sum(spectrum.along**2, axis=-1) * spectrum.determined
        self.pulls = pulls.reshape(-1, P)
        self.squares = moments.squares.reshape(-1)
        tiny = np.finfo(np.float64).tiny
        self.n = np.maximum(moments.weight.reshape(-1) * numbers_per_sample, tiny)
        self.sizes = self.squares if sizes is None else sizes.reshape(-1)
        self.floor = np.maximum(P * np.finfo(np.float64).eps * self.sizes, tiny)
        self.n_targets = moments.g.shape[-1]
        self.every = np.arange(len(self.squares))

    def noise(self, log_decay: np.ndarray, models: np.ndarray) -> np.ndarray:
        """Compute σ² of the largest likelihood for λ, never below the rounding of s, unless it is known."""
        if self.known_noise is not None:
            shape = np.broadcast_shapes(np.shape(log_decay), np.shape(models))
            return np.full(shape, self.known_noise)
        explained = self.pulls[models] / (self.values[models] + np.exp(log_decay)[..., None])
        return np.maximum(self.squares[models] - explained.sum(axis=-1), self.floor[models]) / self.n[models]

    def surprise(self, log_decay: np.ndarray, models: np.ndarray) -> np.ndarray:
        """Compute `-log p(data | λ)`."""
        shrunk = np.sum(np.log1p(self.values[models] * np.exp(-log_decay)[..., None]), axis=-1)
        noise = self.noise(log_decay, models)
        misfit = np.log(2 * np.pi * noise) + 1.0
        if self.known_noise is not None:
            explained = self.pulls[models] / (self.values[models] + np.exp(log_decay)[..., None])
            left = self.squares[models] - explained.sum(axis=-1)
            misfit += left / (self.n[models] * noise) - 1.0
        return 0.5 * (self.n[models] * misfit + self.n_targets * shrunk)

    def shared_spread(self, noise: np.ndarray) -> float:
        """Find the variance σ²/λ of the prior that all models share, given the noise σ² (S,) of each.

        The parameters are standardised, so they are actions, and it is searched for about the square of those.
        """
        from scipy.optimize import minimize_scalar

        def surprise(log_spread: float) -> float:
            decay = noise / np.exp(log_spread)
            shrunk = np.sum(np.log1p(self.values / decay[:, None]))
            explained = np.sum(self.pulls / (self.values + decay[:, None]), axis=1)
            return float(self.n_targets * shrunk - np.sum(explained / noise))

        # Squares of expanded log-likelihoods may add up to less than zero.
        size = abs(float(np.sum(self.sizes) / np.sum(self.n))) or 1.0
        tried = np.log(np.geomspace(NARROWEST, WIDEST, N_TRIED) * size)
        best = int(np.clip(np.argmin([surprise(each) for each in tried]), 1, N_TRIED - 2))
        found = minimize_scalar(surprise, bounds=(tried[best - 1], tried[best + 1]), method="bounded")
        return float(np.exp(found.x))

    def decay(self) -> np.ndarray:
        """Find λ of the largest evidence, (S,): the best of a coarse grid, then refined between its neighbours."""
        from scipy.optimize import elementwise

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
