"""Policies that are linear in their parameters: fitted places, no parameters.

A model says how samples add up to moments, and what parameters solved from them mean. It never changes, so threads and
processes may share it. There are two: one set of parameters for all states, and local models that are blended.
"""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from unconstrain.errors import PolicyError
from unconstrain.features.base import Compilable, Features, FullBasis
from unconstrain.fitting.kernels import local, parametric
from unconstrain.fitting.kernels.products import distinct_products, pairs
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import Observation
from unconstrain.fitting.posterior import Posterior
from unconstrain.receptive import activations, normalized_activations

BLOCK_ROWS = 4096
COVARIANCE_ROWS = 1024


class Model(Protocol):
    """What accumulators, estimators and diagnostics ask of a model."""

    @property
    def features(self) -> Features:
        """The fitted feature map, of each of the models."""
        ...

    @property
    def n_states(self) -> int:
        """Number n of states."""
        ...

    @property
    def n_actions(self) -> int:
        """Number d of actions."""
        ...

    @property
    def n_models(self) -> int:
        """How many sets of parameters there are, S."""
        ...

    @property
    def shares_basis(self) -> bool:
        """Whether all actions share one basis, `Φ(x) = I ⊗ b(x)ᵀ`."""
        ...

    def moments(self, X: np.ndarray, observation: Observation, weights: np.ndarray | None = None) -> Moments:
        """Return the sums of samples at states X (N, n) with weights (N,); stacked where there are several models."""
        ...

    def parameters(self, w: np.ndarray) -> np.ndarray:
        """Return a solution w (..., P / K, K) of the moments as parameters, (P,) or (S, P)."""
        ...

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Return the policy with parameters w at states X (N, n): (N, d)."""
        ...

    def covariance(self, X: np.ndarray, P: np.ndarray, posterior: Posterior) -> np.ndarray:
        """Second moments (N, d, d) of the true policy about predictions P (N, d) at states X (N, n)."""
        ...

    def along(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """`Φ(x)ᵀq` of any of the models, (N, P), for states X (N, n) and directions (N, d)."""
        ...

    def reach(self, X: np.ndarray) -> np.ndarray:
        """How much of a sample at X (N, n) reaches each model, (N, S)."""
        ...

    def compile(self, w: np.ndarray) -> Any:
        """Compile the policy with parameters w."""
        ...


@dataclass(frozen=True)
class GlobalModel:
    """`π(x) = Φ(x) w`: one set of parameters for all states.

    Parameters
    ----------
    features : Features
        Fitted.
    n_states, n_actions : int
        n and d.
    """

    features: Features
    n_states: int
    n_actions: int

    @property
    def n_models(self) -> int:
        """One."""
        return 1

    @property
    def shares_basis(self) -> bool:
        """Whether all actions share one basis, `Φ(x) = I ⊗ b(x)ᵀ`."""
        return isinstance(self.features, FullBasis)

    def moments(self, X: np.ndarray, observation: Observation, weights: np.ndarray | None = None) -> Moments:
        """Return the sums of samples.

        Parameters
        ----------
        X : array (N, n)
            States, of any precision.
        observation : Observation
            What the recorded actions say.
        weights : array (N,), optional
            Weights of the samples.

        Returns
        -------
        Moments
            Their sums.
        """
        return parametric.moments(self.features, X, observation, weights)

    def parameters(self, w: np.ndarray) -> np.ndarray:
        """Return a solution w (P / K, K) of the moments as parameters (P,)."""
        return w.T.reshape(-1)

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Return the policy with parameters w (P,) at states X (N, n): (N, d)."""
        return self.features.evaluate(X, w)

    def covariance(self, X: np.ndarray, P: np.ndarray, posterior: Posterior) -> np.ndarray:
        """Second moments (N, d, d) of the true policy about predictions P (N, d) at states X (N, n)."""
        bias = self.features.evaluate(X, self.parameters(posterior.mean)) - P
        result = bias[:, :, None] * bias[:, None, :]
        for start in range(0, len(X), COVARIANCE_ROWS):
            rows = slice(start, start + COVARIANCE_ROWS)
            result[rows] += self._spread(X[rows], posterior.covariance)
        return result

    def along(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """`Φ(x)ᵀq`, (N, P), for states X (N, n) and directions (N, d)."""
        return self.features.along(X, directions)

    def reach(self, X: np.ndarray) -> np.ndarray:
        """Ones, (N, 1): every sample reaches the model whole."""
        return np.ones((len(X), 1))

    def compile(self, w: np.ndarray) -> Any:
        """Compile the policy with parameters w (P,). Raises `PolicyError` where the features cannot be compiled."""
        if not isinstance(self.features, Compilable):
            raise PolicyError(
                f"a policy with {type(self.features).__name__} features cannot be compiled, since they have no method "
                "compile(w): use predict, or other features"
            )
        return self.features.compile(w)

    def _spread(self, X: np.ndarray, covariance: np.ndarray) -> np.ndarray:
        """`Φ(x) Σ Φ(x)ᵀ`, (N, d, d)."""
        d = self.n_actions
        if isinstance(self.features, FullBasis):
            return _spread_of_basis(self.features.basis(X), covariance, d)
        V = [self.features.along(X, np.broadcast_to(row, (len(X), d))) for row in np.eye(d)]
        result = np.empty((len(X), d, d))
        for j in range(d):
            half = V[j] @ covariance
            for k in range(j, d):
                result[:, j, k] = result[:, k, j] = np.einsum("np,np->n", half, V[k])
        return result


@dataclass(frozen=True)
class LocalModels:
    """`π(x) = Σ_m ω_m(x) Φ(x) w_m` with `ω_m = K_m / Σ_j K_j` and `K_m(x) = exp(-‖x - c_m‖² / 2σ²)`.

    Each w_m minimises the risk with its samples weighted by K_m, whatever the other models do.

    Parameters
    ----------
    features : Features
        Fitted; the same for every model.
    centers : array (M, n)
        Centres of the models.
    width : float
        σ, in the states' unit.
    n_actions : int
        d.

    References
    ----------
    Howard et al., ICRA 2009, Sec. III-B.
    """

    features: Features
    centers: np.ndarray
    width: float
    n_actions: int

    @property
    def n_states(self) -> int:
        """Number n of states."""
        return self.centers.shape[1]

    @property
    def n_models(self) -> int:
        """M."""
        return len(self.centers)

    @property
    def shares_basis(self) -> bool:
        """Whether all actions share one basis, `Φ(x) = I ⊗ b(x)ᵀ`."""
        return isinstance(self.features, FullBasis)

    def moments(self, X: np.ndarray, observation: Observation, weights: np.ndarray | None = None) -> Moments:
        """Return the sums of samples, stacked along a leading axis of M models.

        Parameters
        ----------
        X : array (N, n)
            States, of any precision.
        observation : Observation
            What the recorded actions say.
        weights : array (N,), optional
            Weights of the samples.

        Returns
        -------
        Moments
            Their sums.
        """
        return local.moments(self.features, self.centers, self.width, X, observation, weights)

    def parameters(self, w: np.ndarray) -> np.ndarray:
        """Return a solution w (M, P / K, K) of the moments as parameters (M, P)."""
        return w.swapaxes(-1, -2).reshape(len(w), -1)

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Return the policy with parameters w (M, P) at states X (N, n): (N, d)."""
        actions = np.zeros((len(X), self.n_actions))
        for start in range(0, len(X), BLOCK_ROWS):
            block = X[start : start + BLOCK_ROWS]
            blend = normalized_activations(block, self.centers, self.width)
            local = self._evaluate_each(block, w)
            actions[start : start + BLOCK_ROWS] = np.einsum("nm,nmd->nd", blend, local)
        return actions

    def covariance(self, X: np.ndarray, P: np.ndarray, posterior: Posterior) -> np.ndarray:
        """Second moments (N, d, d) of the mixture of the models about predictions P (N, d) at states X (N, n).

        Neighbours learn from shared samples, so their errors do not average out. By convexity the mixture's second
        moment is an upper bound on that of the blend, however the models depend on each other.
        """
        d, w = self.n_actions, self.parameters(posterior.mean)
        result = np.empty((len(X), d, d))
        spread_of = self._mixed_spread(posterior)
        for start in range(0, len(X), COVARIANCE_ROWS):
            block = X[start : start + COVARIANCE_ROWS]
            blend = normalized_activations(block, self.centers, self.width)
            spread = spread_of(block, blend)
            apart = self._evaluate_each(block, w) - P[start : start + COVARIANCE_ROWS, None]
            spread += np.swapaxes(apart * blend[:, :, None], 1, 2) @ apart
            result[start : start + COVARIANCE_ROWS] = (spread + spread.swapaxes(1, 2)) / 2
        return result

    def along(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """`Φ(x)ᵀq` of any of the models, (N, P), for states X (N, n) and directions (N, d)."""
        return self.features.along(X, directions)

    def reach(self, X: np.ndarray) -> np.ndarray:
        """Return the activations K_m(x), (N, M)."""
        return activations(X, self.centers, self.width)

    def compile(self, w: np.ndarray) -> Any:
        """Compile the policy with parameters w (M, P). Raises `PolicyError` unless its models are linear."""
        from unconstrain.deploy.compiled import LocallyLinear

        linear = self.linear_parameters(w)
        if linear is None:
            raise PolicyError(
                "local models on features other than (x, 1) cannot be compiled: use predict, or linear local models"
            )
        return LocallyLinear(centers=self.centers, width=self.width, coef=linear[0], intercept=linear[1])

    def linear_parameters(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Slopes (M, d, n) and offsets (M, d) of local models on the features (x, 1); None for other features."""
        if getattr(self.features, "transformer_", w) is not None:
            return None
        models = w.reshape(len(w), self.n_actions, -1)
        return models[:, :, :-1].copy(), models[:, :, -1].copy()

    def _evaluate_each(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Return the actions of every model, (N, M, d)."""
        M, d = len(w), self.n_actions
        if isinstance(self.features, FullBasis):
            B = self.features.basis(X)
            return (B @ w.reshape(M * d, -1).T).reshape(len(X), M, d)
        return np.stack([self.features.evaluate(X, each) for each in w], axis=1)

    def _mixed_spread(self, posterior: Posterior) -> Any:
        """Return a function of states (N, n) and blend (N, M) that returns `Σ_m ω_m Φ Σ_m Φᵀ`, (N, d, d)."""
        M, d = self.n_models, self.n_actions
        if not isinstance(self.features, FullBasis):
            one = GlobalModel(self.features, self.n_states, d)

            def spread_of_any(X: np.ndarray, blend: np.ndarray) -> np.ndarray:
                zero = np.zeros((len(X), d))
                total = np.zeros((len(X), d, d))
                for m in range(M):
                    alone = Posterior(
                        np.zeros_like(posterior.mean[m]), posterior.covariance[m], posterior.noise[m],
                        posterior.decay[m], posterior.log_evidence[m],
                    )  # fmt: skip
                    total += blend[:, m, None, None] * one.covariance(X, zero, alone)
                return total

            return spread_of_any
        basis, shared = self.features.basis, posterior.mean.shape[-1] > 1
        copies = 1 if shared else d
        M_b = posterior.covariance.shape[-1] // copies
        # Of Σ_m's entries only their sums over the two orders of a pair of features are needed.
        blocks = posterior.covariance.reshape(M, copies, M_b, copies, M_b).transpose(
            0, 2, 4, 1, 3
        )  # (M, b, b', j, j')
        i, j = pairs(M_b)
        entries = blocks[:, i, j] + np.where(i == j, 0.0, 1.0)[:, None, None] * blocks[:, j, i]

        def spread_of_basis(X: np.ndarray, blend: np.ndarray) -> np.ndarray:
            products = distinct_products(basis(X))
            mixed = (blend @ entries.reshape(M, -1)).reshape(len(X), *entries.shape[1:])
            spread = np.einsum("pn,npij->nij", products, mixed)
            return spread * np.eye(d) if shared else spread

        return spread_of_basis


def _spread_of_basis(B: np.ndarray, covariance: np.ndarray, d: int) -> np.ndarray:
    """`(I ⊗ bᵀ) Σ (I ⊗ b)`, (N, d, d), for a basis B (N, M)."""
    M = B.shape[1]
    if len(covariance) == M:  # shared by all actions
        return np.einsum("nm,nm->n", B @ covariance, B)[:, None, None] * np.eye(d)
    blocks = covariance.reshape(d, M, d, M)
    result = np.empty((len(B), d, d))
    for j in range(d):
        half = (B @ blocks[j].reshape(M, -1)).reshape(len(B), d, M)
        result[:, j] = np.einsum("nkm,nm->nk", half, B)
    return (result + result.swapaxes(1, 2)) / 2
