"""What accumulators, estimators and diagnostics ask of a model.

A model is a policy with everything placed, and without parameters: it says what parameters mean. It never changes, so
threads and processes may share it. Parameters are whatever the model takes for them: an array, or a fitted regressor.

Two models are linear in their parameters, and say how samples add up to moments as well: one set of parameters for all
states (`global_model`), and local models that are blended (`local_models`).
"""

from typing import Any, Protocol

import numpy as np

from unconstrain.features.base import Features
from unconstrain.fitting.decay import Decay
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import Observation
from unconstrain.fitting.posterior import Posterior


class Model(Protocol):
    """What estimators ask of any model."""

    @property
    def n_states(self) -> int:
        """Number of states n."""
        ...

    @property
    def n_actions(self) -> int:
        """Number of actions d."""
        ...

    @property
    def scale(self) -> np.ndarray | None:
        """What a length of one is along each action, (d,); None for one. The model's actions are in this unit."""
        ...

    @property
    def width(self) -> float | np.ndarray | None:
        """Width σ of receptive fields, along each dimension of the states as features see them; None without any."""
        ...

    def evaluate(self, X: np.ndarray, w: Any) -> np.ndarray:
        """Evaluate the policy.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        w : object
            Parameters of this model.

        Returns
        -------
        ndarray of shape (N, d)
            Actions.
        """
        ...

    def lay_out(self, X: np.ndarray) -> np.ndarray:
        """Lay states out as features see them.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, m)
            In which distances are taken.

        Raises
        ------
        DataError
            Some are no states of the model's space.
        """
        ...

    def compile(self, w: Any) -> Any:
        """Compile the policy for a control loop.

        Parameters
        ----------
        w : object
            Parameters of this model.

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


class LinearModel(Model, Protocol):
    """What accumulators and diagnostics ask of a model that is linear in its parameters."""

    @property
    def features(self) -> Features:
        """The fitted feature map, of each of the models."""
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

    def decay(self, moments: Moments) -> Decay:
        """Say what the weight decay acts on where these moments are solved.

        Parameters
        ----------
        moments : Moments
            Of this model.

        Returns
        -------
        Decay
            Which solves them.
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

    def solution(self, parameters: np.ndarray, n_targets: int) -> np.ndarray:
        """Turn parameters into the solution of moments that `parameters` makes them of.

        Parameters
        ----------
        parameters : ndarray of shape (P,) or (S, P)
            Parameters.
        n_targets : int
            K.

        Returns
        -------
        ndarray of shape (..., P / K, K)
            A solution of the moments.
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
