"""What to record next: the states and free directions that would tell most.

A recording at x along a free direction q shows `vᵀw`, `v = Φ(x)ᵀq`, r times over with the noise σ² that the data
have. Of the posterior `w ~ N(m, Σ)` it leaves `Σ - Σv vᵀΣ / (σ²/r + vᵀΣv)`, whatever its outcome. Two gains:

    A-optimal    vᵀΣGΣv / (σ²/r + vᵀΣv)    by how much the expected squared error over the candidate states falls
    D-optimal    log(1 + r vᵀΣv / σ²)      by how much the entropy of w falls, in two nats

with `G = Σ ΦᵀΦ` over the candidates. Recordings are chosen one after the other, each as if those before were made: for
D, whose gains only fall as recordings are added, that is within `1 - 1/e` of the best k (Nemhauser et al., 1978). Local
models gain each on its own, in proportion to its activation. Source: Pukelsheim, Optimal design of experiments, 1993.
"""

from dataclasses import dataclass, replace

import numpy as np

from unconstrain.fitting.observation import observe
from unconstrain.fitting.posterior import Posterior
from unconstrain.policies.base import Policy

CRITERIA = ("A", "D")


@dataclass(frozen=True)
class Recording:
    """One recording to make: from `state` (n,), with motion along `direction` (d,) free.

    deviation: how far the policy may be from the prediction there, along the direction, in units of the action.
    gain: share of the expected squared error over the candidate states that it takes away, from what those before left.
    """

    state: np.ndarray
    direction: np.ndarray
    deviation: float
    gain: float


class Planner:
    """Gains of recordings at candidate states (C, n), each worth `repeats` samples."""

    def __init__(self, policy: Policy, posterior: Posterior, candidates: np.ndarray, repeats: float):
        self.policy, self.X, self.repeats = policy, candidates, repeats
        self.posterior = posterior
        everything = observe("direct", np.zeros((len(candidates), policy.n_actions_)))
        self.G = self._stack(policy.model_.moments(candidates, everything).H)

    def next(self, k: int, criterion: str) -> list[Recording]:
        """Return the k best, one after the other; the planner is left as if they were made."""
        return [self._best(criterion) for _ in range(k)]

    def gains(self, X: np.ndarray, directions: np.ndarray, criterion: str = "A") -> np.ndarray:
        """Of recordings at X (C, n) along directions (C, d): (C,); of A in squared units, summed over candidates."""
        V, weights = self.policy.model_.along(X, directions), self.policy.model_.reach(X)
        total = np.zeros(len(X))
        for covariance, G, sigma2, weight in zip(
            self._covariance(), self.G, self._noise(), weights.T, strict=True
        ):
            S = V @ covariance
            told = weight * np.einsum("cp,cp->c", S, V)
            if criterion == "D":
                total += np.log1p(told / sigma2)
            else:
                total += weight * self._missed(S, G) / (sigma2 + told)
        return total

    def expected_error(self) -> float:
        """`Σ_m tr(G_m Σ_m)`, summed over the candidates."""
        copies = self._copies()
        return float(
            sum(
                np.einsum("jajb,ab->", covariance.reshape(copies, len(G), copies, len(G)), G)
                for covariance, G in zip(self._covariance(), self.G, strict=True)
            )
        )

    def _best(self, criterion: str) -> Recording:
        second = self.policy.covariance(self.X, self.posterior)
        values, vectors = np.linalg.eigh(second)
        C, d = values.shape
        X, q = np.repeat(self.X, d, axis=0), vectors.swapaxes(1, 2).reshape(C * d, d)
        best = int(np.argmax(self.gains(X, q, criterion)))
        before = self.expected_error()
        self.record(X[best : best + 1], q[best : best + 1])
        gain = 1.0 - self.expected_error() / before if before > 0 else 0.0
        return Recording(X[best], q[best], float(np.sqrt(max(values.reshape(-1)[best], 0.0))), gain)

    def record(self, x: np.ndarray, q: np.ndarray) -> None:
        """Take the recording at x (1, n) along q (1, d) into the posterior."""
        v, weights = self.policy.model_.along(x, q)[0], self.policy.model_.reach(x)[0]
        left = []
        for covariance, sigma2, weight in zip(self._covariance(), self._noise(), weights, strict=True):
            s = covariance @ v
            left.append(covariance - weight * np.outer(s, s) / (sigma2 + weight * (v @ s)))
        shape = self.posterior.covariance.shape
        self.posterior = replace(self.posterior, covariance=np.reshape(left, shape))

    def _missed(self, S: np.ndarray, G: np.ndarray) -> np.ndarray:
        """`sᵀGs` for rows s of S (C, P), where G is a block (P / copies, P / copies) or whole."""
        parts = S.reshape(len(S), -1, len(G))
        return np.einsum("cjp,cjp->c", parts @ G, parts)

    def _noise(self) -> np.ndarray:
        """`σ²/r` of each model, (S,); never zero, since gains are divided by it."""
        return np.maximum(np.atleast_1d(self.posterior.noise), np.finfo(np.float64).tiny) / self.repeats

    def _covariance(self) -> np.ndarray:
        return self._stack(self.posterior.covariance)

    def _copies(self) -> int:
        return self.posterior.covariance.shape[-1] // self.G.shape[-1]

    @staticmethod
    def _stack(matrices: np.ndarray) -> np.ndarray:
        return matrices if matrices.ndim == 3 else matrices[None]
