"""What recordings show of a policy, against what full observation of the same movements would have shown.

For features linear in the parameters, `π(x) = Φ(x) w`,

    H = Σ ω VᵀV,   V = Q Φ     what was observed: along û, or behind a known projection
    G = Σ ω ΦᵀΦ                what would have been observed without any constraint

Q is a projection, so 0 <= H <= G. Samples without motion and without a known projection count in neither.

With full features, `Φ = I ⊗ b(x)ᵀ`, and directions `û` of length one, G need not be summed: the d diagonal blocks of
`H = Σ ω (û ûᵀ) ⊗ (b bᵀ)` add up to `Σ ω ‖û‖² b bᵀ`, and `G = I ⊗ Σ ω b bᵀ`. So a stream or a cluster, which keeps
nothing but H, knows G as well.
"""

from dataclasses import dataclass

import numpy as np

from unconstrain.errors import PolicyError
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import observe
from unconstrain.policies.linear import LinearPolicy
from unconstrain.samples import Samples


@dataclass(frozen=True)
class Information:
    """The moments of S models, and what full observation would have shown of each.

    Parameters
    ----------
    moments : Moments
        What was observed, as the policy's model sums it: with a leading axis of models where there are several.
    whole : ndarray of shape (S, P, P) or (S, P / d, P / d)
        G of each model; where all actions share a basis the block of which G has d copies on its diagonal.
    """

    moments: Moments
    whole: np.ndarray

    @classmethod
    def from_samples(cls, policy: LinearPolicy, samples: Samples) -> "Information":
        """Sum samples up under a fitted policy's features.

        Parameters
        ----------
        policy : LinearPolicy
            Fitted. With the adaptive risk samples show what is inferred of them, else what lies along their motion.
        samples : Samples
            Checked; each has motion or a known projection.

        Returns
        -------
        Information
            Of these samples.
        """
        model, X, U, weights = policy.model_, samples.states, samples.actions, samples.weights
        moments = model.moments(X, policy.observe(samples), weights)
        if samples.projections is None and model.shares_basis and policy.solution_.belief is None:
            return cls(moments, _sum_diagonal_blocks(moments.H, policy.n_actions_))
        whole = model.moments(X, observe("direct", U), weights).H
        return cls(moments, whole.reshape(-1, *whole.shape[-2:]))

    @classmethod
    def from_fit(cls, policy: LinearPolicy) -> "Information":
        """Take the information in all that a policy was fitted to from its moments alone.

        Parameters
        ----------
        policy : LinearPolicy
            Fitted.

        Returns
        -------
        Information
            Of all samples so far.

        Raises
        ------
        PolicyError
            The moments do not hold G: for features without a shared basis, for other risks than the inconsistency, or
            where projections were known.
        """
        if not policy.model_.shares_basis or policy.risk != "inconsistency" or policy.n_known_constraints_:
            raise PolicyError(
                "the moments of this policy do not say what full observation would have shown: give the recordings, "
                "identifiability(policy, X, U)"
            )
        moments = policy.resume().moments()
        return cls(moments, _sum_diagonal_blocks(moments.H, policy.n_actions_))

    @property
    def observed(self) -> np.ndarray:
        """H of each model, an array of shape (S, P, P)."""
        return self.moments.H.reshape(len(self), *self.moments.H.shape[-2:])

    @property
    def copies(self) -> int:
        """How many copies of a block of `whole` make up G."""
        return self.moments.H.shape[-1] // self.whole.shape[-1]

    def __len__(self) -> int:
        return len(self.whole)


def _sum_diagonal_blocks(H: np.ndarray, d: int) -> np.ndarray:
    """Sum the d diagonal blocks of H (..., P, P): (S, P / d, P / d)."""
    blocks = H.reshape(-1, d, H.shape[-1] // d, d, H.shape[-1] // d)
    return np.einsum("sjajb->sab", blocks)
