"""What a policy is measured by: risks that differ only in the projection before the error.

Every risk here is a mean over samples of a squared error behind a projection,

    E = 1/N Σ_n ‖Q_n (u_n - p_n)‖²,        p_n = model(x_n),

where the rows of `Q_n` (k x d) say what of the action is looked at:

| risk          | Q_n            | error of a sample        | needs            |
| ------------- | -------------- | ------------------------ | ---------------- |
| direct        | I              | ‖u_n - p_n‖²             | data             |
| constrained   | N_n            | ‖u_n - N_n p_n‖²         | true projections |
| inconsistency | û_nᵀ           | (r_n - û_nᵀ p_n)²        | data             |
| auto          | N_n or û_nᵀ    | whichever is known       | some projections |

with `r = ‖u‖` and `û = u / r`. `û ûᵀ` projects onto a line that surely lies in the image of the unknown
`N`, so the true policy has no inconsistency, whatever the constraints were. "auto" uses the projection of every
sample whose constraint is known (measured, computed, learnt) and the line of every other. For every model

    inconsistency <= auto <= constrained policy error <= unconstrained policy error.

What is known of a sample that does not move counts as well: `N pi = 0` there. Without it there is nothing to see.

Source: Howard, Klanke, Gienger, Goerick, Vijayakumar, ICRA 2009, equations (4) to (7).
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from unconstrain.errors import DataError
from unconstrain.validation import check_actions, check_projections

RISKS = ("auto", "inconsistency", "direct", "constrained")

# An action this much shorter than the longest one is rounding left by a projection that blocked all motion:
# its direction is noise, and would be taught as truth.
NO_MOTION = 1e-12

ROWS_IN_BLOCK = 4096  # what a processor's cache holds of a few columns


def moving(U: np.ndarray, scale: float | None = None) -> np.ndarray:
    """Which actions (N, d) have a direction, as a mask (N,): those longer than `NO_MOTION` times `scale`.

    `scale` is the longest action's length, in the action's unit, where it is known from elsewhere.
    """
    r = lengths(U)
    return r > NO_MOTION * (r.max(initial=0.0) if scale is None else scale)


def directions(U: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions `û` (N, d) and lengths `r` (N,) of actions U (N, d); both zero where an action is zero."""
    seen = _along_motion(U)
    return seen.rows[:, 0], seen.lengths


