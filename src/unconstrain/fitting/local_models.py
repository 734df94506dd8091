"""Local models, each fitted alone, blended by their receptive fields."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from unconstrain.errors import PolicyError
from unconstrain.features.base import Features, FullBasis, LinearInState
from unconstrain.fitting.decay import Decay
from unconstrain.fitting.global_model import GlobalModel
from unconstrain.fitting.kernels import local
from unconstrain.fitting.kernels.products import distinct_products, pairs
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import Observation
from unconstrain.fitting.posterior import Posterior
from unconstrain.parallel import evaluate_in_shares
from unconstrain.receptive import activations, blend, normalized_activations

PRIORS = ("global", "zero")

BLOCK_ROWS = 4096
COVARIANCE_ROWS = 1024


@dataclass(frozen=True)
class LocalModels:
    """`π(x) = Σ_m ω_m(x) Φ(x) w_m` with `ω_m = K_m / Σ_j K_j` and `K_m(x) = exp(-‖x - c_m‖² / 2σ²)`.

    Each w_m minimises the risk with its samples weighted by K_m, whatever the other models do, and decays to what the
    prior says.

    Parameters
    ----------
    features : Features
        Fitted; the same for every model.
    centers : ndarray of shape (M, n)
        Centres of the receptive fields.
    width : float or ndarray of shape (n,)
        Width σ of the receptive fields, in the states' unit.
    n_actions : int
        Number d.
    prior : {"global", "zero"}
        What parameters decay to: those of the same features fitted to all samples together, or zero.

    References
    ----------
    Howard et al., ICRA 2009, Sec. III-B.
    """

    features: Features
    centers: np.ndarray
    width: float | np.ndarray
    n_actions: int
    prior: str = "global"

    @property
    def n_states(self) -> int:
        """Number of states n."""
        return self.centers.shape[1]

    @property
    def n_models(self) -> int:
        """Number of models M."""
        return len(self.centers)

    @property
    def scale(self) -> None:
        """None: actions are taken as they are."""
        return

    @property
    def shares_basis(self) -> bool:
        """Whether all actions share one basis, `Φ(x) = I ⊗ b(x)ᵀ`."""
        return isinstance(self.features, FullBasis)

    def moments(self, X: np.ndarray, observation: Observation, weights: np.ndarray | None = None) -> Moments:
        """Sum samples up; see `Model.moments`."""
        everywhere = self.prior == "global"
        return local.moments(
            self.features, self.centers, self.width, X, observation, weights, everywhere=everywhere
        )

    def decay(self, moments: Moments) -> Decay:
        """Say what the weight decay acts on; see `Model.decay`."""
        return Decay.of(moments, self.features, self.n_actions)

    def parameters(self, w: np.ndarray) -> np.ndarray:
        """Turn a solution of the moments into parameters; see `Model.parameters`."""
        return w.swapaxes(-1, -2).reshape(len(w), -1)

    def solution(self, parameters: np.ndarray, n_targets: int) -> np.ndarray:
        """Turn parameters into a solution of the moments; see `Model.solution`."""
        return parameters.reshape(len(parameters), n_targets, -1).swapaxes(-1, -2)

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Evaluate the policy; see `Model.evaluate`."""
        if isinstance(self.features, FullBasis):
            features = self.features
            return evaluate_in_shares(
                lambda states: self._evaluate_blended(features, states, w), X, self.n_actions
            )
        actions = np.zeros((len(X), self.n_actions))
        for start in range(0, len(X), BLOCK_ROWS):
            block = X[start : start + BLOCK_ROWS]
            blend = normalized_activations(block, self.centers, self.width)
            actions[start : start + BLOCK_ROWS] = np.einsum(
                "nm,nmd->nd", blend, self._evaluate_each(block, w)
            )
        return actions

    def covariance(self, X: np.ndarray, P: np.ndarray, posterior: Posterior) -> np.ndarray:
        """Compute second moments of the mixture of the models about predictions; see `Model.covariance`.

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
            spread += posterior.apart * np.swapaxes(apart * blend[:, :, None], 1, 2) @ apart
            result[start : start + COVARIANCE_ROWS] = (spread + spread.swapaxes(1, 2)) / 2
        return result

    def along(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Compute the features along one direction at each state, the same for all models; see `Model.along`."""
        return self.features.along(X, directions)

    def reach(self, X: np.ndarray) -> np.ndarray:
        """Compute the activations K_m(x); see `Model.reach`."""
        return activations(X, self.centers, self.width)

    def lay_out(self, X: np.ndarray) -> np.ndarray:
        """Return states as they are; see `Model.lay_out`."""
        return X

    def compile(self, w: np.ndarray) -> Any:
        """Compile the policy for a control loop; see `Model.compile`."""
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
        return self.features.linear(w) if isinstance(self.features, LinearInState) else None

    def _evaluate_blended(self, features: FullBasis, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Blend the models first, and apply what comes of it once."""
        actions = np.empty((len(X), self.n_actions))
        for block, sums, total in blend(X, self.centers, self.width, w.reshape(self.n_models, -1)):
            basis = features.basis(X[block]).T
            each = sums.reshape(self.n_actions, len(basis), -1)
            each *= basis
            np.divide(each.sum(axis=1).T, total[:, None], out=actions[block])
        return actions

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
