"""How sure a policy is at a state: near 1 where it is known, near 0 where nothing was recorded."""

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import PolicyError
from unconstrain.policies.base import Policy

Array = NDArray[np.float64]

HALF = 0.5
"""Standard deviation, as a share of the usual speed, at which sureness is one half."""
LEAST = 0.07
"""What is unsure is still seen, faintly."""


class Sureness:
    """From states to numbers between `LEAST` and 1, which arrows and stream lines have as their opacity.

    `1 / (1 + (σ / (HALF r))²)`, where σ is the root of the policy's summed variances and r the usual speed of what was
    learnt from; and the same of the distance from recorded states, in the unit in which rollouts stop.

    Parameters
    ----------
    policy : Policy
        Fitted.
    """

    def __init__(self, policy: Policy) -> None:
        self.policy = policy
        self.why_not = ""
        self.beyond = policy.usual_distance()
        self.scale = policy.scale_
        try:
            self._covariance = policy.prepare_covariance()
            self._covariance(np.zeros((0, policy.n_features_in_)))
        except PolicyError as error:
            self.why_not = str(error)
        except ValueError:  # of no states there is none to compute
            pass
        self.speed = policy.usual_speed()

    def __call__(self, X: Array) -> Array:
        """Say how sure the policy is.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N,)
            From `LEAST` to 1.
        """
        away = self.policy.distance(X) / self.beyond
        sure = 1.0 / (1.0 + away**2)
        if not self.why_not:
            C = self._covariance(X) / np.outer(self.scale, self.scale)
            sure *= 1.0 / (1.0 + np.einsum("njj->n", C) / (HALF * self.speed) ** 2)
        return np.maximum(sure, LEAST)
