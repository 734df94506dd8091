"""Which recordings tell most, and which could be dropped.

With `A = (H + τG)⁻¹` on the range of G, a sample's leverage is `ω tr(V A Vᵀ)`. Leverages add up to
`tr(A H) = Σ_k λ_k / (λ_k + τ)`, the number of determined directions counted softly, so an episode's sum says how many
of them it holds. Episodes of the least leverage are dropped together as long as hardly any direction falls below the
threshold; that is counted exactly, from H without them.
"""

from dataclasses import dataclass

import numpy as np

from unconstrain.diagnostics.information import Information, stacked
from unconstrain.diagnostics.spectrum import directions, shares_seen
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import Observation
from unconstrain.parallel import cut_blocks
from unconstrain.policies.base import Policy

NUMBERS_IN_BLOCK = 2**20

TOLERANCE = 0.005
"""Of the policy's directions, the share that may be lost by dropping episodes."""


@dataclass(frozen=True)
class Contribution:
    """episode: its label. directions: how many of the determined ones it holds, softly counted.

    droppable: one of those without which, all together, the same is determined.
    """

    episode: object
    directions: float
    droppable: bool


def contributions(
    policy: Policy,
    information: Information,
    X: np.ndarray,
    observation: Observation,
    weights: np.ndarray,
    episodes: np.ndarray,
    threshold: float,
) -> list[Contribution]:
    """Of every episode, the largest first; samples X (N, n), what is seen of them, weights (N,), episodes (N,)."""
    labels, number = np.unique(episodes, return_inverse=True)
    held = np.bincount(
        number, leverages(policy, information, X, observation, weights, threshold), len(labels)
    )
    order = np.argsort(held)

    def determined(without: int) -> float:
        rows = np.flatnonzero(np.isin(number, order[:without]))
        left = information.moments
        if len(rows):
            dropped = stacked(policy.model_.moments(X[rows], observation[rows], weights[rows]))
            left = Moments(left.H - dropped.H, left.g, left.squares, left.weight, left.n_samples)
        return float(np.mean(np.concatenate(shares_seen(Information(left, information.whole))) >= threshold))

    # The fewer are left, the less is determined: the most that may go is found by halving.
    enough, fewest, too_many = determined(0) - TOLERANCE, 0, len(labels)
    while too_many - fewest > 1:
        middle = (fewest + too_many) // 2
        if determined(middle) >= enough:
            fewest = middle
        else:
            too_many = middle
    droppable = set(order[:fewest].tolist())
    return [Contribution(labels[k], float(held[k]), k in droppable) for k in order[::-1].tolist()]


def leverages(
    policy: Policy,
    information: Information,
    X: np.ndarray,
    observation: Observation,
    weights: np.ndarray,
    threshold: float,
) -> np.ndarray:
    """`ω tr(V A Vᵀ)` of every sample, (N,)."""
    roots = [one.vectors / np.sqrt(one.seen + threshold) for one in directions(information)]  # A = R Rᵀ
    result = np.zeros(len(X))
    width = max(root.shape[1] for root in roots) + information.moments.H.shape[-1]
    for rows in cut_blocks(len(X), max(64, NUMBERS_IN_BLOCK // width)):
        looked, reached = observation[rows].rows, policy.model_.reach(X[rows])
        for k in range(observation.n_rows):
            V = policy.model_.along(X[rows], looked[:, k])
            for root, weight in zip(roots, reached.T, strict=True):
                result[rows] += weight * np.sum((V @ root) ** 2, axis=1)
    return result * weights
