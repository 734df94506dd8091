"""Which recorded samples are shown, and how surely each was free."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, UnconstrainError
from unconstrain.fitting.region import FINEST
from unconstrain.policies.base import Policy

Array = NDArray[np.float64]

MOST = 20_000
"""Samples that are shown; the browser would draw more, but slowly over a network."""
MOST_JUDGED = 200_000
"""Samples of which contact is inferred."""
LINE = 20
"""Samples that an episode has to keep, in the mean, to be seen as a line."""
ROUNDING = 1e-9


@dataclass(frozen=True)
class Shown:
    """The recorded samples that are shown.

    Parameters
    ----------
    demos : Demonstrations
        Thinned; the samples of an episode follow each other.
    free : ndarray of shape (N,), or None
        How surely each was free; None where nothing tells.
    source : str
        What says so, in a phrase.
    notes : tuple of str
        What was left out, a sentence each.
    """

    demos: Demonstrations
    free: Array | None
    source: str
    notes: tuple[str, ...]

    @property
    def joined(self) -> NDArray[np.bool_]:
        """Which samples (N - 1,) are followed by another of their episode."""
        return np.asarray(self.demos.episodes[1:] == self.demos.episodes[:-1])


def choose(policy: Policy, demos: Demonstrations | None) -> Shown:
    """Choose the samples that are shown.

    Parameters
    ----------
    policy : Policy
        Fitted.
    demos : Demonstrations, optional
        Recordings, in the order of time within each episode. Without them, the middles of the boxes in which the policy
        was learnt are shown.

    Returns
    -------
    Shown
        At most about `MOST` samples.

    Raises
    ------
    DataError
        Without recordings: states are not plain numbers.
    """
    if demos is None:
        return _of_region(policy)
    notes = []
    every = -(-len(demos) // MOST)
    if len(demos) > MOST_JUDGED:
        kept, words = _kept(demos, every)
        thin = demos.select(kept)
        notes.append(f"{words}, and judged by itself")
        free, source = judge(policy, thin)
        return Shown(_continuous(thin), free, source, tuple(notes))
    free, source = judge(policy, demos)
    if every > 1:
        kept, words = _kept(demos, every)
        notes.append(words)
        demos, free = demos.select(kept), None if free is None else free[kept]
    return Shown(_continuous(demos), free, source, tuple(notes))


def judge(policy: Policy, demos: Demonstrations) -> tuple[Array | None, str]:
    """Say how surely each sample was free, and by what: measured projections come first.

    Parameters
    ----------
    policy : Policy
        Fitted.
    demos : Demonstrations
        Recordings.

    Returns
    -------
    free : ndarray of shape (N,), or None
        Probabilities, NaN where nothing tells; None where nothing tells of any sample.
    source : str
        What says so, in a phrase.
    """
    N = demos.projections
    known = np.zeros(len(demos), dtype=bool) if N is None else ~np.isnan(N[:, 0, 0])
    try:
        free, source = policy.free_probability(demos), "inferred"
    except UnconstrainError:  # learnt by another risk
        if not known.any():
            return None, "not inferred: the policy was learnt by another risk than the adaptive one"
        free, source = np.full(len(demos), np.nan), "recorded"
    if N is not None and known.any():
        whole = np.abs(N[known] - np.eye(N.shape[-1])).max(axis=(1, 2)) < ROUNDING
        free[known] = whole
        if known.all() or source == "recorded":
            source = "recorded"
        else:
            source = f"recorded for {known.mean():.0%} of the samples"
    return free, source


def _kept(demos: Demonstrations, every: int) -> tuple[NDArray[np.intp], str]:
    """Choose one in so many of the samples, or of the episodes where they would be points then, and no lines."""
    if len(demos) < LINE * every * demos.n_episodes and demos.n_episodes >= LINE * every:
        kept = np.flatnonzero(demos.episodes % every == 0)
        return kept, f"of {demos.n_episodes:,} episodes one in {every} is shown"
    return np.arange(0, len(demos), every), f"of {len(demos):,} samples one in {every} is shown"


def _continuous(demos: Demonstrations) -> Demonstrations:
    """Put episodes one after the other, so that those that follow each other are joined."""
    order = np.argsort(demos.episodes, kind="stable")
    return demos if np.array_equal(order, np.arange(len(demos))) else demos.select(order)


def _of_region(policy: Policy) -> Shown:
    """Show where a policy was learnt, from what it keeps of the recorded states."""
    if not policy.space_.is_flat:
        raise DataError(
            f"the policy's states are {policy.space_.words}, and it does not keep where they were recorded: give the "
            "recordings too, demos="
        )
    region = policy.region()
    X = (region.boxes + 0.5) * (FINEST * 2.0**region.coarseness) * region.unit
    demos = Demonstrations(
        X,
        policy.predict(X).reshape(len(X), -1),
        episodes=np.arange(len(X)),
        state_names=getattr(policy, "state_names_", None),
    )
    note = "no recordings were given: the middles of the boxes in which the policy was learnt are shown"
    return Shown(demos, None, "not inferred: there are no recordings", (note,))
