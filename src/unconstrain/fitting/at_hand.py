"""Going on from a policy that was learnt from most of the samples already, as after one more episode.

Expectation maximisation then begins where it ended before: the samples are judged by the policy at hand, and a few
passes do, in the place of several runs that begin with regression and with the inconsistency. A run like that finds the
nearest explanation, which could be a worse one than inference anew would find. So it is given up, and contact is
inferred anew, where

- all samples count as free in the policy at hand, so that there is no explanation to go on from;
- there are twice as many samples as when contact was last inferred anew;
- "all free" explains held-out samples as well;
- held-out samples are explained less well than those of the policy at hand were, by more than what is noticeable and
  what episodes differ by.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from unconstrain.fitting.contact import Belief
from unconstrain.fitting.gains import NOTICEABLE

GROWTH = 2.0
"""By what the samples may have grown since contact was last inferred anew."""

MOST_NEW = 0.05
"""Share of the samples, at most, of which it is expected that they may be explained less well than others, each by one
in log-likelihood: so much do episodes differ, and so much is no sign that another explanation would be better."""

ALL_FREE = "in the policy at hand all samples count as free"
GROWN = "there are twice as many samples as when it was last inferred anew"
FREE_AS_WELL = "without any contact the samples are explained as well"
LESS_LIKELY = "the samples are explained less well than by the policy at hand those that it was learnt from"


@dataclass(frozen=True)
class AtHand:
    """The policy that an inference goes on from.

    Parameters
    ----------
    predict : callable
        From states (N, n) to its actions (N, d), in their own units.
    belief : Belief
        How it explains its samples; the parameters are not looked at.
    scale : ndarray of shape (d,)
        In units of which its noise is.
    alpha : float
        Its λ.
    log_likelihood : float
        Of a held-out sample of its own.
    n_samples, n_anew : int
        How many samples it was learnt from, and how many there were when contact was last inferred anew.
    is_all_free : bool
        Whether it found no contact.
    """

    predict: Callable[[np.ndarray], np.ndarray]
    belief: Belief
    scale: np.ndarray
    alpha: float
    log_likelihood: float
    n_samples: int
    n_anew: int
    is_all_free: bool

    def start(self, scale: np.ndarray | None) -> tuple[Belief, Callable[[np.ndarray], np.ndarray]]:
        """Say by what samples are judged at first.

        Parameters
        ----------
        scale : ndarray of shape (d,), optional
            What actions are divided by now.

        Returns
        -------
        belief : Belief
            Without parameters.
        predict : callable
            From states (N, n) to actions (N, d) in units of the scale.
        """
        units = np.ones(len(self.scale)) if scale is None else scale
        noise = self.belief.noise
        factor = float(np.mean((self.scale / units) ** 2))
        noise = type(noise)(noise.action * factor, noise.speed)
        drift = self.belief.drift
        predict = self.predict
        return Belief(None, noise, self.belief.chain, drift), lambda X: predict(X) / units

    def why_not(self, n_samples: int) -> str:
        """Say why contact has to be inferred anew.

        Parameters
        ----------
        n_samples : int
            How many there are now.

        Returns
        -------
        str
            A clause; empty where nothing speaks against it.
        """
        if self.is_all_free:
            return ALL_FREE
        return GROWN if n_samples > GROWTH * self.n_anew else ""

    def why_given_up(self, log_likelihood: float, n_samples: int, *, is_all_free: bool) -> str:
        """Say why what was found is not kept.

        Parameters
        ----------
        log_likelihood : float
            Of a held-out sample, by what explains the samples best.
        n_samples : int
            How many there are now.
        is_all_free : bool
            Whether that is "all free".

        Returns
        -------
        str
            A clause; empty where it is kept.
        """
        if is_all_free:
            return FREE_AS_WELL
        new = min(max(1 - self.n_samples / n_samples, 0.0), MOST_NEW)
        return LESS_LIKELY if log_likelihood < self.log_likelihood - NOTICEABLE - new else ""


def describe_beginning(why_anew: str) -> str:
    """Say how an inference that was given a policy to go on from has begun.

    Parameters
    ----------
    why_anew : str
        Why contact was inferred anew; empty where it was not.

    Returns
    -------
    str
        A sentence.
    """
    if why_anew:
        return f"contact was inferred anew, not from the policy at hand: {why_anew}"
    return "contact was inferred from the policy at hand"


def is_at_hand(policy: Any) -> bool:
    """Tell whether something can be gone on from: a fitted policy that has found out about contact.

    Parameters
    ----------
    policy : object
        That was given.

    Returns
    -------
    bool
        True for policies with a belief.
    """
    return getattr(getattr(policy, "solution_", None), "belief", None) is not None
