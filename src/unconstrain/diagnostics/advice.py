"""What to record next: the states and free directions whose recording would lessen the expected error most.

A recording along a free direction q passes T points x_t, as the policy learnt so far foresees it (`foresight`). At each
it shows `v_tᵀw`, `v_t = Φ(x_t)ᵀq`, r/T times with the noise σ² that the data have. With rows `√ω_t v_tᵀ` of V, that
turns the posterior covariance Σ of `w ~ N(m, Σ)` into `Σ - ΣVᵀ S⁻¹ VΣ`, `S = σ²T/r I + VΣVᵀ`, whatever its outcome.
Points that tell the same count once. Two gains:

    A-optimal    tr(S⁻¹ VΣGΣVᵀ)        by how much the expected squared error over the candidate states falls
    D-optimal    log det(S T⁻¹r / σ²)   by how much the entropy of w falls, in two nats

with `G = Σ ΦᵀΦ` over the candidates. Recordings are chosen one after the other, each as if those before were made: for
D, whose gains only fall as recordings are added, that is within `1 - 1/e` of the best k (Nemhauser et al., 1978). Each
local model gains by itself: a sample counts in proportion to its activation K, and G has the share of the model in the
blend.

With the adaptive risk nobody tells the fit that motion was free along q alone. A sample then shows the policy with the
Fisher information `(‖u‖²/‖π‖²) ûûᵀ/σ²`, hence ω, in expectation with the covariance C of the policy at x:

    ω = E (qᵀπ)² / E ‖π‖² = (qᵀCq + (qᵀp)²) / (tr C + ‖p‖²),        else ω = 1.

Of samples whose projection it is told, as of a share of those so far, ω is 1 as well.

Nor is it sure which of the samples so far were free. Where movements hardly cross, all of them may be called free,
though none was; the posterior then takes for known what no sample shows, and would send a person anywhere else. So the
expected error is a mean over two readings of the recordings: that which was inferred, and that in which every sample
shows no more than what lies along its motion. A recording that tells the two apart lowers the second's.

References
----------
Pukelsheim, Optimal design of experiments, 1993.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from unconstrain.diagnostics.foresight import Foresight, Movements
from unconstrain.fitting.observation import observe
from unconstrain.fitting.posterior import Posterior
from unconstrain.parallel import cut_blocks
from unconstrain.policies.linear import LinearPolicy
from unconstrain.waiting import each, stage

CRITERIA = ("A", "D")

ROUNDING = 1e-8
"""Variance of a point relative to that of the others which does not count."""

NEGLIGIBLE = 1e-6
"""Activation below which a movement does not reach a local model."""

MOVEMENTS_IN_BLOCK = 1024

FEW_ACTIONS = 3
"""So many actions have directions between the axes tried as well."""


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
    policy : LinearPolicy
        Fitted.
    posteriors : sequence of Posterior
        Of the recordings made so far, in every reading of them, as likely as each other. The first is that of the
        policy.
    candidates : ndarray of shape (C, n)
        States where a recording can start, and where the policy matters.
    length : float
        How many samples a recording is worth, r.
    foresight : Foresight, optional
        Where recordings lead; by default they stay where they start.

    Attributes
    ----------
    X : ndarray of shape (C, n)
        The candidates.
    posteriors : list of Posterior
        Those of all recordings so far, including those chosen.
    """

    def __init__(
        self,
        policy: LinearPolicy,
        posteriors: Sequence[Posterior],
        candidates: np.ndarray,
        length: float,
        foresight: Foresight | None = None,
    ):
        self.policy, self.X, self.length = policy, candidates, length
        self.posteriors = list(posteriors)
        self.foresight = foresight or Foresight(policy)
        everything = observe("direct", np.zeros((len(candidates), policy.n_actions_)))
        reach = policy.model_.reach(candidates).sum(axis=1)
        # Moments weigh by activations; divided by their sum these are the shares in the blend.
        shares = np.divide(1.0, reach, out=np.zeros_like(reach), where=reach > np.finfo(np.float64).tiny)
        self._G = _stack(policy.model_.moments(candidates, everything, shares).H)

    @stage("choosing what to record next")
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
        X, q = self._propose()
        movements = self.foresight.follow(X, q, self.length)
        chosen = []
        for _ in each(range(k), "choosing what to record next", unit="recordings"):
            best = int(np.argmax(self.gains_of(movements, criterion)))
            one = slice(best, best + 1)
            covariance = self.policy.covariance(X[one], self.posteriors[0])[0]
            before = self.expected_error()
            self.record_movements(movements.select(one))
            gain = 1.0 - self.expected_error() / before if before > 0 else 0.0
            deviation = float(np.sqrt(max(q[best] @ covariance @ q[best], 0.0)))
            chosen.append(PlannedRecording(X[best], q[best], deviation, gain))
        return chosen

    def gains(self, X: np.ndarray, directions: np.ndarray, criterion: str = "A") -> np.ndarray:
        """Compute the gains of recordings, as they are foreseen.

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
        return self.gains_of(self.foresight.follow(X, directions, self.length), criterion)

    def gains_of(self, movements: Movements, criterion: str = "A") -> np.ndarray:
        """Compute the gains of movements whose way is known.

        Parameters
        ----------
        movements : Movements
            R of them.
        criterion : {"A", "D"}
            Which gain to compute.

        Returns
        -------
        ndarray of shape (R,)
            As for `gains`.
        """
        total = np.zeros(len(movements))
        blocks = cut_blocks(len(movements), MOVEMENTS_IN_BLOCK)
        for rows in each(blocks, "weighing movements", unit="blocks"):
            V, weights = self._show(movements.select(rows))
            for posterior in self.posteriors:
                for model in zip(*_parts(posterior), self._G, weights, strict=True):
                    total[rows] += self._gains_in(*model, V, criterion)
        return total / len(self.posteriors)

    def _gains_in(
        self,
        covariance: np.ndarray,
        noise: float,
        G: np.ndarray,
        weight: np.ndarray,
        V: np.ndarray,
        criterion: str,
    ) -> np.ndarray:
        """Compute the gains (R,) of one model, by what movements show (R, T, P) and what that counts in it (R, T)."""
        gains, reached = np.zeros(len(V)), np.flatnonzero(weight.max(axis=1) > NEGLIGIBLE)
        if not len(reached):
            return gains
        noise *= V.shape[1] / self.length
        K, S = _project(V[reached] * np.sqrt(weight[reached])[..., None], covariance, noise)
        if criterion == "D":
            gains[reached] = np.linalg.slogdet(S / noise)[1]
        else:
            right = (K.reshape(*K.shape[:2], -1, len(G)) @ G).reshape(K.shape)
            gains[reached] = np.einsum("rij,rji->r", np.linalg.inv(S), right @ K.swapaxes(1, 2))
        return gains

    def expected_error(self) -> float:
        """Compute the expected squared error over the candidates, `Σ_m tr(G_m Σ_m)`.

        Returns
        -------
        float
            In squared units of the action, summed over candidates.
        """
        S, P = len(self._G), self._G.shape[-1]
        total = 0.0
        for posterior in self.posteriors:
            covariance = _stack(posterior.covariance)
            blocks = covariance.reshape(S, -1, P, covariance.shape[-1] // P, P)
            total += float(np.einsum("sjajb,sab->", blocks, self._G))
        return total / len(self.posteriors)

    def record(self, X: np.ndarray, directions: np.ndarray) -> None:
        """Take recordings into the posterior, as they are foreseen.

        Parameters
        ----------
        X : ndarray of shape (R, n)
            Where each starts.
        directions : ndarray of shape (R, d)
            Directions of length one along which motion is free.
        """
        self.record_movements(self.foresight.follow(X, directions, self.length))

    def record_movements(self, movements: Movements) -> None:
        """Take movements whose way is known into the posterior.

        Parameters
        ----------
        movements : Movements
            One or more.
        """
        V, weights = self._show(movements)
        for rows, weight in zip(V, weights.swapaxes(0, 1), strict=True):
            self.posteriors = [self._learn(posterior, rows, weight) for posterior in self.posteriors]

    def _learn(self, posterior: Posterior, rows: np.ndarray, weights: np.ndarray) -> Posterior:
        """Take one movement into a posterior: its rows (T, P), and what they count in every model (S, T)."""
        left = []
        for covariance, noise, weight in zip(*_parts(posterior), weights, strict=True):
            V = rows * np.sqrt(weight)[:, None]
            K, S = _project(V[None], covariance, noise * len(rows) / self.length)
            after = covariance - K[0].T @ np.linalg.solve(S[0], K[0])
            left.append((after + after.T) / 2)
        return replace(posterior, covariance=np.reshape(left, posterior.covariance.shape))

    def _propose(self) -> tuple[np.ndarray, np.ndarray]:
        """Propose starts and directions: axes of the policy's covariance at the candidates, and between them."""
        vectors = np.linalg.eigh(self._covariance(self.X))[1].swapaxes(1, 2)
        d = vectors.shape[1]
        if d <= FEW_ACTIONS:
            i, j = np.triu_indices(d, 1)
            between = np.concatenate([vectors[:, i] + vectors[:, j], vectors[:, i] - vectors[:, j]], axis=1)
            vectors = np.concatenate([vectors, between / np.sqrt(2.0)], axis=1)
        return np.repeat(self.X, vectors.shape[1], axis=0), vectors.reshape(-1, d)

    def _show(self, movements: Movements) -> tuple[np.ndarray, np.ndarray]:
        """Compute what movements show: rows (R, T, P), and what each counts in every model, (S, R, T)."""
        R, T = movements.states.shape[:2]
        X, q = movements.states.reshape(R * T, -1), movements.directions.reshape(R * T, -1)
        weights = self.policy.model_.reach(X)
        if self.policy.solution_.belief is not None:
            P = np.reshape(self.policy.predict(X), q.shape)
            C = self._covariance(X)
            whole = np.einsum("njj->n", C) + np.sum(P**2, axis=1)
            along = np.einsum("ni,nij,nj->n", q, C, q) + np.sum(q * P, axis=1) ** 2
            share = np.divide(along, whole, out=np.zeros_like(whole), where=whole > 0)
            told = self.foresight.told
            weights = weights * (told + (1.0 - told) * share)[:, None]
        return self.policy.model_.along(X, q).reshape(R, T, -1), weights.T.reshape(-1, R, T)

    def _covariance(self, X: np.ndarray) -> np.ndarray:
        """Compute the policy's second moments about its predictions, a mean over the readings, (N, d, d)."""
        return np.mean([self.policy.covariance(X, posterior) for posterior in self.posteriors], axis=0)


def _project(V: np.ndarray, covariance: np.ndarray, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Compute VΣ (R, T, P) and S (R, T, T), regular also where the noise is far below rounding."""
    K = V @ covariance
    inner = K @ V.swapaxes(1, 2)
    T = V.shape[1]
    least = noise + ROUNDING * np.einsum("rtt->r", inner) / T
    return K, inner + least[:, None, None] * np.eye(T)


def _parts(posterior: Posterior) -> tuple[np.ndarray, np.ndarray]:
    """Get Σ (S, P, P) and σ² (S,) of each model; never zero, since gains are divided by it."""
    noise = np.maximum(np.atleast_1d(posterior.noise), np.finfo(np.float64).tiny)
    covariances = _stack(posterior.covariance)
    return covariances, np.broadcast_to(noise, (len(covariances),))


def _stack(matrices: np.ndarray) -> np.ndarray:
    """Give matrices (P, P) or (S, P, P) a leading axis of models."""
    return matrices.reshape(-1, *matrices.shape[-2:])
