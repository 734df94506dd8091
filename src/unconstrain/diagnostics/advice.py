"""What to record next: the states and free directions whose recording would lessen the expected error most.

A recording at x along a free direction q shows `vᵀw`, `v = Φ(x)ᵀq`, r times with the noise σ² that the data have. It
turns the posterior covariance Σ of `w ~ N(m, Σ)` into `Σ - Σv vᵀΣ / (σ²/r + vᵀΣv)`, whatever its outcome. Two gains:

    A-optimal    vᵀΣGΣv / (σ²/r + vᵀΣv)    by how much the expected squared error over the candidate states falls
    D-optimal    log(1 + r vᵀΣv / σ²)      by how much the entropy of w falls, in two nats

with `G = Σ ΦᵀΦ` over the candidates. Recordings are chosen one after the other, each as if those before were made: for
D, whose gains only fall as recordings are added, that is within `1 - 1/e` of the best k (Nemhauser et al., 1978). Each
local model gains by itself, in proportion to its activation.

References
----------
Pukelsheim, Optimal design of experiments, 1993.
"""

from dataclasses import dataclass, replace

import numpy as np

from unconstrain.fitting.observation import observe
from unconstrain.fitting.posterior import Posterior
from unconstrain.policies.base import Policy

CRITERIA = ("A", "D")


@dataclass(frozen=True)
class PlannedRecording:
    """One recording to make.

    Parameters
    ----------
    state : ndarray of shape (n,)
        Where it starts.
    direction : ndarray of shape (d,)
        The direction of length one along which motion is free.
    deviation : float
        How far the policy may be from the prediction there along the direction, in units of the action.
    gain : float
        By which share it lessens the expected squared error over the candidate states that the recordings before it
        left.
    """

    state: np.ndarray
    direction: np.ndarray
    deviation: float
    gain: float


class Planner:
    """Chooses recordings among candidate states, and takes those chosen into the posterior.

    Parameters
    ----------
    policy : Policy
        Fitted.
    posterior : Posterior
        Of the recordings made so far.
    candidates : ndarray of shape (C, n)
        States where a recording can start, and where the policy matters.
    repeats : float
        How many samples a recording is worth, r.

    Attributes
    ----------
    X : ndarray of shape (C, n)
        The candidates.
    posterior : Posterior
        That of all recordings so far, including those chosen.
    """

    def __init__(self, policy: Policy, posterior: Posterior, candidates: np.ndarray, repeats: float):
        self.policy, self.X, self.repeats = policy, candidates, repeats
        self.posterior = posterior
        everything = observe("direct", np.zeros((len(candidates), policy.n_actions_)))
        self._G = _stack(policy.model_.moments(candidates, everything).H)

    def choose(self, k: int, criterion: str = "A") -> list[PlannedRecording]:
        """Choose the k best recordings one after the other, and take them into the posterior.

        Parameters
        ----------
        k : int
            How many.
        criterion : {"A", "D"}
            Which gain counts.

        Returns
        -------
        list of PlannedRecording
            The best first.
        """
        return [self._choose_one(criterion) for _ in range(k)]

    def gains(self, X: np.ndarray, directions: np.ndarray, criterion: str = "A") -> np.ndarray:
        """Compute the gains of recordings.

        Parameters
        ----------
        X : ndarray of shape (R, n)
            Where each starts.
        directions : ndarray of shape (R, d)
            Directions of length one along which motion is free.
        criterion : {"A", "D"}
            Which gain to compute.

        Returns
        -------
        ndarray of shape (R,)
            A: in squared units of the action, summed over candidates. D: in two nats.
        """
        V, weights = self.policy.model_.along(X, directions), self.policy.model_.reach(X)
        total = np.zeros(len(X))
        for covariance, G, noise, weight in zip(
            self._covariances, self._G, self._noise, weights.T, strict=True
        ):
            S = V @ covariance
            variance = weight * np.einsum("cp,cp->c", S, V)
            if criterion == "D":
                total += np.log1p(variance / noise)
            else:
                parts = S.reshape(len(S), -1, len(G))
                total += weight * np.einsum("cjp,cjp->c", parts @ G, parts) / (noise + variance)
        return total

    def expected_error(self) -> float:
        """Compute the expected squared error over the candidates, `Σ_m tr(G_m Σ_m)`.

        Returns
        -------
        float
            In squared units of the action, summed over candidates.
        """
        P = self._G.shape[-1]
        blocks = self._covariances.reshape(len(self._G), -1, P, self._covariances.shape[-1] // P, P)
        return float(np.einsum("sjajb,sab->", blocks, self._G))

    def record(self, x: np.ndarray, direction: np.ndarray) -> None:
        """Take a recording into the posterior.

        Parameters
        ----------
        x : ndarray of shape (1, n)
            Where it starts.
        direction : ndarray of shape (1, d)
            The direction of length one along which motion is free.
        """
        v, weights = self.policy.model_.along(x, direction)[0], self.policy.model_.reach(x)[0]
        left = []
        for covariance, noise, weight in zip(self._covariances, self._noise, weights, strict=True):
            s = covariance @ v
            left.append(covariance - weight * np.outer(s, s) / (noise + weight * (v @ s)))
        shape = self.posterior.covariance.shape
        self.posterior = replace(self.posterior, covariance=np.reshape(left, shape))

    def _choose_one(self, criterion: str) -> PlannedRecording:
        values, vectors = np.linalg.eigh(self.policy.covariance(self.X, self.posterior))
        C, d = values.shape
        X, q = np.repeat(self.X, d, axis=0), vectors.swapaxes(1, 2).reshape(C * d, d)
        best = int(np.argmax(self.gains(X, q, criterion)))
        before = self.expected_error()
        self.record(X[best : best + 1], q[best : best + 1])
        gain = 1.0 - self.expected_error() / before if before > 0 else 0.0
        deviation = float(np.sqrt(max(values.reshape(-1)[best], 0.0)))
        return PlannedRecording(X[best], q[best], deviation, gain)

    @property
    def _noise(self) -> np.ndarray:
        """`σ²/r` of each model, (S,); never zero, since gains are divided by it."""
        return np.maximum(np.atleast_1d(self.posterior.noise), np.finfo(np.float64).tiny) / self.repeats

    @property
    def _covariances(self) -> np.ndarray:
        """Σ of each model, (S, P, P)."""
        return _stack(self.posterior.covariance)


def _stack(matrices: np.ndarray) -> np.ndarray:
    """Give matrices (P, P) or (S, P, P) a leading axis of models."""
    return matrices.reshape(-1, *matrices.shape[-2:])
