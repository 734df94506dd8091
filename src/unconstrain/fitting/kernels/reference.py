"""Moments as the equations define them, which the fast ways are tested against."""

import numpy as np

from unconstrain.features.base import Features
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import Observation


def moments(
    features: Features, X: np.ndarray, observation: Observation, weights: np.ndarray | None = None
) -> Moments:
    """Sum `H = Σ ω VᵀV`, `g = Σ ω VᵀQu`, `s = Σ ω ‖Qu‖²` with `V = Q Φ(x)`.

    Parameters
    ----------
    features : Features
        Fitted.
    X : ndarray of shape (N, n)
        States.
    observation : Observation
        Of N samples.
    weights : ndarray of shape (N,), optional
        Weight of each sample, 1 by default.

    Returns
    -------
    Moments
        Of N samples.
    """
    omega = np.ones(len(X)) if weights is None else weights
    V = np.stack([features.along(X, observation.rows[:, k]) for k in range(observation.n_rows)], axis=1)
    H = np.einsum("n,nkp,nkq->pq", omega, V, V)
    g = np.einsum("n,nkp,nk->p", omega, V, observation.targets)[:, None]
    s = np.einsum("n,nk,nk->", omega, observation.targets, observation.targets)
    return Moments(H, g, np.asarray(s), np.asarray(omega.sum()), len(X))
