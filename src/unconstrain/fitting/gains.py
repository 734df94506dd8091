"""Whether one explanation of the same samples is clearly likelier than another."""

from unconstrain.fitting.contact import Tally
from unconstrain.fitting.plausible import is_plausible

INDEPENDENT = 0.5
"""Evidence of a sample from which on likelihoods tell kinds of noise apart: dependent residuals look like anything."""

NOTICEABLE = 0.03
"""Gain in held-out log-likelihood, per independent sample, for which contact is taken to be there. Residuals of a model
that does not quite fit change slowly along an episode, and a hundred samples then tell no more than one."""

DECISIVE = 20.0
"""The same of all samples together."""


def clear_gain(
    gain: float, tally: Tally, n_actions: int, *, least: float = NOTICEABLE, discounted: bool = True
) -> float:
    """Return what a gain in log-likelihood counts.

    What it counts hangs on the evidence of the explanation that gains, not of the one it is compared with: residuals of
    a wrong explanation are correlated because it is wrong.

    Parameters
    ----------
    gain : float
        Per sample, of the one explanation over the other.
    tally : Tally
        What the one that gains finds in the samples.
    n_actions : int
        Dimension of the actions, d.
    least : float
        Gain that is not enough.
    discounted : bool
        Whether samples that resemble those before them count less.

    Returns
    -------
    float
        The gain, per independent sample if `discounted`; 0 where it is not clear, or the policy implausibly large.
    """
    if discounted:
        gain *= min(tally.evidence / INDEPENDENT, 1.0)
    is_clear = gain > least and gain * tally.n_samples > DECISIVE
    return gain if is_clear and is_plausible(tally.size, n_actions) else 0.0