def lengths(U: np.ndarray) -> np.ndarray:
    """`‖u‖`, (N,), of actions U (N, d), in double precision whatever theirs is."""
    squares = np.empty(len(U))
    for start in range(0, len(U), ROWS_IN_BLOCK):
        block = slice(start, start + ROWS_IN_BLOCK)
        part = U[block].astype(np.float64, copy=False)
        np.einsum("nd,nd->n", part, part, out=squares[block])
    return np.sqrt(squares, out=squares)


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

    actions: (N, d), of any precision. lengths: `r`, (N,), zero where nothing moves.
    """

    actions: np.ndarray
    lengths: np.ndarray

    def __len__(self) -> int:
        return len(self.lengths)

    def __getitem__(self, index) -> "AlongMotion":
        if isinstance(index, slice):
            return AlongMotion(self.actions[index], self.lengths[index])
        index = np.flatnonzero(index) if np.asarray(index).dtype == bool else index
        # Stored a row a dimension, along which sums run.
        return AlongMotion(self.actions.T.take(index, axis=1).T, self.lengths[index])

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
        r = self.lengths
        inverse = np.divide(1.0, r, out=np.zeros_like(r), where=r > 0)
        # Stored a row a dimension, which is how products of directions are formed.
        return np.multiply(self.actions.T, inverse, order="C").T[:, None, :]

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


def sight(risk: str, U: np.ndarray, projections: np.ndarray | None = None) -> Sight:
    """What `risk`, one of `RISKS`, sees of actions U (N, d).

    projections: (N, d, d), for "constrained" and "auto"; for "auto" NaN where they are not known, or None.
    """
    if risk == "inconsistency" or (risk == "auto" and projections is None):
        return _along_motion(U)
    d = U.shape[1]
    if risk == "direct":
        return Projected(np.broadcast_to(np.eye(d), (len(U), d, d)), U, whole=True)
    assert projections is not None
    if risk == "constrained":
        # An orthogonal projection is its own Q: NᵀN = N.
        return Projected(projections, np.einsum("nij,nj->ni", projections, U))
    hidden = unknown(projections)
    along = _along_motion(U)
    if hidden.all():
        return along
    rows = np.where(hidden[:, None, None], 0.0, projections)
    targets = np.einsum("nij,nj->ni", rows, U)
    rows[hidden, 0], targets[hidden, 0] = along[hidden].rows[:, 0], along.lengths[hidden]
    return Projected(rows, targets)


def _along_motion(U: np.ndarray) -> AlongMotion:
    r = lengths(U)
    r[r <= NO_MOTION * r.max(initial=0.0)] = 0.0
    return AlongMotion(U, r)


def inconsistency(U, P) -> float:
    """Mean inconsistency `1/N Σ (r_n - û_nᵀ p_n)²` of predictions P (N, d) with actions U (N, d).

    In squared units of the action. Zero actions have no direction: they add nothing to the sum and are
    counted in N, so that `inconsistency <= constrained_policy_error` holds for every model and data.
    """
    U, P = _pair(U, P, "actions", "predictions")
    unit, r = directions(U)
    return float(np.mean((r - np.einsum("nd,nd->n", unit, P)) ** 2))


def direct(U, P) -> float:
    """Mean direct risk `1/N Σ ‖u_n - p_n‖²`, what ordinary regression minimises. U, P (N, d)."""
    U, P = _pair(U, P, "actions", "predictions")
    return float(np.mean(np.sum((U - P) ** 2, axis=1)))


def auto(U, P, N) -> float:
    """Mean risk of what is known, `1/N Σ ‖Q_n (u_n - p_n)‖²`: Q is the projection, or ûᵀ where that is not known.

    In squared units of the action. U (N, d) actions, P (N, d) predictions, N (N, d, d) projections, those not known
    all NaN. Zero actions whose projection is not known add nothing, and are counted, as in `inconsistency`.
    """
    U, P = _pair(U, P, "actions", "predictions")
    seen = sight("auto", U, check_projections(N, *U.shape, unknown=True))
    return float(np.mean(np.sum((seen.targets - np.einsum("nkd,nd->nk", seen.rows, P)) ** 2, axis=1)))


def constrained_policy_error(Pi, P, N) -> float:
    """CPE, `1/N Σ ‖N_n (pi_n - p_n)‖²`: the error that shows under the constraints N (N, d, d).

    Pi (N, d) is the true policy or the constrained action `N pi`, which give the same; P (N, d) predictions.
    """
    Pi, P = _pair(Pi, P, "the true policy", "predictions")
    N = check_projections(N, *Pi.shape)
    return float(np.mean(np.sum(np.einsum("nij,nj->ni", N, Pi - P) ** 2, axis=1)))


def projected_policy_error(Pi, N, learnt) -> float:
    """PPE, `1/N Σ ‖N_n pi_n - Ñ_n pi_n‖²`: how otherwise than the true constraint a learnt one would bend the policy.

    Pi (N, d) true policy, N and learnt (N, d, d) true and learnt projections. `normalized(error, Pi)` is the nPPE,
    `PPE / Σ_j var(pi_j)`. Source: Lin, Howard, Vijayakumar, ICRA 2015.
    """
    Pi = check_actions(Pi, "the true policy")
    N, learnt = check_projections(N, *Pi.shape), check_projections(learnt, *Pi.shape)
    return float(np.mean(np.sum(np.einsum("nij,nj->ni", N - learnt, Pi) ** 2, axis=1)))


def projected_observation_error(U, learnt) -> float:
    """POE, `1/N Σ ‖u_n - Ñ_n u_n‖²`: motion that a learnt constraint would have blocked, though it was seen.

    U (N, d) actions (or their nullspace component), learnt (N, d, d). Needs no truth. `normalized(error, U)` is the
    nPOE, `POE / Σ_j var(u_j)`. Source: Lin, Howard, Vijayakumar, ICRA 2015.
    """
    U = check_actions(U)
    learnt = check_projections(learnt, *U.shape)
    return float(np.mean(np.sum((U - np.einsum("nij,nj->ni", learnt, U)) ** 2, axis=1)))


def unconstrained_policy_error(Pi, P) -> float:
    """UPE, `1/N Σ ‖pi_n - p_n‖²`, of predictions P (N, d) against the true policy Pi (N, d)."""
    return direct(Pi, P)


def normalized(error: float, Pi) -> float:
    """`error / Σ_j var(pi_j)`: a mean error as a share of the true policy's variance over the samples Pi (N, d).

    Turns the errors of this module into the paper's nUPE, nCPE and normalised inconsistency. Where the true
    policy is not known, the actions may stand for it. Raises `DataError` if Pi does not vary.
    """
    variance = float(np.sum(np.var(check_actions(Pi, "the true policy"), axis=0)))
    if variance == 0.0:
        raise DataError(
            "the true policy is the same at every sample, so no error can be a share of its variance"
        )
    return error / variance


def _pair(A, B, name_a: str, name_b: str) -> tuple[np.ndarray, np.ndarray]:
    A, B = check_actions(A, name_a), check_actions(B, name_b)
    if A.shape != B.shape:
        raise DataError(f"{name_a} {A.shape} and {name_b} {B.shape} must have the same shape")
    if not len(A):
        raise DataError("no samples: a mean error needs at least one")
    return A, B
