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
    each = np.ones(V.shape[:2]) if observation.row_weights is None else observation.row_weights
    H = np.einsum("n,nk,nkp,nkq->pq", omega, each, V, V)
    g = np.einsum("n,np->p", omega, features.along(X, observation.pulls))[:, None]
    s = np.einsum("n,n->", omega, observation.squares)
    return Moments(H, g, np.asarray(s), np.asarray(omega.sum()), len(X))
