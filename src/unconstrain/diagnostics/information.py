"""What recordings show of a policy, against what full observation of the same movements would have shown.

For features linear in the parameters, `π(x) = Φ(x) w`,

    H = Σ ω VᵀV,   V = Q Φ     what was seen: along û, or behind a known projection
    G = Σ ω ΦᵀΦ                what would have been seen had nothing been in the way

Q is a projection, so 0 <= H <= G. Samples without motion and without a known projection count in neither.

With full features, `Φ = I ⊗ b(x)ᵀ`, and directions `û` of length one, G need not be summed: the d diagonal blocks of
`H = Σ ω (û ûᵀ) ⊗ (b bᵀ)` add up to `Σ ω ‖û‖² b bᵀ`, and `G = I ⊗ Σ ω b bᵀ`. So a stream or a cluster, which keeps
nothing but H, knows G as well.
"""

from dataclasses import dataclass

import numpy as np

from unconstrain.arrays import check_actions, check_projections, check_states, check_weights
from unconstrain.errors import DataError, PolicyError
from unconstrain.features import FullFeatures, NormalizedRBF
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import informative, sight
from unconstrain.motion import moving
from unconstrain.policies import LocallyLinearPolicy
from unconstrain.policies.base import Policy
from unconstrain.receptive import activations


@dataclass(frozen=True)
class Information:
    """Moments of S models side by side (one, or all local models), and their G.

    moments: what was seen, with a leading axis S.
    whole: G (S, P, P), or where the action's dimensions share it a block (S, P / d, P / d).
    """

    moments: Moments
    whole: np.ndarray

    @property
    def copies(self) -> int:
        """How many copies of the block `whole` make up G."""
        return self.moments.H.shape[-1] // self.whole.shape[-1]

    def __len__(self) -> int:
        return len(self.whole)


def of_recordings(
    policy: Policy, X, U, sample_weight=None, projections=None
) -> tuple[Information, np.ndarray]:
    """Of states X (N, n) and actions U (N, d), under a fitted policy's features; and which samples count, (N,).

    projections: N (N, d, d), NaN where not known. The policy's own risk does not matter: what was in the way was in
    the way, whether or not it was looked past.
    """
    X, U = check_states(policy, X), check_actions(U)
    if U.shape != (len(X), policy.n_actions_):
        raise DataError(
            f"these recordings have {len(X)} states and actions of shape {U.shape}, and the policy has "
            f"{policy.n_actions_} actions: give one row of them for each state"
        )
    weights = check_weights(sample_weight, X)
    counted = moving(U)
    if projections is not None:
        projections = check_projections(projections, *U.shape, unknown=True)
        counted |= informative(projections)
    counted &= weights > 0
    if not counted.any():
        raise DataError("nothing moves in these recordings, so they say nothing about a policy")
    X, U, weights = X[counted], U[counted], weights[counted]
    seen = sight("auto", U, None if projections is None else projections[counted])
    moments = stacked(policy._moments(X, seen, weights))
    if projections is None and shares_blocks(policy):
        return Information(moments, _traced(moments.H, policy.n_actions_)), counted
    return Information(moments, stacked(policy._moments(X, sight("direct", U), weights)).H), counted


def of_fit(policy: Policy) -> Information:
    """Of all that a fitted policy has learnt from, by its moments alone.

    Raises `PolicyError` where they do not hold G: for features that are not full, or risks that saw more than lines.
    """
    moments = stacked(Moments.sum([fold for fold in policy.moments_ if fold is not None]))
    if not (
        shares_blocks(policy) and policy.risk in ("auto", "inconsistency") and _lines_only(policy, moments)
    ):
        raise PolicyError(
            "the moments of this policy do not say what full observation would have shown: give the recordings, "
            "identifiability(policy, X, U)"
        )
    return Information(moments, _traced(moments.H, policy.n_actions_))


def stacked(moments: Moments) -> Moments:
    """Moments with a leading axis of models, also where there is only one."""
    if moments.H.ndim == 3:
        return moments
    alone = (moments.H[None], moments.g[None], np.reshape(moments.squares, 1), np.reshape(moments.weight, 1))
    return Moments(*alone, moments.n_samples)


def shares_blocks(policy: Policy) -> bool:
    """Whether the policy's features are full, `Φ = I ⊗ bᵀ`, for the whole policy or for every local model."""
    return isinstance(getattr(policy, "features_", None), FullFeatures) or isinstance(
        policy, LocallyLinearPolicy
    )


def seen_along(policy: Policy, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """`Φ(x)ᵀq` of any of the models, (N, P), for states X (N, n) and directions (N, d)."""
    if isinstance(policy, LocallyLinearPolicy):
        features = np.column_stack([X, np.ones(len(X))])
        return (directions[:, :, None] * features[:, None, :]).reshape(len(X), -1)
    return policy.features_.along(X, directions)


def weights_of_models(policy: Policy, X: np.ndarray) -> np.ndarray:
    """How much of a sample at X (N, n) reaches each of S models, (N, S): activations, or ones for a single model."""
    if isinstance(policy, LocallyLinearPolicy):
        return activations(X, policy.centers_, policy.width_)
    return np.ones((len(X), 1))


def _traced(H: np.ndarray, d: int) -> np.ndarray:
    blocks = H.reshape(len(H), d, H.shape[-1] // d, d, H.shape[-1] // d)
    return np.einsum("sjajb->sab", blocks)


def _lines_only(policy: Policy, moments: Moments) -> bool:
    """Whether H holds directions alone. Behind a projection of rank k, a sample adds k times `b bᵀ` to the trace.

    It shows where the basis can write the constant, `cᵀb(x) = 1`: then `cᵀ(Σ_j H_jj)c = Σ ω k`, against `Σ ω`.
    """
    if policy.risk == "inconsistency":
        return True
    transformer = getattr(getattr(policy, "features_", None), "transformer_", None)
    total = _traced(moments.H, policy.n_actions_)
    if transformer is None:
        counted = total[:, -1, -1]
    elif isinstance(transformer, NormalizedRBF):
        counted = total.sum(axis=(-2, -1))
    else:
        return False
    return bool(np.allclose(counted, moments.weight, rtol=1e-6))
