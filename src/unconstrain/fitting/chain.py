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
    relative = np.stack([log_free, log_constrained]) - top
    # What is known stays certain, however strongly the neighbours speak against it.
    likelihood = np.where(np.isneginf(relative), 0.0, np.exp(np.maximum(relative, -MOST_TELLING)))
    omega = np.ones_like(top) if weights is None else weights
    if starts.all():
        joint = first[:, None] * likelihood
        norm = joint.sum(axis=0)
        free = joint[FREE] / norm
        states = np.array([omega @ free, omega @ (1 - free)])
        return free, top + np.log(norm), Counts(states, np.zeros((2, 2))), np.zeros_like(free)
    # A row a pair of states: what follows is then one operation on all samples.
    moves = np.repeat(T[:, :, None], len(top), axis=2)
    if log_kept is not None:
        moves[CONSTRAINED, CONSTRAINED] *= np.exp(np.clip(log_kept, -MOST_TELLING, MOST_TELLING / 2))
    steps = moves * likelihood
    # The first sample of an episode forgets what was before.
    steps[:, :, starts] = (first[:, None] * likelihood[:, starts])[None]
    ahead, behind = _sweep_both_ways(steps)
    before = np.empty_like(ahead)
    before[:, 1:] = ahead[0, :-1] * moves[0, :, 1:] + ahead[1, :-1] * moves[1, :, 1:]
    before[:, starts] = first[:, None]
    log_likelihood = top + np.log(before[0] * likelihood[0] + before[1] * likelihood[1])
    both = ahead * behind
    both /= both[0] + both[1]
    pairs = ahead[:, None, :-1] * moves[:, :, 1:] * (likelihood * behind)[:, 1:]
    pairs = np.where(starts[1:], 0.0, pairs)
    total = pairs.reshape(4, -1).sum(axis=0)
    pairs /= np.where(starts[1:], 1.0, total)
    kept = np.zeros_like(top)
    kept[1:] = pairs[CONSTRAINED, CONSTRAINED]
    return both[FREE], log_likelihood, Counts(both @ omega, pairs @ omega[1:]), kept


def _sweep_both_ways(steps: Floats) -> tuple[Floats, Floats]:
    """Compute rows `r_t = r_{t-1} M_t` and columns `c_t = M_{t+1} c_{t+1}`, each scaled to sum to one.

    Parameters
    ----------
    steps : ndarray of shape (2, 2, N)
        M.

    Returns
    -------
    rows : ndarray of shape (2, N)
        From (1/2, 1/2) before the first step.
    columns : ndarray of shape (2, N)
        Of which the last is (1/2, 1/2).
    """
    N = steps.shape[2]
    compiled = loops.load_for(N, "chain")
    columns = np.empty((2, N))
    columns[:, -1] = 0.5
    if compiled is not None:
        one_by_one, rows, swept = steps.transpose(2, 0, 1).copy(), np.empty((N, 2)), np.empty((N - 1, 2))
        compiled.sweep(one_by_one, rows)
        compiled.sweep(one_by_one[:0:-1].swapaxes(1, 2), swept)
        columns[:, :-1] = swept[::-1].T
        return rows.T, columns
    ahead, back = _sweep(steps, steps[:, :, :0:-1].swapaxes(0, 1))
    columns[:, :-1] = back[:, ::-1]
    return ahead, columns


def _sweep(*sequences: Floats) -> list[Floats]:
    """Compute the rows `r_t = r_{t-1} M_t`, each scaled to sum to one, for sequences of M (2, 2, N).

    Each sequence is cut into pieces of about √N, and all pieces advance side by side: first each one's product, then
    the row that each begins with, then the rows within.
    """
    length = max(1, int(np.sqrt(sequences[0].shape[2])))
    numbers = [-(-sequence.shape[2] // length) for sequence in sequences]
    pieces = np.concatenate(
        [_cut(sequence, length, number) for sequence, number in zip(sequences, numbers, strict=True)], axis=3
    )
    product = pieces[0]
    for t in range(1, length):
        product = product[:, 0, None] * pieces[t, 0] + product[:, 1, None] * pieces[t, 1]
        product /= np.maximum.reduce(product.reshape(4, -1))
    ends = np.cumsum(numbers)
    begins = np.concatenate([_begins(part) for part in np.split(product, ends[:-1], axis=2)], axis=1)
    rows, current = np.empty((length, *begins.shape)), begins
    for t in range(length):
        current = np.add(current[0] * pieces[t, 0], current[1] * pieces[t, 1], out=rows[t])
        current /= current[0] + current[1]
    return [
        part.transpose(1, 2, 0).reshape(2, -1)[:, : sequence.shape[2]]
        for part, sequence in zip(np.split(rows, ends[:-1], axis=2), sequences, strict=True)
    ]


def _cut(sequence: Floats, length: int, number: int) -> Floats:
    """Cut matrices (2, 2, N) into pieces, (length, 2, 2, number), the last of which ends with identities."""
    N = sequence.shape[2]
    padded = np.empty((2, 2, number * length))
    padded[:, :, :N], padded[:, :, N:] = sequence, np.eye(2)[:, :, None]
    return np.ascontiguousarray(padded.reshape(2, 2, number, length).transpose(3, 0, 1, 2))


def _begins(products: Floats) -> Floats:
    """Compute the rows (2, K) that pieces begin with, given the product of each, (2, 2, K)."""
    a = b = 0.5
    begins = []
    for (aa, ab), (ba, bb) in products.transpose(2, 0, 1).tolist():
        begins.append((a, b))
        first, second = a * aa + b * ba, a * ab + b * bb
        a, b = first / (first + second), second / (first + second)
    return np.array(begins).reshape(-1, 2).T
