"""LPV-DS: a mixture of linear systems that share a quadratic Lyapunov function, so that all movements end at the goal.

`f(x) = Σ_k γ_k(x) A_k (x - g)`, with γ_k the posterior of a Gaussian mixture over states, and `A_kᵀ P + P A_k` negative
definite for one P. As published: P is that of which recorded velocities descend `(x - g)ᵀ P (x - g)` most, then the
A_k minimise the squared error of velocities. Otherwise than published, the mixture is fitted by EM, not by the
physically consistent sampler, and the constraint is built into how A_k is written, `P A_k = skew - S Sᵀ - ε I`, instead
of being handed to a semidefinite solver. The problem is the same, and it is convex in A_k.

References
----------
N. Figueroa, A. Billard, *A Physically-Consistent Bayesian Non-Parametric Mixture Model for Dynamical System Learning*,
Conference on Robot Learning, 2018.
S. M. Khansari-Zadeh, A. Billard, *Learning Control Lyapunov Function to Ensure Stability of Dynamical System-based
Robot Reaching Motions*, Robotics and Autonomous Systems 62(6), 2014, for P.
"""

import numpy as np
from scipy.optimize import minimize
from sklearn.mixture import GaussianMixture

from benchmarks.rivals.learnt import Array, Field, Recorded
from benchmarks.rivals.mixture import STARTS, responsibilities

ASCENDING = 0.1
"""What velocities that descend count, of those that ascend; small, so that ascent matters most."""

LEAST_DECAY = 1e-3
"""Every A_k falls at least this fast, in units of the usual speed over the usual distance."""

ITERATIONS = 1000


def learn(recorded: Recorded, components: int) -> Field | None:
    """Fit a system that ends at the goal; None where there is no goal."""
    if recorded.goal is None:
        return None
    goal = recorded.goal
    X, U = recorded.demos.states - goal, recorded.demos.actions
    length, speed = (float(np.sqrt(np.mean(np.sum(each**2, axis=1)))) for each in (X, U))
    X, U = X / length, U / speed
    mixture = GaussianMixture(components, n_init=STARTS, random_state=0).fit(X)
    given = mixture.weights_, mixture.means_, mixture.covariances_
    A = fit_slopes(X, U, responsibilities(*given, X), find_metric(X, U))

    def velocity(Z: Array) -> Array:
        Z = (Z - goal) / length
        return np.asarray(speed * np.einsum("nk,kij,nj->ni", responsibilities(*given, Z), A, Z))

    return Field(velocity)


def find_metric(X: Array, U: Array) -> Array:
    """Find P (n, n), of trace n, of which velocities U (N, n) at X (N, n), relative to the goal, descend most."""
    n = X.shape[1]
    lower = np.tril_indices(n)
    moving = (np.linalg.norm(U, axis=1) > 0) & (np.linalg.norm(X, axis=1) > 0)
    X, U = X[moving], U[moving] / np.linalg.norm(U[moving], axis=1, keepdims=True)

    def unpack(p: Array) -> Array:
        L = np.zeros((n, n))
        L[lower] = p
        P = L @ L.T + 1e-3 * np.sum(p**2) / n * np.eye(n)
        return np.asarray(n * P / np.trace(P))

    def cost(p: Array) -> float:
        Y = X @ unpack(p)
        psi = np.sum(Y * U, axis=1) / np.linalg.norm(Y, axis=1)
        return float(np.mean(np.where(psi > 0, 1.0, -ASCENDING) * psi**2))

    return unpack(minimize(cost, np.eye(n)[lower], method="L-BFGS-B").x)


def fit_slopes(X: Array, U: Array, h: Array, P: Array) -> Array:
    """Find A_k (K, n, n) of least squared error with `A_kᵀ P + P A_k` negative definite.

    Parameters
    ----------
    X, U : ndarray of shape (N, n)
        States relative to the goal, velocities.
    h : ndarray of shape (N, K)
        How much each system counts.
    P : ndarray of shape (n, n)
        Of the Lyapunov function.

    Returns
    -------
    ndarray of shape (K, n, n)
    """
    K, n = h.shape[1], X.shape[1]
    inverse = np.linalg.inv(P)

    def unpack(p: Array) -> tuple[Array, Array]:
        S, skew = p.reshape(2, K, n, n)
        return S, inverse @ (skew - skew.swapaxes(1, 2) - S @ S.swapaxes(1, 2) - LEAST_DECAY * np.eye(n))

    # The systems enter the error only through these products, so that an iteration does not go over samples.
    weighted = (h[:, :, None] * X[:, None]).reshape(len(X), K * n)
    gram, cross = weighted.T @ weighted / len(X), weighted.T @ U / len(X)
    total = float(np.sum(U**2)) / len(X)

    def cost(p: Array) -> tuple[float, Array]:
        S, A = unpack(p)
        stacked = A.swapaxes(1, 2).reshape(K * n, n)
        back = gram @ stacked - cross
        value = 0.5 * (total + float(np.sum(stacked * (back - cross))))
        G = inverse @ back.reshape(K, n, n).swapaxes(1, 2)
        turned = G.swapaxes(1, 2)
        return value, np.concatenate([(-(G + turned) @ S).ravel(), (G - turned).ravel()])

    start = np.concatenate([np.tile(np.eye(n), (K, 1, 1)).ravel(), np.zeros(K * n * n)])
    found = minimize(cost, start, jac=True, method="L-BFGS-B", options={"maxiter": ITERATIONS, "maxcor": 30})
    return unpack(found.x)[1]
