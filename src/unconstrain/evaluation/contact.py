"""Which samples of other recordings were free, and how likely these are."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from unconstrain.demonstrations import Demonstrations
from unconstrain.evaluation.scores import gaussian_log_likelihood
from unconstrain.fitting.contact import infer
from unconstrain.fitting.in_space import in_units
from unconstrain.policies.base import Policy
from unconstrain.samples import Samples

ROUNDS = 3
"""How often noise and contact are estimated in turn."""


class Contact(NamedTuple):
    """What a policy finds in recordings that it has not learnt from.

    Parameters
    ----------
    free : ndarray of shape (N,)
        Probability that nothing was in the way of each sample: all ones by ordinary regression, zeros by risks that
        take no sample for free.
    log_likelihood : float
        Of a sample; NaN for risks that have none.
    noise : float
        Standard deviation of these recordings' noise, in units of the policy's scale; NaN likewise.
    """

    free: np.ndarray
    log_likelihood: float
    noise: float


def find_contact(policy: Policy, demos: Demonstrations) -> Contact:
    """Infer which samples were free, with noise as these recordings have it, or as those learnt from if they have less.

    Another day's recordings may be noisier than those learnt from. Judged by the noise of those, each of them would
    look constrained, and of a constrained sample little has to be explained.

    Parameters
    ----------
    policy : Policy
        Fitted.
    demos : Demonstrations
        N samples.

    Returns
    -------
    Contact
        Of these.
    """
    belief = policy.solution_.belief
    if belief is None:
        whole = policy.risk == "direct"
        free = np.full(len(demos), float(whole))
        if not whole:
            return Contact(free, np.nan, np.nan)
        U = policy.scaled(demos.actions)
        P = policy.scaled(policy.predict(demos.states).reshape(U.shape))
        return Contact(free, gaussian_log_likelihood(U, P), float(np.sqrt(np.mean((U - P) ** 2))))
    samples = in_units(
        policy.model_.scale,
        Samples(demos.states, demos.actions, groups=demos.episodes, projections=demos.projections),
    )
    kinds = ("action", "speed") if belief.noise.speed > 0 else ("action",)
    learnt = belief.noise
    for _ in range(ROUNDS):
        found = infer(policy.model_, belief, samples)
        noise = found.tally.squares.estimate(kinds)
        # With less noise than was learnt from, what the policy itself misses would look constrained.
        noise = replace(noise, action=max(noise.action, learnt.action), speed=max(noise.speed, learnt.speed))
        belief = replace(belief, noise=noise)
    found = infer(policy.model_, belief, samples)
    likelihood = found.tally.log_likelihood / found.tally.n_samples
    return Contact(found.free, float(likelihood), float(np.sqrt(belief.noise.action)))
