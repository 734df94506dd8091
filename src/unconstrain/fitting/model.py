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
        """Number of states n."""
        ...

    @property
    def n_actions(self) -> int:
        """Number of actions d."""
        ...

    @property
    def n_models(self) -> int:
        """Number S of sets of parameters, each of which is fitted by itself."""
        ...

    @property
    def shares_basis(self) -> bool:
        """Whether all actions share one basis, `Φ(x) = I ⊗ b(x)ᵀ`."""
        ...

    def moments(self, X: np.ndarray, observation: Observation, weights: np.ndarray | None = None) -> Moments:
        """Sum samples up.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        observation : Observation
            Of N samples.
        weights : ndarray of shape (N,), optional
            Weight of each sample, 1 by default.

        Returns
        -------
        Moments
            With a leading axis of models where there are several.
        """
        ...

    def parameters(self, w: np.ndarray) -> np.ndarray:
        """Turn a solution of the moments into parameters.

        Parameters
        ----------
        w : ndarray of shape (..., P / K, K)
            A solution of the moments.

        Returns
        -------
        ndarray of shape (P,) or (S, P)
            Parameters.
        """
        ...

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Evaluate the policy.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        w : ndarray of shape (P,) or (S, P)
            Parameters.

        Returns
        -------
        ndarray of shape (N, d)
            Actions.
        """
        ...

    def covariance(self, X: np.ndarray, P: np.ndarray, posterior: Posterior) -> np.ndarray:
        """Compute second moments of the true policy about predictions.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        P : ndarray of shape (N, d)
            Predictions.
        posterior : Posterior
            Of the parameters.

        Returns
        -------
        ndarray of shape (N, d, d)
            In squared units of the action.
        """
        ...

    def along(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Compute the features `Φ(x)ᵀq` along one direction at each state, the same for all models.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        directions : ndarray of shape (N, d)
            One for each state, of any length.

        Returns
        -------
        ndarray of shape (N, P)
            Features.
        """
        ...

    def reach(self, X: np.ndarray) -> np.ndarray:
        """Compute how much of a sample reaches each model.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, S)
            Weights, 0 to 1.
        """
        ...

    def compile(self, w: np.ndarray) -> Any:
        """Compile the policy for a control loop.

        Parameters
        ----------
        w : ndarray of shape (P,) or (S, P)
            Parameters.

        Returns
        -------
        CompiledPolicy
            That agrees with `evaluate`.

        Raises
        ------
        PolicyError
            These features cannot be compiled.
        """
        ...


