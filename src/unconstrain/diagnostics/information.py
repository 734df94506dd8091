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
from numpy.typing import ArrayLike

from unconstrain.arrays import check_actions, check_projections, check_states, check_weights
from unconstrain.errors import DataError, PolicyError
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import informative, observe
from unconstrain.motion import moving
from unconstrain.policies.base import Policy


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
    policy: Policy,
    X: ArrayLike,
    U: ArrayLike,
    sample_weight: ArrayLike | None = None,
    projections: ArrayLike | None = None,
) -> tuple[Information, np.ndarray]:
    """Return the information in recordings, under a fitted policy's features.

    Parameters
    ----------
    policy : Policy
        Its own risk does not matter: the recordings show what they show.
    X : array (N, n)
        States.
    U : array (N, d)
        Actions.
    sample_weight : array (N,), optional
        Weights of the samples.
    projections : array (N, d, d), optional
        NaN where not known.

    Returns
    -------
    information : Information
        Of all models.
    counted : array (N,) of bool
        Which samples say something.

    Raises
    ------
    DataError
        The arrays do not fit the policy, or nothing moves.
    """
    states, actions = check_states(policy, X), check_actions(U)
    if actions.shape != (len(states), policy.n_actions_):
        raise DataError(
            f"these recordings have {len(states)} states and actions of shape {actions.shape}, and the policy has "
            f"{policy.n_actions_} actions: give one row of them for each state"
        )
    weights = check_weights(sample_weight, states)
    counted, known = moving(actions), None
    if projections is not None:
        known = check_projections(projections, *actions.shape, unknown=True)
        counted |= informative(known)
    counted &= weights > 0
    if not counted.any():
        raise DataError("nothing moves in these recordings, so they say nothing about a policy")
    states, actions, weights = states[counted], actions[counted], weights[counted]
    model = policy.model_
    observation = observe("inconsistency", actions, None if known is None else known[counted])
    moments = stacked(model.moments(states, observation, weights))
    if projections is None and model.shares_basis:
        return Information(moments, _traced(moments.H, policy.n_actions_)), counted
    return Information(
        moments, stacked(model.moments(states, observe("direct", actions), weights)).H
    ), counted


def of_fit(policy: Policy) -> Information:
    """Return the information in all that a fitted policy has learnt from, by its moments alone.

    Parameters
    ----------
    policy : Policy
        Fitted.

    Returns
    -------
    Information
        Of all models.

    Raises
    ------
    PolicyError
        The moments do not hold G: for features without a shared basis, for the direct risk, or where projections were
        known.
    """
    moments = stacked(policy.resume().moments())
    if not policy.model_.shares_basis or policy.risk == "direct" or policy.n_known_constraints_:
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


def _traced(H: np.ndarray, d: int) -> np.ndarray:
    blocks = H.reshape(len(H), d, H.shape[-1] // d, d, H.shape[-1] // d)
    return np.einsum("sjajb->sab", blocks)
