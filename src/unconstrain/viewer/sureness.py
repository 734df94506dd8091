"""How sure a policy is at a state: near 1 where it is known, near 0 where nothing was recorded."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from unconstrain.demonstrations import Demonstrations
from unconstrain.diagnostics import identifiability
from unconstrain.errors import UnconstrainError
from unconstrain.motion import root_mean_square
from unconstrain.policies.base import Policy
from unconstrain.policies.linear import LinearPolicy

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
    demos : Demonstrations, optional
        Recordings, by which it is known how sure a policy is whose file does not tell.

    Attributes
    ----------
    why_not : str
        Why only the distance counts, if so.
    """

    def __init__(self, policy: Policy, demos: Demonstrations | None = None) -> None:
        self.policy = policy
        self.beyond, self.scale = policy.usual_distance(), policy.scale_
        self.speed, self.why_not = 1.0, ""
        self._covariance: Callable[[Array], Array] = policy.covariance
        try:
            self._covariance = policy.prepare_covariance()
            self._covariance(policy.space_.origin[None])  # some find out only then that they cannot tell
        except UnconstrainError as error:
            self.why_not = str(error)
        if self.why_not and isinstance(policy, LinearPolicy) and demos is not None:
            try:
                self._covariance, self.why_not = identifiability(policy, demos).covariance, ""
            except UnconstrainError as error:
                self.why_not = str(error)
        if not self.why_not:
            self.speed = (
                policy.usual_speed() if demos is None else root_mean_square(policy.scaled(demos.actions))
            )

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
