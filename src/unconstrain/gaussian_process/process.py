"""The posterior of a Gaussian process over policies, given what was observed along directions.

With a prior of covariance K and rows observed through noise of variance σ² (`rows`),

    E qᵀπ(x)   = k(x, q)ᵀ α,                 α = (K + σ²I)⁻¹ t,
    cov        = k(·,·) - kᵀ B Bᵀ k + kᵀ B C Bᵀ k.

*Exactly*, k are covariances with all rows, B Bᵀ = (K + σ²I)⁻¹ and C = 0. *On inducing rows* of which there are few, k
are covariances with those, B Bᵀ = K⁻¹ of theirs and C = σ² (σ²I + Σ Φ A Φᵀ)⁻¹ with the features Φ = Bᵀk, to which the
prior is conditioned: the deterministic training conditional. The middle term is what inducing rows explain of the
prior, so far from all of them the variance is the prior's.

References
----------
Rasmussen, Williams, Gaussian Processes for Machine Learning, 2006, (2.25) and Sec. 8.3. Quiñonero-Candela, Rasmussen, A
unifying view of sparse approximate Gaussian process regression, J. Mach. Learn. Res. 6, 2005, Sec. 5.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from unconstrain.features.scaling import Scaling
from unconstrain.gaussian_process.pairs import every_direction
from unconstrain.gaussian_process.rows import Rows

BLOCK = 2**22
"""How many covariances are computed at a time."""

JITTER = 1e-12
"""Share of the mean variance that is added to every row's, so that factors exist."""

ROUNDING = 1e-11
"""Share of the prior's variance that rounding leaves of the posterior's, at least."""


@dataclass(frozen=True)
class Process:
    """A distribution over policies, of states that are standardised inside.

    Parameters
    ----------
    kernel : Kernel
        Covariance of the prior, for actions in units of `size`.
    scaling : Scaling
        Of the states.
    size : float
        In what the policy is counted, in the unit of the action.
    pairs : ndarray of shape (R, n + d)
        Rows that the posterior hangs on, all that were observed or inducing ones.
    coefficients : ndarray of shape (R,)
        α.
    noise : float
        σ², in squared units of `size`.
    used : float
        How many of the observed numbers the fit uses up, the trace of what maps them to predictions.
    whitener : ndarray of shape (R, P), optional
        B; without it variances are not known.
    left : ndarray of shape (P, P), optional
        C; zero where rows were not approximated.
    widening : float
        What the covariance is multiplied by; see `held_out`.
    apart : ndarray of shape (R, K), optional
        By what coefficients without each of K folds lie apart, scaled: `k(x)ᵀ` times these, squared, is what folds
        add to the covariance.
    """

    kernel: Any
    scaling: Scaling
    size: float
    pairs: np.ndarray
    coefficients: np.ndarray
    noise: float
    used: float
    whitener: np.ndarray | None = None
    left: np.ndarray | None = None
    widening: float = 1.0
    apart: np.ndarray | None = None

    @property
    def n_actions(self) -> int:
        """Number of actions d."""
        return self.pairs.shape[1] - len(self.scaling.mean)

    @property
    def is_exact(self) -> bool:
        """Whether no row was approximated by inducing ones."""
        return self.left is None

    def evaluate(self, X: np.ndarray) -> np.ndarray:
        """Compute the mean.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, d)
            Actions.
        """
        d = self.n_actions
        mean = np.empty((len(X), d))
        for rows in self._blocks(len(X)):
            k = self.kernel(every_direction(self.scaling(X[rows]), d), self.pairs)
            mean[rows] = (k @ self.coefficients).reshape(-1, d)
        return self.size * mean

    def covariance(self, X: np.ndarray) -> np.ndarray:
        """Compute the covariance of the policy at each state.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, d, d)
            In squared units of the action.
        """
        assert self.whitener is not None
        d = self.n_actions
        covariance = np.empty((len(X), d, d))
        for rows in self._blocks(len(X)):
            seen = every_direction(self.scaling(X[rows]), d)
            k = self.kernel(seen, self.pairs)
            features = (k @ self.whitener).reshape(-1, d, self.whitener.shape[1])
            prior = self._prior(seen, d)
            covariance[rows] = prior - features @ features.swapaxes(1, 2)
            if self.left is not None:
                covariance[rows] += features @ self.left @ features.swapaxes(1, 2)
            least = ROUNDING * np.einsum("njj->nj", prior)
            axis = np.arange(d)
            covariance[rows, axis, axis] = np.maximum(covariance[rows, axis, axis], least)
            covariance[rows] *= self.widening
            if self.apart is not None:
                spread = (k @ self.apart).reshape(-1, d, self.apart.shape[1])
                covariance[rows] += spread @ spread.swapaxes(1, 2)
        return self.size**2 * covariance

    def without_variances(self) -> "Process":
        """Return a process that predicts, but does not know how sure it is: a small file."""
        return replace(self, whitener=None, left=None, apart=None)

    def _prior(self, seen: np.ndarray, d: int) -> np.ndarray:
        """Compute the prior's covariance at each state, (N, d, d)."""
        by_axis = [seen[j::d] for j in range(d)]
        prior = np.empty((len(by_axis[0]), d, d))
        for j in range(d):
            prior[:, j, j] = self.kernel.diag(by_axis[j])
            for k in range(j):
                # cov(a, b) from variances, since kernels give no covariances of pairs: var(a + b) - var(a - b) = 4 cov.
                n = len(self.scaling.mean)
                plus, minus = by_axis[j].copy(), by_axis[j].copy()
                plus[:, n:] += by_axis[k][:, n:]
                minus[:, n:] -= by_axis[k][:, n:]
                value = (self.kernel.diag(plus) - self.kernel.diag(minus)) / 4
                prior[:, j, k] = prior[:, k, j] = value
        return prior

    def _blocks(self, N: int) -> list[slice]:
        step = max(1, BLOCK // (len(self.pairs) * self.n_actions))
        return [slice(start, start + step) for start in range(0, N, step)]


def condition(kernel: Any, rows: Rows, scaling: Scaling, size: float, noise: float) -> Process:
    """Condition a prior on rows, exactly.

    Parameters
    ----------
    kernel : Kernel
        Covariance of the prior, for actions in units of `size`.
    rows : Rows
        Of standardised states.
    scaling : Scaling
        Of the states.
    size : float
        In what the policy is counted, in the unit of the action.
    noise : float
        σ², in squared units of `size`.

    Returns
    -------
    Process
        The posterior. It costs `R³` for R rows.
    """
    from scipy.linalg import solve_triangular

    lower = factor(kernel, rows, noise)
    inverse = solve_triangular(lower, np.eye(len(rows)), lower=True)
    coefficients = inverse.T @ (inverse @ (rows.targets / size))
    used = len(rows) - noise * float(np.sum(inverse**2))
    return Process(kernel, scaling, size, rows.pairs, coefficients, noise, used, inverse.T)


def factor(kernel: Any, rows: Rows, noise: float) -> np.ndarray:
    """Compute the lower factor of `K + σ²I`.

    Parameters
    ----------
    kernel : Kernel
        Covariance of the prior.
    rows : Rows
        Of standardised states.
    noise : float
        σ².

    Returns
    -------
    ndarray of shape (R, R)
        Lower triangular.
    """
    K = kernel(rows.pairs)
    K[np.diag_indices_from(K)] += noise + JITTER * float(np.mean(np.diagonal(K)))
    lower: np.ndarray = np.linalg.cholesky(K)
    return lower
