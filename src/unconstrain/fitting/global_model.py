"""One set of parameters for all states."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from unconstrain.errors import PolicyError
from unconstrain.features.base import Compilable, Features, FullBasis
from unconstrain.fitting.decay import Decay
from unconstrain.fitting.kernels import parametric
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import Observation
from unconstrain.fitting.posterior import Posterior
from unconstrain.parallel import evaluate_in_shares

COVARIANCE_ROWS = 1024


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
    def scale(self) -> None:
        """None: actions are taken as they are."""
        return

    @property
    def width(self) -> float | np.ndarray | None:
        """Width of the features' receptive fields; see `Model.width`."""
        transformer = getattr(self.features, "transformer_", self.features)
        return getattr(transformer, "width_", None)

    @property
    def shares_basis(self) -> bool:
        """Whether all actions share one basis, `Φ(x) = I ⊗ b(x)ᵀ`."""
        return isinstance(self.features, FullBasis)

    def moments(self, X: np.ndarray, observation: Observation, weights: np.ndarray | None = None) -> Moments:
        """Sum samples up; see `Model.moments`."""
        return parametric.moments(self.features, X, observation, weights)

    def decay(self, moments: Moments) -> Decay:
        """Say what the weight decay acts on; see `Model.decay`."""
        return Decay.of(moments, self.features, self.n_actions)

    def parameters(self, w: np.ndarray) -> np.ndarray:
        """Turn a solution of the moments into parameters; see `Model.parameters`."""
        return w.T.reshape(-1)

    def solution(self, parameters: np.ndarray, n_targets: int) -> np.ndarray:
        """Turn parameters into a solution of the moments; see `Model.solution`."""
        return parameters.reshape(n_targets, -1).T

    def evaluate(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Evaluate the policy; see `Model.evaluate`."""
        return evaluate_in_shares(lambda states: self.features.evaluate(states, w), X, self.n_actions)

    def covariance(self, X: np.ndarray, P: np.ndarray, posterior: Posterior) -> np.ndarray:
        """Compute second moments of the true policy about predictions; see `Model.covariance`."""
        bias = self.features.evaluate(X, self.parameters(posterior.mean)) - P
        result = bias[:, :, None] * bias[:, None, :]
        for start in range(0, len(X), COVARIANCE_ROWS):
            rows = slice(start, start + COVARIANCE_ROWS)
            result[rows] += self._spread(X[rows], posterior.covariance)
        return result

    def along(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Compute the features `Φ(x)ᵀq` along one direction at each state; see `Model.along`."""
        return self.features.along(X, directions)

    def reach(self, X: np.ndarray) -> np.ndarray:
        """Return ones, since every sample reaches the model in full; see `Model.reach`."""
        return np.ones((len(X), 1))

    def lay_out(self, X: np.ndarray) -> np.ndarray:
        """Return states as they are; see `Model.lay_out`."""
        return X

    def compile(self, w: np.ndarray) -> Any:
        """Compile the policy for a control loop; see `Model.compile`."""
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
