"""Gaussian mixture regression (GMR): the mean of the action, given the state, under a mixture over both.

References
----------
S. Calinon, F. Guenter, A. Billard, *On Learning, Representing, and Generalizing a Task in a Humanoid Robot*, IEEE
Transactions on Systems, Man, and Cybernetics B 37(2), 2007. There the input is time; here it is the state, as in SEDS.
"""

import numpy as np
from sklearn.mixture import GaussianMixture

from benchmarks.rivals.learnt import Array, Field, Recorded

STARTS = 3
"""Times that EM begins; the likeliest is kept."""


def learn(recorded: Recorded, components: int) -> Field:
    """Fit a mixture to states and actions, each column in its own standard deviation, and condition it on states."""
    X, U = recorded.demos.states, recorded.demos.actions
    joint = np.hstack([X, U])
    middle, scale = joint.mean(axis=0), joint.std(axis=0)
    mixture = GaussianMixture(components, n_init=STARTS, random_state=0).fit((joint - middle) / scale)
    n = X.shape[1]

    def velocity(Z: Array) -> Array:
        return condition(mixture, (Z - middle[:n]) / scale[:n]) * scale[n:] + middle[n:]

    return Field(velocity)


def condition(mixture: GaussianMixture, X: Array) -> Array:
    """Compute the mean of the last columns of a mixture with full covariances, given the first, X (N, n)."""
    n = X.shape[1]
    h = responsibilities(mixture.weights_, mixture.means_[:, :n], mixture.covariances_[:, :n, :n], X)
    slopes = np.linalg.solve(mixture.covariances_[:, :n, :n], mixture.covariances_[:, :n, n:])
    each = mixture.means_[:, None, n:] + np.einsum("kni,kij->knj", X - mixture.means_[:, None, :n], slopes)
    return np.asarray(np.einsum("nk,knj->nj", h, each))


def responsibilities(weights: Array, means: Array, covariances: Array, X: Array) -> Array:
    """Compute how probably each state comes from each Gaussian, (N, K)."""
    L = np.linalg.cholesky(covariances)
    Z = np.linalg.solve(L, (X - means[:, None]).swapaxes(1, 2))
    logs = np.log(weights) - np.log(np.diagonal(L, axis1=1, axis2=2)).sum(axis=1)
    logs = logs - 0.5 * np.sum(Z**2, axis=1).T
    h = np.exp(logs - logs.max(axis=1, keepdims=True))
    return np.asarray(h / h.sum(axis=1, keepdims=True))
