"""Recorded states where the policy is known least."""

from dataclasses import dataclass

import numpy as np

from unconstrain.diagnostics.coverage import compute_coverage
from unconstrain.features.centers import farthest_first
from unconstrain.features.scaling import Scaling
from unconstrain.fitting.posterior import Posterior
from unconstrain.policies.linear import LinearPolicy
from unconstrain.receptive import squared_distances
from unconstrain.samples import Samples

POOL = 200
"""How many recorded states, spread over all, are compared."""


@dataclass(frozen=True)
class Region:
    """A state where the policy is not known, and the direction of motion that was observed least there.

    Parameters
    ----------
    state : ndarray of shape (n,)
        The state.
    direction : ndarray of shape (d,)
        A direction of length one, its largest component positive.
    deviation : float
        Standard deviation of the policy along the direction, in units of the action.
    speed : float
        Length of the predicted action.
    share : float
        Share of the motion near the state that went along the direction; 1/d where all directions were observed alike.
    """

    state: np.ndarray
    direction: np.ndarray
    deviation: float
    speed: float
    share: float


def find_worst_regions(
    policy: LinearPolicy, posterior: Posterior, samples: Samples, k: int, reach: np.ndarray
) -> list[Region]:
    """Find the recorded states, apart from each other, where the policy is known least.

    Parameters
    ----------
    policy : LinearPolicy
        Fitted.
    posterior : Posterior
        Of its parameters.
    samples : Samples
        The recordings.
    k : int
        How many at most.
    reach : ndarray of shape (n,)
        How far "near" a state reaches along each of the states, in its unit.

    Returns
    -------
    list of Region
        By the posterior's largest standard deviation, the worst first.
    """
    near = Scaling(samples.states.mean(axis=0), reach)
    pool, radius = farthest_first(samples.states, scaling=near, n_centers=POOL)
    distances = np.sqrt(squared_distances(near(pool), near(pool)))
    covariance = policy.covariance(pool, posterior)
    speeds = np.linalg.norm(np.reshape(policy.predict(pool), (len(pool), -1)), axis=1)
    order = np.argsort(np.linalg.eigvalsh(covariance)[:, -1])[::-1]
    chosen: list[int] = []
    for i in order.tolist():
        apart = distances[i, chosen].min(initial=np.inf)
        if len(chosen) < k and apart > 2 * max(radius, 1.0):
            chosen.append(i)
    observed = compute_coverage(pool[chosen], samples.states, samples.actions, reach)
    regions = []
    for i, share, q in zip(chosen, observed.shares[:, 0], observed.directions[:, 0], strict=True):
        deviation = float(np.sqrt(max(q @ covariance[i] @ q, 0.0)))
        regions.append(Region(pool[i], orient(q), deviation, float(speeds[i]), float(share)))
    return regions


def orient(direction: np.ndarray) -> np.ndarray:
    """Choose the sign of a line's direction.

    Parameters
    ----------
    direction : ndarray of shape (d,)
        Either of the two.

    Returns
    -------
    ndarray of shape (d,)
        That whose largest component is positive.
    """
    return direction * (np.sign(direction[np.argmax(np.abs(direction))]) or 1.0)
