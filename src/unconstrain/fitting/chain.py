"""Which samples were free, along an episode: a hidden state of two values that rarely changes.

Nobody touches and leaves a table at every sample, so what a sample's neighbours say counts. The states form a Markov
chain along each episode, and forward-backward gives the probability of each, given all samples of its episode.

References
----------
Rabiner, A tutorial on hidden Markov models, Proceedings of the IEEE 77, 1989.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unconstrain import loops

Floats = NDArray[np.float64]

FREE, CONSTRAINED = 0, 1
NEVER = 1e-6
"""A probability that is next to none, but leaves room for a sample of which something else is known."""

# As if so many changes and stays had been seen before: a state lasts some 30 samples until the data say otherwise.
CHANGES_BEFORE, STAYS_BEFORE = 1.0, 29.0
# As if so many samples of either kind had been seen before.
SAMPLES_BEFORE = 1.0
MOST_TELLING = 200.0
"""Log-likelihoods further apart than this are as good as certain, and a product of a few exponentials is still a
number."""


@dataclass(frozen=True)
class Chain:
    """Probabilities of the hidden states.

    Parameters
    ----------
    free_share : float
        Probability that the first sample of an episode is free.
    leave_free, leave_constrained : float
        Probability that a sample is of the other kind than the one before it, which was free or constrained.
    """

    free_share: float = 0.5
    leave_free: float = 1 / 30
    leave_constrained: float = 1 / 30

    @property
    def transitions(self) -> Floats:
        """Probabilities from the state of a row to that of a column, (2, 2), the free state first."""
        a, b = self.leave_free, self.leave_constrained
        return np.array([[1 - a, a], [b, 1 - b]])

    @classmethod
    def held(cls, state: str) -> "Chain":
        """Make the chain under which all samples are "free" or "constrained"."""
        small = NEVER if state == "free" else 1 - NEVER
        return cls(1 - small, small, 1 - small)


@dataclass(frozen=True)
class Counts:
    """Expected numbers of states and changes; counts add.

    Parameters
    ----------
    states : ndarray of shape (2,)
        Free and constrained samples.
    changes : ndarray of shape (2, 2)
        From the state of a row to that of a column.
    """

    states: Floats
    changes: Floats

    def __add__(self, other: "Counts") -> "Counts":
        return Counts(self.states + other.states, self.changes + other.changes)

    def chain(self) -> Chain:
        """Estimate the probabilities that these counts are most likely under, and a little of what was assumed.

        Returns
        -------
        Chain
            With no probability of zero or one.
        """
        free = (self.states[FREE] + SAMPLES_BEFORE) / (self.states.sum() + 2 * SAMPLES_BEFORE)
        left = np.diag(self.changes[:, ::-1])
        share = (left + CHANGES_BEFORE) / (self.changes.sum(axis=1) + CHANGES_BEFORE + STAYS_BEFORE)
        return Chain(float(free), float(share[FREE]), float(share[CONSTRAINED]))


def smooth(
    log_free: Floats,
    log_constrained: Floats,
    starts: NDArray[np.bool_],
    chain: Chain,
    log_kept: Floats | None = None,
    weights: Floats | None = None,
    *,
    counts: bool = True,
) -> tuple[Floats, Floats, Counts, Floats]:
    """Compute how surely each sample was free, given all samples of its episode.

    Parameters
    ----------
    log_free, log_constrained : ndarray of shape (N,)
        Log-likelihood of each sample under either state; -inf where the state is known not to hold.
    starts : ndarray of shape (N,), bool
        Whether an episode begins with the sample.
    chain : Chain
        Probabilities of the states.
    log_kept : ndarray of shape (N,), optional
        How much likelier a sample is where it and the one before it are both constrained, as a logarithm.
    weights : ndarray of shape (N,), optional
        How often each sample counts in the counts, 1 by default; a change counts as its later sample.
    counts : bool
        False leaves out the changes, which are then zero, and so is `kept`.

    Returns
    -------
    free : ndarray of shape (N,)
        Probabilities.
    log_likelihood : ndarray of shape (N,)
        Of each sample, given those before it in its episode.
    counts : Counts
        Expected numbers.
    kept : ndarray of shape (N,)
        Probability that a sample and the one before it are both constrained.
    """
    T = chain.transitions
    first = np.array([chain.free_share, 1 - chain.free_share])
    top = np.maximum(log_free, log_constrained)
    relative = np.stack([log_free, log_constrained], axis=1) - top[:, None]
    # What is known stays certain, however strongly the neighbours speak against it.
    likelihood = np.where(np.isneginf(relative), 0.0, np.exp(np.maximum(relative, -MOST_TELLING)))
    omega = np.ones_like(top) if weights is None else weights
    moves = np.broadcast_to(T, (len(top), 2, 2)).copy()
    if log_kept is not None:
        moves[:, CONSTRAINED, CONSTRAINED] *= np.exp(np.clip(log_kept, -MOST_TELLING, MOST_TELLING / 2))
    steps = moves * likelihood[:, None, :]
    # The first sample of an episode forgets what was before.
    steps[starts] = (first * likelihood[starts])[:, None, :]
    alone = starts.all()
    if alone:
        joint = first * likelihood
        norm = joint.sum(axis=1)
        free = joint[:, FREE] / norm
        states = np.array([omega @ free, omega @ (1 - free)])
        return free, top + np.log(norm), Counts(states, np.zeros((2, 2))), np.zeros_like(free)
    ahead = _sweep(steps)
    behind = np.empty_like(ahead)
    behind[-1] = 0.5
    behind[:-1] = _sweep(steps[:0:-1].swapaxes(1, 2))[::-1]
    before = np.empty_like(ahead)
    before[1:] = np.einsum("ni,nij->nj", ahead[:-1], moves[1:])
    before[starts] = first
    log_likelihood = top + np.log(np.einsum("nk,nk->n", before, likelihood))
    both = ahead * behind
    both /= both.sum(axis=1, keepdims=True)
    if not counts:
        return both[:, FREE], log_likelihood, Counts(omega @ both, np.zeros((2, 2))), np.zeros_like(top)
    inner = np.flatnonzero(~starts)
    pairs = ahead[inner - 1][:, :, None] * moves[inner] * (likelihood * behind)[inner][:, None, :]
    pairs /= pairs.sum(axis=(1, 2), keepdims=True)
    kept = np.zeros_like(top)
    kept[inner] = pairs[:, CONSTRAINED, CONSTRAINED]
    changes = np.einsum("n,nij->ij", omega[inner], pairs)
    return both[:, FREE], log_likelihood, Counts(omega @ both, changes), kept


def _sweep(steps: Floats) -> Floats:
    """Compute the rows `r_t = r_{t-1} M_t`, each scaled to sum to one, for M (N, 2, 2).

    The steps are cut into pieces of about √N, and all pieces advance side by side: first each one's product, then the
    row that each begins with, then the rows within.
    """
    N = len(steps)
    compiled = loops.load_for(N, "chain")
    if compiled is not None:
        swept = np.empty((N, 2))
        compiled.sweep(steps, swept)
        return swept
    length = max(1, int(np.sqrt(N)))
    n_pieces = -(-N // length)
    padded = np.empty((n_pieces * length, 2, 2))
    padded[:N], padded[N:] = steps, np.eye(2)
    pieces = padded.reshape(n_pieces, length, 2, 2)
    product = pieces[:, 0].copy()
    for t in range(1, length):
        product = product @ pieces[:, t]
        product /= product.max(axis=(1, 2), keepdims=True)
    row = np.array([0.5, 0.5])
    begins = np.empty((n_pieces, 2))
    for i in range(n_pieces):
        begins[i] = row
        row = row @ product[i]
        row /= row.sum()
    rows = np.empty((n_pieces, length, 2))
    current = begins
    for t in range(length):
        current = np.einsum("ij,ijk->ik", current, pieces[:, t])
        current /= current.sum(axis=1, keepdims=True)
        rows[:, t] = current
    return rows.reshape(-1, 2)[:N]
