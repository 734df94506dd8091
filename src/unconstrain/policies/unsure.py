"""Where a policy is not known well enough to follow it."""

import numpy as np

from unconstrain.arrays import check_number
from unconstrain.policies.base import Policy


class Unsure:
    """A criterion for `rollout(..., stop_when=Unsure(policy, 0.5))`.

    Parameters
    ----------
    policy : Policy
        Fitted.
    share : float
        The share of the predicted speed that the standard deviation (the root of the summed variances of all actions)
        may not exceed.

    Raises
    ------
    PolicyError
        The share is not positive, or the policy was saved without its sums.
    """

    def __init__(self, policy: Policy, share: float):
        self.policy = policy
        self.share = check_number(share, "the share of the speed", positive=True)
        self.posterior = policy.posterior()

    def __call__(self, X: np.ndarray) -> np.ndarray:
        """Say at which states X (N, n) the policy is not known well enough, (N,)."""
        deviation, speed = self.measure(X)
        return deviation > self.share * speed

    def measure(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute the standard deviation and the predicted speed.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.

        Returns
        -------
        deviation : ndarray of shape (N,)
            The root of the summed variances of all actions, in units of the policy's scale.
        speed : ndarray of shape (N,)
            Length of the predicted action.
        """
        P = self.policy.scaled(np.reshape(self.policy.predict(X), (len(X), -1)))
        covariance = self.policy.covariance(X, self.posterior)
        variance = np.einsum("njj,j->n", covariance, 1.0 / self.policy.scale_**2)
        return np.sqrt(np.maximum(variance, 0.0)), np.linalg.norm(P, axis=1)