@dataclass(frozen=True)
class GlobalModel:
    """`π(x) = Φ(x) w`: one set of parameters for all states.

    Parameters
    ----------
    features : Features
        Fitted.
    n_states, n_actions : int
        Numbers n and d.
    """

    features: Features
    n_states: int
    n_actions: int

    @property
    def n_models(self) -> int:
        """One set of parameters."""
        return 1

    @property
    def shares_basis(self) -> bool:
        """Whether all actions share one basis, `Φ(x) = I ⊗ b(x)ᵀ`."""
        return isinstance(self.features, FullBasis)

    def moments(self, X: np.ndarray, observation: Observation, weights: np.ndarray | None = None) -> Moments:
        """Sum samples up.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States, of any precision.
        observation : Observation
            Of N samples.
        weights : ndarray of shape (N,), optional
            Weight of each sample, 1 by default.

        Returns
        -------
        Moments
            Of N samples.
        """
        return parametric.moments(self.features, X, observation, weights)

    def parameters(self, w: np.ndarray) -> np.ndarray:
        """Turn a solution of the moments into parameters.

        Parameters
        ----------
        w : ndarray of shape (P / K, K)
            A solution of the moments.

        Returns
        -------
        ndarray of shape (P,)
            Parameters.
        """
        return w.T.reshape(-1)

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Evaluate the policy.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        w : ndarray of shape (P,)
            Parameters.

        Returns
        -------
        ndarray of shape (N, d)
            Actions.
        """
        return self.features.evaluate(X, w)

    def covariance(self, X: np.ndarray, P: np.ndarray, posterior: Posterior) -> np.ndarray:
        """Compute second moments of the true policy about predictions.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        P : ndarray of shape (N, d)
            Predictions.
        posterior : Posterior
            Of the parameters.

        Returns
        -------
        ndarray of shape (N, d, d)
            In squared units of the action.
        """
        bias = self.features.evaluate(X, self.parameters(posterior.mean)) - P
        result = bias[:, :, None] * bias[:, None, :]
        for start in range(0, len(X), COVARIANCE_ROWS):
            rows = slice(start, start + COVARIANCE_ROWS)
            result[rows] += self._spread(X[rows], posterior.covariance)
        return result

    def along(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Compute the features `Φ(x)ᵀq` along one direction at each state.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        directions : ndarray of shape (N, d)
            One for each state, of any length.

        Returns
        -------
        ndarray of shape (N, P)
            Features.
        """
        return self.features.along(X, directions)

    def reach(self, X: np.ndarray) -> np.ndarray:
        """Return ones, since every sample reaches the model in full.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, 1)
            Ones.
        """
        return np.ones((len(X), 1))

    def compile(self, w: np.ndarray) -> Any:
        """Compile the policy for a control loop.

        Parameters
        ----------
        w : ndarray of shape (P,)
            Parameters.

        Returns
        -------
        CompiledPolicy
            That agrees with `evaluate`.

        Raises
        ------
        PolicyError
            These features cannot be compiled.
        """
        if not isinstance(self.features, Compilable):
            raise PolicyError(
                f"a policy with {type(self.features).__name__} features cannot be compiled, since they have no method "
                "compile(w): use predict, or other features"
            )
        return self.features.compile(w)

    def _spread(self, X: np.ndarray, covariance: np.ndarray) -> np.ndarray:
        """Compute `Φ(x) Σ Φ(x)ᵀ`, (N, d, d)."""
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
    centers : ndarray of shape (M, n)
        Centres of the receptive fields.
    width : float
        Width σ of the receptive fields, in the states' unit.
    n_actions : int
        Number d.

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
        """Number of states n."""
        return self.centers.shape[1]

    @property
    def n_models(self) -> int:
        """Number of models M."""
        return len(self.centers)

    @property
    def shares_basis(self) -> bool:
        """Whether all actions share one basis, `Φ(x) = I ⊗ b(x)ᵀ`."""
        return isinstance(self.features, FullBasis)

    def moments(self, X: np.ndarray, observation: Observation, weights: np.ndarray | None = None) -> Moments:
        """Sum samples up.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States, of any precision.
        observation : Observation
            Of N samples.
        weights : ndarray of shape (N,), optional
            Weight of each sample, 1 by default.

        Returns
        -------
        Moments
            With a leading axis of M models.
        """
        return local.moments(self.features, self.centers, self.width, X, observation, weights)

    def parameters(self, w: np.ndarray) -> np.ndarray:
        """Turn a solution of the moments into parameters.

        Parameters
        ----------
        w : ndarray of shape (M, P / K, K)
            A solution of the moments.

        Returns
        -------
        ndarray of shape (M, P)
            Parameters.
        """
        return w.swapaxes(-1, -2).reshape(len(w), -1)

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Evaluate the policy.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        w : ndarray of shape (M, P)
            Parameters.

        Returns
        -------
        ndarray of shape (N, d)
            Actions.
        """
        actions = np.zeros((len(X), self.n_actions))
        for start in range(0, len(X), BLOCK_ROWS):
            block = X[start : start + BLOCK_ROWS]
            blend = normalized_activations(block, self.centers, self.width)
            local = self._evaluate_each(block, w)
            actions[start : start + BLOCK_ROWS] = np.einsum("nm,nmd->nd", blend, local)
        return actions

    def covariance(self, X: np.ndarray, P: np.ndarray, posterior: Posterior) -> np.ndarray:
        """Compute second moments of the mixture of the models about predictions.

        Neighbours learn from shared samples, so their errors do not average out. By convexity the mixture's second
        moment is an upper bound on that of the blend, however the models depend on each other.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        P : ndarray of shape (N, d)
            Predictions.
        posterior : Posterior
            Of the parameters.

        Returns
        -------
        ndarray of shape (N, d, d)
            In squared units of the action.
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
        """Compute the features `Φ(x)ᵀq` along one direction at each state, the same for all models.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        directions : ndarray of shape (N, d)
            One for each state, of any length.

        Returns
        -------
        ndarray of shape (N, P)
            Features.
        """
        return self.features.along(X, directions)

    def reach(self, X: np.ndarray) -> np.ndarray:
        """Compute the activations K_m(x).

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, M)
            Activations, 0 to 1.
        """
        return activations(X, self.centers, self.width)

    def compile(self, w: np.ndarray) -> Any:
        """Compile the policy for a control loop.

        Parameters
        ----------
        w : ndarray of shape (M, P)
            Parameters.

        Returns
        -------
        CompiledPolicy
            That agrees with `evaluate`.

        Raises
        ------
        PolicyError
            The local models are not linear.
        """
        from unconstrain.deploy.compiled import LocallyLinear

        linear = self.linear_parameters(w)
        if linear is None:
            raise PolicyError(
                "local models on features other than (x, 1) cannot be compiled: use predict, or linear local models"
            )
        return LocallyLinear(centers=self.centers, width=self.width, coef=linear[0], intercept=linear[1])

    def linear_parameters(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Split the parameters of linear local models into slopes and offsets.

        Parameters
        ----------
        w : ndarray of shape (M, P)
            Parameters.

        Returns
        -------
        tuple of ndarray of shape (M, d, n) and ndarray of shape (M, d), or None
            Slopes and offsets; None for features other than (x, 1).
        """
        if getattr(self.features, "transformer_", w) is not None:
            return None
        models = w.reshape(len(w), self.n_actions, -1)
        return models[:, :, :-1].copy(), models[:, :, -1].copy()

    def _evaluate_each(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Evaluate every model, (N, M, d)."""
        M, d = len(w), self.n_actions
        if isinstance(self.features, FullBasis):
            B = self.features.basis(X)
            return (B @ w.reshape(M * d, -1).T).reshape(len(X), M, d)
        return np.stack([self.features.evaluate(X, each) for each in w], axis=1)

    def _mixed_spread(self, posterior: Posterior) -> Any:
        """Make a function of states (N, n) and blend (N, M) that returns `Σ_m ω_m Φ Σ_m Φᵀ`, (N, d, d)."""
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
    """Compute `(I ⊗ bᵀ) Σ (I ⊗ b)`, (N, d, d), for a basis B (N, M)."""
    M = B.shape[1]
    if len(covariance) == M:  # shared by all actions
        return np.einsum("nm,nm->n", B @ covariance, B)[:, None, None] * np.eye(d)
    blocks = covariance.reshape(d, M, d, M)
    result = np.empty((len(B), d, d))
    for j in range(d):
        half = (B @ blocks[j].reshape(M, -1)).reshape(len(B), d, M)
        result[:, j] = np.einsum("nkm,nm->nk", half, B)
    return (result + result.swapaxes(1, 2)) / 2
