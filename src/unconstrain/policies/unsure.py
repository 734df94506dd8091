"""Where a policy is not known well enough to follow it."""

import numpy as np

from unconstrain.arrays import check_number
from unconstrain.policies.base import Policy

ROUNDING = 1e-9


class Unsure:
    """A criterion for `rollout(..., stop_when=Unsure(policy, 0.5))`.

    Parameters
    ----------
    policy : Policy
        Fitted.
    share : float
        The share of the speed that the standard deviation (the root of the summed variances of all actions) may not
        exceed. Where the policy is slower than the recordings usually are, as at the start of a reach, the share of the
        recordings' usual speed.

    Raises
    ------
    PolicyError
        The share is not positive, or the policy was saved without its sums.
    """

    def __init__(self, policy: Policy, share: float):
        self.policy = policy
        self.share = check_number(share, "the share of the speed", positive=True)
        self.covariance = policy.prepare_covariance()
        self.usual = policy.usual_speed()
        self.least = 0.0

    def starting_at(self, start: np.ndarray) -> bool:
        """Let a movement begin where people did, however little is known of the policy there.

        Parameters
        ----------
        start : ndarray of shape (n,)
            A state.

        Returns
        -------
        bool
            Whether the policy is not known well enough at the start, which lies where people were: then it counts as
            known where it is known as well as there.
        """
        if not self(start[None])[0] or self.policy.distance(start[None])[0] > self.policy.usual_distance():
            return False
        self.least = float(self.measure(start[None])[0][0]) * (1 + ROUNDING)
        return True

    def __call__(self, X: np.ndarray) -> np.ndarray:
        """Say at which states X (N, n) the policy is not known well enough, (N,)."""
        deviation, speed = self.measure(X)
        return deviation > np.maximum(self.share * speed, self.least)

    def measure(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute the standard deviation, and the speed that it is compared with.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.

        Returns
        -------
        deviation : ndarray of shape (N,)
            The root of the summed variances of all actions, in units of the policy's scale.
        speed : ndarray of shape (N,)
            Length of the predicted action, and at least that of a usual one.
        """
        P = self.policy.scaled(np.reshape(self.policy.predict(X), (len(X), -1)))
        covariance = self.covariance(X)
        variance = np.einsum("njj,j->n", covariance, 1.0 / self.policy.scale_**2)
        return np.sqrt(np.maximum(variance, 0.0)), np.maximum(np.linalg.norm(P, axis=1), self.usual)
