"""Which episodes determine most of a policy, and which could be dropped.

With `A = (H + τG)⁻¹` on the range of G, a sample's leverage is `ω tr(V A Vᵀ)`. Leverages add up to
`tr(A H) = Σ_k λ_k / (λ_k + τ)`, the number of determined directions counted softly, so the sum over an episode is the
number of directions that it determines. Episodes of the least leverage are dropped together as long as hardly any
direction falls below the threshold; that is counted exactly, from H without them.
"""

from collections.abc import Hashable
from dataclasses import dataclass, replace

import numpy as np

from unconstrain.diagnostics.information import Information
from unconstrain.diagnostics.spectrum import compute_directions, compute_shares
from unconstrain.parallel import cut_blocks
from unconstrain.policies.linear import LinearPolicy
from unconstrain.samples import Samples
from unconstrain.waiting import each, stage

NUMBERS_IN_BLOCK = 2**20

TOLERANCE = 0.005
"""Share of the policy's directions that may be lost by dropping episodes."""


@dataclass(frozen=True)
class Contribution:
    """What one episode contributes.

    Parameters
    ----------
    episode : hashable
        Its label.
    directions : float
        How many of the determined directions it holds, counted softly.
    droppable : bool
        Whether it is among the episodes that can be dropped together without loss.
    """

    episode: Hashable
    directions: float
    droppable: bool


@stage("weighing episodes")
def compute_contributions(
    policy: LinearPolicy, information: Information, samples: Samples, episodes: np.ndarray, threshold: float
) -> list[Contribution]:
    """Compute what every episode contributes.

    Parameters
    ----------
    policy : LinearPolicy
        Fitted.
    information : Information
        Of these samples.
    samples : Samples
        Checked; each has motion or a known projection.
    episodes : ndarray of shape (N,)
        The episode of each sample.
    threshold : float
        The least λ of a determined direction, τ.

    Returns
    -------
    list of Contribution
        The largest first.
    """
    labels, number = np.unique(episodes, return_inverse=True)
    held = np.bincount(number, compute_leverages(policy, information, samples, threshold), len(labels))
    order = np.argsort(held)
    observation = policy.observe(samples)

    def determined_without(n_dropped: int) -> float:
        rows = np.flatnonzero(np.isin(number, order[:n_dropped]))
        left = information
        if len(rows):
            weights = None if samples.weights is None else samples.weights[rows]
            dropped = policy.model_.moments(samples.states[rows], observation[rows], weights)
            H = information.moments.H - dropped.H
            left = replace(information, moments=replace(information.moments, H=H))
        return float(np.mean(np.concatenate(compute_shares(left)) >= threshold))

    # The fewer are left, the less is determined: the most that may go is found by halving.
    enough, fewest, too_many = determined_without(0) - TOLERANCE, 0, len(labels)
    while too_many - fewest > 1:
        middle = (fewest + too_many) // 2
        if determined_without(middle) >= enough:
            fewest = middle
        else:
            too_many = middle
    droppable = set(order[:fewest].tolist())
    return [Contribution(labels[k], float(held[k]), k in droppable) for k in order[::-1].tolist()]


def compute_leverages(
    policy: LinearPolicy, information: Information, samples: Samples, threshold: float
) -> np.ndarray:
    """Compute the leverage `ω tr(V A Vᵀ)` of every sample.

    Parameters
    ----------
    policy : LinearPolicy
        Fitted.
    information : Information
        Of these samples.
    samples : Samples
        Checked; each has motion or a known projection.
    threshold : float
        Threshold τ of `A = (H + τG)⁻¹`.

    Returns
    -------
    ndarray of shape (N,)
        Leverages, which add up to the number of determined directions.
    """
    # A = R Rᵀ
    roots = [one.vectors / np.sqrt(one.shares + threshold) for one in compute_directions(information)]
    X, observation = samples.states, policy.observe(samples)
    result = np.zeros(len(X))
    width = max(root.shape[1] for root in roots) + information.moments.H.shape[-1]
    blocks = cut_blocks(len(X), max(64, NUMBERS_IN_BLOCK // width))
    for rows in each(blocks, "weighing episodes", unit="blocks"):
        part, reach = observation[rows], policy.model_.reach(X[rows])
        Q, counts = part.rows, part.row_weights
        for k in range(observation.n_rows):
            V = policy.model_.along(X[rows], Q[:, k])
            for root, weight in zip(roots, reach.T, strict=True):
                counted = weight if counts is None else weight * counts[:, k]
                result[rows] += counted * np.sum((V @ root) ** 2, axis=1)
    return result if samples.weights is None else result * samples.weights
