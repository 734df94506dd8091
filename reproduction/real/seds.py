"""A compact SEDS, to check our measures of handwriting with: a mixture of linear systems that all lead to the origin.

`f(x) = Σ_k h_k(x) A_k x`, with h_k the posterior of a Gaussian mixture over states, and `A_k + A_kᵀ` negative definite.
All parameters minimise the mean square error of the velocity, as in the published toolbox with the objective "mse".
There it is a constraint that keeps A_k negative definite; here each A_k is written so that it cannot be anything else.

References
----------
S. M. Khansari-Zadeh, A. Billard, *Learning Stable Non-Linear Dynamical Systems with Gaussian Mixture Models*, IEEE
Transactions on Robotics 27(5), 2011.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

Array = NDArray[np.float64]

LARGEST, ITERATIONS = 10, 500
"""The most Gaussians that are tried; iterations of the optimiser, as in the published evaluation."""

LEAST_DECAY = 1e-3
"""Every A_k falls at least this fast, in units of the usual speed over the usual distance."""


@dataclass(frozen=True)
class Seds:
    """A fitted system in the plane, called with states (N, 2).

    Attributes
    ----------
    logits : ndarray of shape (K,)
        Logarithms of the weights, up to a constant.
    means : ndarray of shape (K, 2)
        Of the Gaussians.
    whitening : ndarray of shape (K, 2, 2)
        Lower triangular, `WᵀW` the inverse covariance.
    slopes : ndarray of shape (K, 2, 2)
        A_k.
    """

    logits: Array
    means: Array
    whitening: Array
    slopes: Array

    def __call__(self, X: Array) -> Array:
        """Compute velocities (N, 2)."""
        return np.asarray(np.einsum("nk,kij,nj->ni", self.posterior(X)[0], self.slopes, X))

    def posterior(self, X: Array) -> tuple[Array, Array]:
        """Compute h (N, K), and the whitened distances (N, K, 2) from the means."""
        Z = np.einsum("kij,nkj->nki", self.whitening, X[:, None] - self.means)
        diagonal = np.abs(np.diagonal(self.whitening, axis1=1, axis2=2))
        logs = self.logits + np.log(diagonal).sum(axis=1) - 0.5 * np.sum(Z**2, axis=2)
        h = np.exp(logs - logs.max(axis=1, keepdims=True))
        return h / h.sum(axis=1, keepdims=True), Z


def fit(X: Array, U: Array, seed: int) -> Seds:
    """Fit a system to states and velocities.

    Parameters
    ----------
    X, U : ndarray of shape (N, 2)
        Relative to the goal.
    seed : int
        For the mixture that the optimiser begins with, whose size minimises the BIC.

    Returns
    -------
    Seds
        At a local minimum.
    """
    from sklearn.mixture import GaussianMixture

    length, speed = (float(np.sqrt(np.mean(np.sum(each**2, axis=1)))) for each in (X, U))
    X, U = X / length, U / speed
    joint = np.hstack([X, U])
    mixtures = [GaussianMixture(k, random_state=seed).fit(joint) for k in range(1, LARGEST + 1)]
    best = min(mixtures, key=lambda mixture: mixture.bic(joint))
    covariances = best.covariances_
    within = np.abs(np.einsum("kii->ki", covariances[:, 2:, :2])) / np.einsum(
        "kii->ki", covariances[:, :2, :2]
    )
    factors = np.zeros((best.n_components, 2, 2))
    factors[:, [0, 1], [0, 1]] = np.sqrt(within)
    W = np.linalg.inv(np.linalg.cholesky(covariances[:, :2, :2]))
    start = np.concatenate(
        (
            np.log(best.weights_),
            best.means_[:, :2].ravel(),
            W[:, [0, 1, 1], [0, 0, 1]].ravel(),
            factors.ravel(),
            np.zeros(best.n_components),
        )
    )
    found = minimize(
        _cost, start, args=(X, U), jac=True, method="L-BFGS-B", options={"maxiter": ITERATIONS, "maxcor": 30}
    )
    system = _unpack(found.x)[0]
    return Seds(
        system.logits, system.means * length, system.whitening / length, system.slopes * speed / length
    )


def _unpack(p: Array) -> tuple[Seds, Array]:
    K = len(p) // 11
    logits, means, lower, factors, turns = np.split(p, np.cumsum([K, 2 * K, 3 * K, 4 * K]))
    W = np.zeros((K, 2, 2))
    W[:, [0, 1, 1], [0, 0, 1]] = lower.reshape(K, 3)
    S = factors.reshape(K, 2, 2)
    A = -S @ S.swapaxes(1, 2) - LEAST_DECAY * np.eye(2)
    A[:, 0, 1] += turns
    A[:, 1, 0] -= turns
    return Seds(logits, means.reshape(K, 2), W, A), S


def _cost(p: Array, X: Array, U: Array) -> tuple[float, Array]:
    """Compute half of the mean square error, and its gradient."""
    system, S = _unpack(p)
    h, Z = system.posterior(X)
    each = np.einsum("kij,nj->nki", system.slopes, X)
    P = np.einsum("nk,nki->ni", h, each)
    R = (P - U) / len(X)
    slopes = np.einsum("nk,ni,nj->kij", h, R, X)
    logs = h * np.einsum("ni,nki->nk", R, each - P[:, None])
    means = np.einsum("nk,kji,nkj->ki", logs, system.whitening, Z)
    W = -np.einsum("nk,nki,nkj->kij", logs, Z, X[:, None] - system.means)
    diagonal = np.diagonal(system.whitening, axis1=1, axis2=2)
    W[:, [0, 1], [0, 1]] += logs.sum(axis=0)[:, None] / diagonal
    gradient = np.concatenate(
        (
            logs.sum(axis=0),
            means.ravel(),
            W[:, [0, 1, 1], [0, 0, 1]].ravel(),
            (-(slopes + slopes.swapaxes(1, 2)) @ S).ravel(),
            slopes[:, 0, 1] - slopes[:, 1, 0],
        )
    )
    return 0.5 * float(np.sum((P - U) ** 2)) / len(X), gradient
