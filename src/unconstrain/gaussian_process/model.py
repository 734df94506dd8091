"""What estimators and the inference of contact ask of a model, of one whose parameters are a `Process`."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from unconstrain.errors import PolicyError
from unconstrain.gaussian_process.process import Process


@dataclass(frozen=True)
class GaussianProcessModel:
    """A policy whose parameters are a distribution over policies.

    Parameters
    ----------
    n_states, n_actions : int
        Numbers n and d.
    """

    n_states: int
    n_actions: int

    @property
    def scale(self) -> None:
        """None: actions are taken as they are."""
        return

    @property
    def width(self) -> None:
        """None: a kernel may have several widths, or none."""
        return

    def evaluate(self, X: np.ndarray, w: Process) -> np.ndarray:
        """Evaluate the mean policy, (N, d)."""
        return w.evaluate(X)

    def covariance(self, X: np.ndarray, P: np.ndarray, posterior: Process) -> np.ndarray:
        """Compute second moments of the true policy about predictions P (N, d), (N, d, d)."""
        bias = posterior.evaluate(X) - P
        return posterior.covariance(X) + bias[:, :, None] * bias[:, None, :]

    def lay_out(self, X: np.ndarray) -> np.ndarray:
        """Return states as they are."""
        return X

    def compile(self, w: Process) -> Any:
        """Refuse, since each step adds up as many kernels as there are rows.

        Raises
        ------
        PolicyError
            Always.
        """
        raise PolicyError(
            "a Gaussian process cannot be compiled: use predict, or learn a ParametricPolicy from its predictions"
        )
