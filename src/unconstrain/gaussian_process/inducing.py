"""A Gaussian process on few rows: features in which its policies are linear.

With inducing rows s of covariance `K = V diag(v) Vᵀ`, the features

    Φ(x)ᵀq = Bᵀ k(s, (x, q)),        B = V diag(v)^(-1/2),

have the covariance `ΦᵀΦ ≈ k` (Nyström), so parameters with the prior N(0, I) are the process. Inference of contact
runs on them as on any other model that is linear in its parameters, and sums of moments condition more rows than fit
into one matrix.

References
----------
Williams, Seeger, Using the Nyström method to speed up kernel machines, NIPS 2000.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from unconstrain.features.scaling import Scaling
from unconstrain.fitting.moments import Moments
from unconstrain.gaussian_process.pairs import every_direction, pair
from unconstrain.gaussian_process.parts import is_separable
from unconstrain.gaussian_process.process import Process

ROUNDING = 1e-10
"""Share of the largest eigenvalue of inducing rows' covariance, below which one is left out."""


@dataclass(frozen=True)
class InducingFeatures:
    """Features of a process along directions, of any kernel.

    Parameters
    ----------
    kernel : Kernel
        Covariance of the prior.
    scaling : Scaling
        Of the states.
    pairs : ndarray of shape (R, n + d)
        Inducing rows.
    whitener : ndarray of shape (R, P)
        B.
    """

    kernel: Any
    scaling: Scaling
    pairs: np.ndarray
    whitener: np.ndarray

    @property
    def n_actions(self) -> int:
        """Number of actions d."""
        return self.pairs.shape[1] - len(self.scaling.mean)

    def fit(self, X: np.ndarray, d: int) -> "InducingFeatures":
        """Return the features as they are; everything is placed."""
        return self

    def along(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Compute the features along one direction at each state, (N, P); see `features.base`."""
        return self.along_rows(pair(self.scaling(X), directions))

    def along_rows(self, pairs: np.ndarray) -> np.ndarray:
        """Compute the features of rows of standardised states and directions, (N, P)."""
        return np.asarray(self.kernel(pairs, self.pairs) @ self.whitener)

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Evaluate the policy, (N, d); see `features.base`."""
        seen = every_direction(self.scaling(X), self.n_actions)
        return (self.kernel(seen, self.pairs) @ (self.whitener @ w)).reshape(len(X), -1)

    def missed(self, X: np.ndarray) -> np.ndarray:
        """Compute what the features leave out of the prior's variance of an action, (N,), the mean of all actions."""
        Z, d = self.scaling(X), self.n_actions
        left = np.zeros(len(Z))
        for axis in np.eye(d):
            directions = np.broadcast_to(axis, (len(Z), d))
            prior = self.kernel.diag(pair(Z, directions))
            left += prior - np.sum(self.along(X, directions) ** 2, axis=1)
        return np.maximum(left / d, 0.0)

    def process(self, moments: Moments, size: float, noise: float) -> Process:
        """Condition the process on what moments have summed up.

        Parameters
        ----------
        moments : Moments
            Of these features, actions in their own unit.
        size : float
            In what the policy is counted, in the unit of the action.
        noise : float
            σ², in squared units of `size`.

        Returns
        -------
        Process
            The posterior.
        """
        from scipy.linalg import cho_factor, cho_solve

        H, g = moments.H, moments.g / size
        P = len(H)
        factored = cho_factor(H + noise * np.eye(P))
        left = noise * cho_solve(factored, np.eye(P))
        w = cho_solve(factored, g)
        used = P - float(np.trace(left))
        return self._process(w, left, used, size, noise)

    def _process(self, w: np.ndarray, left: np.ndarray, used: float, size: float, noise: float) -> Process:
        coefficients = (self.whitener @ w)[:, 0]
        return Process(
            self.kernel, self.scaling, size, self.pairs, coefficients, noise, used, self.whitener, left
        )


@dataclass(frozen=True)
class SeparableFeatures(InducingFeatures):
    """The same of a separable kernel, whose actions share one basis of inducing states: the fast sums are for these.

    Parameters
    ----------
    kernel, scaling : as for `InducingFeatures`
        Covariance of the prior, and of the states.
    pairs : ndarray of shape (M, n + d)
        Inducing states along the first action.
    whitener : ndarray of shape (M, P)
        B of these.
    """

    def basis(self, X: np.ndarray) -> np.ndarray:
        """Compute the basis that all actions share, (N, P)."""
        Z = self.scaling(X)
        first = np.broadcast_to(np.eye(self.n_actions)[0], (len(Z), self.n_actions))
        return np.asarray(self.kernel(pair(Z, first), self.pairs) @ self.whitener)

    def missed(self, X: np.ndarray) -> np.ndarray:
        """Compute what the features leave out of the prior's variance of an action, (N,)."""
        Z = self.scaling(X)
        first = np.broadcast_to(np.eye(self.n_actions)[0], (len(Z), self.n_actions))
        return np.maximum(self.kernel.diag(pair(Z, first)) - np.sum(self.basis(X) ** 2, axis=1), 0.0)

    def along(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Compute the features along one direction at each state, (N, d P)."""
        return (directions[:, :, None] * self.basis(X)[:, None, :]).reshape(len(X), -1)

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Evaluate the policy, (N, d)."""
        return self.basis(X) @ w.reshape(self.n_actions, -1).T

    def _process(self, w: np.ndarray, left: np.ndarray, used: float, size: float, noise: float) -> Process:
        d, P = self.n_actions, self.whitener.shape[1]
        n = len(self.scaling.mean)
        shares = w.shape[1] > 1  # all actions have the same moments
        W = w if shares else w.reshape(d, P).T
        return Process(
            self.kernel,
            self.scaling,
            size,
            every_direction(self.pairs[:, :n], d),
            (self.whitener @ W).reshape(-1),
            noise,
            d * used if shares else used,
            # The rows of a state follow each other, the parameters of an action do.
            np.einsum("mp,ij->mijp", self.whitener, np.eye(d)).reshape(len(self.pairs) * d, d * P),
            np.kron(np.eye(d), left) if shares else left,
        )


def make_features(kernel: Any, scaling: Scaling, states: np.ndarray, d: int, most: int) -> InducingFeatures:
    """Make the features of some inducing states.

    Parameters
    ----------
    kernel : Kernel
        Covariance of the prior.
    scaling : Scaling
        Of the states.
    states : ndarray of shape (M, n)
        Inducing states, standardised, the most important first.
    d : int
        Number of actions.
    most : int
        How many parameters there may be.

    Returns
    -------
    InducingFeatures
        Of as many of the states as that allows.
    """
    states = states[: max(1, most // d)]
    if is_separable(kernel):
        pairs = pair(states, np.broadcast_to(np.eye(d)[0], (len(states), d)))
        return SeparableFeatures(kernel, scaling, pairs, _whitener(kernel(pairs)))
    pairs = every_direction(states, d)
    return InducingFeatures(kernel, scaling, pairs, _whitener(kernel(pairs)))


def _whitener(K: np.ndarray) -> np.ndarray:
    values, vectors = np.linalg.eigh(K)
    kept = values > ROUNDING * values[-1]
    return vectors[:, kept] / np.sqrt(values[kept])
