"""What is seen of samples: the part of the action that a risk looks at.

Every risk is an error behind a projection, `Σ_n ‖Q_n (u_n - p_n)‖²` (see `risk`), so all it knows of a sample is `Q_n`
and `Q_n u_n`: the whole action, what the constraint lets through, or its length along the motion.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from unconstrain.motion import NO_MOTION, lengths

RISKS = ("auto", "inconsistency", "direct", "constrained")


class Sight(Protocol):
    """What a risk sees of N samples: `Q_n` and `Q_n u_n` of `Σ_n ‖Q_n (u_n - p_n)‖²`. A part of it is a sight too."""

    @property
    def rows(self) -> np.ndarray:
        """`Q`, (N, k, d)."""
        ...

    @property
    def targets(self) -> np.ndarray:
        """`Q u`, (N, k)."""
        ...

    @property
    def squares(self) -> np.ndarray:
        """`‖Q u‖²` of each sample, (N,)."""
        ...

    @property
    def whole(self) -> bool:
        """Whether every `Q_n` is the identity, so that the action's dimensions part company."""
        ...

    @property
    def n_actions(self) -> int:
        """d."""
        ...

    @property
    def n_rows(self) -> int:
        """k."""
        ...

    def __len__(self) -> int: ...

    def __getitem__(self, index) -> "Sight": ...


@dataclass(frozen=True)
class Projected:
    """The sight through projections that are there as arrays."""

    rows: np.ndarray
    targets: np.ndarray
    whole: bool = False

    def __len__(self) -> int:
        return len(self.targets)

    def __getitem__(self, index) -> "Projected":
        return Projected(self.rows[index], self.targets[index], self.whole)

    @property
    def n_actions(self) -> int:
        return self.rows.shape[2]

    @property
    def n_rows(self) -> int:
        return self.rows.shape[1]

    @property
    def squares(self) -> np.ndarray:
        return np.einsum("nk,nk->n", self.targets, self.targets)


@dataclass(frozen=True)
class AlongMotion:
    """The sight of the inconsistency, `Q = ûᵀ` and `Q u = r`, made where it is looked at.

    Directions are worked out a block at a time, in the processor's cache: looking at them is then cheaper than
    fetching them from memory would be.

    actions: (N, d), of any precision. lengths: `r`, (N,), and inverse: `1/r`, both zero where nothing moves.
    """

    actions: np.ndarray
    lengths: np.ndarray
    inverse: np.ndarray

    def __len__(self) -> int:
        return len(self.lengths)

    def __getitem__(self, index) -> "AlongMotion":
        if isinstance(index, slice):
            return AlongMotion(self.actions[index], self.lengths[index], self.inverse[index])
        index = np.flatnonzero(index) if np.asarray(index).dtype == bool else index
        # Stored a row a dimension, along which sums run.
        return AlongMotion(self.actions.T.take(index, axis=1).T, self.lengths[index], self.inverse[index])

    @property
    def whole(self) -> bool:
        return False

    @property
    def n_actions(self) -> int:
        return self.actions.shape[1]

    @property
    def n_rows(self) -> int:
        return 1

    @property
    def rows(self) -> np.ndarray:
        # Stored a row a dimension, along which products of directions are formed.
        return np.multiply(self.actions.T, self.inverse, order="C").T[:, None, :]

    @property
    def targets(self) -> np.ndarray:
        return self.lengths[:, None]

    @property
    def squares(self) -> np.ndarray:
        return self.lengths**2


def unknown(projections: np.ndarray) -> np.ndarray:
    """Which of the projections (N, d, d) are not known, as a mask (N,): those that are NaN."""
    return np.isnan(projections).any(axis=(1, 2))


def informative(projections: np.ndarray) -> np.ndarray:
    """Which projections (N, d, d) say something of the policy even where nothing moves, as a mask (N,)."""
    return ~unknown(projections) & projections.any(axis=(1, 2))


def sight(
    risk: str, U: np.ndarray, projections: np.ndarray | None = None, r: np.ndarray | None = None
) -> Sight:
    """What `risk`, one of `RISKS`, sees of actions U (N, d).

    projections: (N, d, d), for "constrained" and "auto"; for "auto" NaN where they are not known, or None.
    r: the actions' lengths (N,), zero where nothing moves, if they are worked out already.
    """
    if risk == "inconsistency" or (risk == "auto" and projections is None):
        return _along_motion(U, r)
    d = U.shape[1]
    if risk == "direct":
        # Squared by whoever looks, so in double precision.
        return Projected(
            np.broadcast_to(np.eye(d), (len(U), d, d)), U.astype(np.float64, copy=False), whole=True
        )
    assert projections is not None
    if risk == "constrained":
        # An orthogonal projection is its own Q: NᵀN = N.
        return Projected(projections, np.einsum("nij,nj->ni", projections, U))
    hidden = unknown(projections)
    along = _along_motion(U, r)
    if hidden.all():
        return along
    rows = np.where(hidden[:, None, None], 0.0, projections)
    targets = np.einsum("nij,nj->ni", rows, U)
    rows[hidden, 0], targets[hidden, 0] = along[hidden].rows[:, 0], along.lengths[hidden]
    return Projected(rows, targets)


def errors(seen: Sight, P: np.ndarray) -> np.ndarray:
    """`‖Q (u - p)‖²` of predictions P (N, d), (N,), in squared units of the action."""
    return np.sum((seen.targets - np.einsum("nkd,nd->nk", seen.rows, P)) ** 2, axis=1)


def _along_motion(U: np.ndarray, r: np.ndarray | None = None) -> AlongMotion:
    if r is None:
        r = lengths(U)
        r[r <= NO_MOTION * r.max(initial=0.0)] = 0.0
    return AlongMotion(U, r, np.divide(1.0, r, out=np.zeros_like(r), where=r > 0))
