"""Observations: what a recorded action says of the policy.

Every risk is a sum of squared errors behind projections,

    E = Σ_n ω_n ‖Q_n (u_n - p_n)‖²,        p_n = model(x_n),

so all it uses of a sample is `Q_n` and `Q_n u_n`:

| risk          | the sample                  | Q_n  | Q_n u_n | error            |
| ------------- | --------------------------- | ---- | ------- | ---------------- |
| inconsistency | its projection is not known | û_nᵀ | r_n     | (r_n - û_nᵀ p_n)² |
| inconsistency | its projection is known     | N_n  | u_n     | ‖u_n - N_n p_n‖² |
| direct        | any                         | I    | u_n     | ‖u_n - p_n‖²     |

The adaptive risk is a mixture of the first and the last, sample by sample, with weights that hang on the policy so far
(`contact`); `Expanded` is its observation. The corrected risk is that of the first two, each sample weighted by r²,
less what noise adds to it (`corrected`).

with `r = ‖u‖` and `û = u / r`. `û ûᵀ` projects onto a line that surely lies in the image of the unknown N, so the true
policy has no inconsistency, whatever the constraints were. For every model

    inconsistency <= constrained policy error <= unconstrained policy error.

A sample that does not move and whose projection is not known says nothing. One whose projection is known counts even
then: `N π = 0` there.

References
----------
Howard, Klanke, Gienger, Goerick, Vijayakumar, ICRA 2009, equations (4) to (7).
"""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from unconstrain.fitting.kernels.products import distinct_products, pairs
from unconstrain.motion import NO_MOTION, lengths

RISKS = ("adaptive", "corrected", "inconsistency", "direct")


class Observation(Protocol):
    """What N samples say of the policy: `Q_n` and `Q_n u_n`. Slicing returns an observation of those samples."""

    @property
    def rows(self) -> np.ndarray:
        """`Q`, (N, k, d)."""
        ...

    @property
    def row_weights(self) -> np.ndarray | None:
        """What each row's square counts, (N, k); None stands for 1, and then there are `targets`."""
        ...

    @property
    def targets(self) -> np.ndarray | None:
        """`Q u`, (N, k); None where only `pulls` are known."""
        ...

    @property
    def squares(self) -> np.ndarray:
        """`‖Q u‖²` of each sample, (N,)."""
        ...

    @property
    def whole(self) -> bool:
        """Whether every `Q_n` is the identity, so that the dimensions of the action can be solved one by one."""
        ...

    @property
    def n_actions(self) -> int:
        """The number of action dimensions, d."""
        ...

    @property
    def n_rows(self) -> int:
        """The number of rows of each `Q_n`, k."""
        ...

    @property
    def pulls(self) -> np.ndarray:
        """`QᵀQ u`, (N, d)."""
        ...

    def products(self, weights: np.ndarray | None = None, out: np.ndarray | None = None) -> np.ndarray:
        """Compute the distinct entries of `ω QᵀQ`.

        Parameters
        ----------
        weights : ndarray of shape (N,), optional
            Weights ω, 1 by default.
        out : ndarray of shape (d(d+1)/2, N), optional
            Where they may be written.

        Returns
        -------
        ndarray of shape (d(d+1)/2, N)
            In the order of `products.pairs`.
        """
        ...

    def weigh(self, P: np.ndarray) -> np.ndarray:
        """Compute `QᵀQ p`.

        Parameters
        ----------
        P : ndarray of shape (N, L, d)
            L actions for each sample.

        Returns
        -------
        ndarray of shape (N, L, d)
            Of each.
        """
        ...

    def __len__(self) -> int: ...

    def __getitem__(self, index: Any) -> "Observation": ...


@dataclass(frozen=True)
class Projected:
    """The observation behind projections that are held as arrays.

    Parameters
    ----------
    rows : ndarray of shape (N, k, d)
        `Q`.
    targets : ndarray of shape (N, k)
        `Q u`.
    whole : bool
        Whether every `Q` is the identity.
    """

    rows: np.ndarray
    targets: np.ndarray
    whole: bool = False

    def __len__(self) -> int:
        return len(self.targets)

    def __getitem__(self, index: Any) -> "Projected":
        return Projected(self.rows[index], self.targets[index], self.whole)

    @property
    def row_weights(self) -> None:
        """None: each row counts as it is."""
        return

    @property
    def n_actions(self) -> int:
        """The number of action dimensions, d."""
        return self.rows.shape[2]

    @property
    def n_rows(self) -> int:
        """The number of rows of each `Q_n`, k."""
        return self.rows.shape[1]

    @property
    def squares(self) -> np.ndarray:
        """`‖Q u‖²` of each sample, (N,)."""
        return np.einsum("nk,nk->n", self.targets, self.targets)

    @property
    def pulls(self) -> np.ndarray:
        """`QᵀQ u`, (N, d)."""
        return self.targets if self.whole else np.einsum("nki,nk->ni", self.rows, self.targets)

    def products(self, weights: np.ndarray | None = None, out: np.ndarray | None = None) -> np.ndarray:
        """Compute the distinct entries of `ω QᵀQ`; see `Observation.products`."""
        if self.n_rows == 1:
            return distinct_products(self.rows[:, 0], weights, out)
        i, j = pairs(self.n_actions)
        products = np.einsum("nki,nkj->nij", self.rows, self.rows)[:, i, j].T
        return products if weights is None else products * weights

    def weigh(self, P: np.ndarray) -> np.ndarray:
        """Compute `QᵀQ p`; see `Observation.weigh`."""
        if self.whole:
            return P
        if self.n_rows == 1:
            return _project(self.rows[:, 0], P)
        return np.einsum("nlk,nkd->nld", np.einsum("nkd,nld->nlk", self.rows, P), self.rows)


@dataclass(frozen=True)
class AlongMotion:
    """The observation of the inconsistency, `Q = ûᵀ` and `Q u = r`.

    Directions are computed when they are used, a block at a time in the processor's cache: that is cheaper than
    fetching them from memory.

    Parameters
    ----------
    actions : ndarray of shape (N, d)
        Of any precision.
    lengths : ndarray of shape (N,)
        `r`, zero where nothing moves.
    inverse : ndarray of shape (N,)
        `1/r`, zero where nothing moves.
    """

    actions: np.ndarray
    lengths: np.ndarray
    inverse: np.ndarray

    def __len__(self) -> int:
        return len(self.lengths)

    def __getitem__(self, index: Any) -> "AlongMotion":
        if isinstance(index, slice):
            return AlongMotion(self.actions[index], self.lengths[index], self.inverse[index])
        index = np.flatnonzero(index) if np.asarray(index).dtype == bool else index
        # Stored a row a dimension, along which sums run.
        return AlongMotion(self.actions.T.take(index, axis=1).T, self.lengths[index], self.inverse[index])

    @property
    def whole(self) -> bool:
        """False: a direction is not the identity."""
        return False

    @property
    def n_actions(self) -> int:
        """The number of action dimensions, d."""
        return self.actions.shape[1]

    @property
    def row_weights(self) -> None:
        """None: each row counts as it is."""
        return

    @property
    def n_rows(self) -> int:
        """One: the direction."""
        return 1

    @property
    def rows(self) -> np.ndarray:
        """`ûᵀ`, (N, 1, d)."""
        # Stored a row a dimension, along which products of directions are formed.
        return np.multiply(self.actions.T, self.inverse, order="C").T[:, None, :]

    @property
    def targets(self) -> np.ndarray:
        """`r`, (N, 1)."""
        return self.lengths[:, None]

    @property
    def squares(self) -> np.ndarray:
        """`r²`, (N,)."""
        return self.lengths**2

    @property
    def pulls(self) -> np.ndarray:
        """`û r`, (N, d)."""
        return self.rows[:, 0] * self.targets

    def products(self, weights: np.ndarray | None = None, out: np.ndarray | None = None) -> np.ndarray:
        """Compute the distinct entries of `ω û ûᵀ`; see `Observation.products`."""
        return distinct_products(self.rows[:, 0], weights, out)

    def weigh(self, P: np.ndarray) -> np.ndarray:
        """Compute `û ûᵀp`; see `Observation.weigh`."""
        return _project(self.rows[:, 0], P)


@dataclass(frozen=True)
class Expanded:
    """The observation of log-likelihoods that are expanded about predictions p, to second order.

    `A = a (N - ââᵀ) + (a + b) ââᵀ + c n nᵀ` takes the place of `QᵀQ`, with N the identity where the projection is not
    known, and `A p + g` that of `QᵀQ u`: for most A there is no action u that would be best for the sample.

    Parameters
    ----------
    blunt, along, towards : ndarray of shape (N,)
        a, b and c.
    ahead, normal : ndarray of shape (N, d)
        â, a unit vector or zero, and n.
    pulls : ndarray of shape (N, d)
        `A p + g`.
    squares : ndarray of shape (N,)
        What makes `s - 2 (A p + g)ᵀp' + p'ᵀA p'` the squared error at p.
    known : ndarray of shape (N,), bool
        Of which samples the projection is known.
    projections : ndarray of shape (K, d, d)
        The projections of these.
    """

    blunt: np.ndarray
    along: np.ndarray
    towards: np.ndarray
    ahead: np.ndarray
    normal: np.ndarray
    pulls: np.ndarray
    squares: np.ndarray
    known: np.ndarray
    projections: np.ndarray

    @classmethod
    def of(
        cls,
        P: np.ndarray,
        gradient: np.ndarray,
        error: np.ndarray,
        *parts: np.ndarray,
        known: np.ndarray,
        projections: np.ndarray,
    ) -> "Expanded":
        """Expand about predictions.

        Parameters
        ----------
        P : ndarray of shape (N, d)
            Predictions, behind the projections that are known.
        gradient : ndarray of shape (N, d)
            g.
        error : ndarray of shape (N,)
            Squared error at p.
        *parts : ndarray
            a, b, c, â and n.
        known : ndarray of shape (N,), bool
            Of which samples the projection is known.
        projections : ndarray of shape (K, d, d)
            The projections of these.

        Returns
        -------
        Expanded
            Of N samples.
        """
        blunt, along, towards, ahead, normal = parts
        inside, across = np.einsum("nd,nd->n", ahead, P), np.einsum("nd,nd->n", normal, P)
        AP = blunt[:, None] * P + (along * inside)[:, None] * ahead + (towards * across)[:, None] * normal
        pulls = AP + gradient
        squares = error + np.einsum("nd,nd->n", P, 2 * pulls - AP)
        return cls(blunt, along, towards, ahead, normal, pulls, squares, known, projections)

    def __len__(self) -> int:
        return len(self.blunt)

    def __getitem__(self, index: Any) -> "Expanded":
        behind = np.cumsum(self.known) - 1
        return Expanded(
            self.blunt[index],
            self.along[index],
            self.towards[index],
            self.ahead[index],
            self.normal[index],
            self.pulls[index],
            self.squares[index],
            self.known[index],
            self.projections[behind[index][self.known[index]]],
        )

    @property
    def whole(self) -> bool:
        """False: what a sample says hangs on its direction."""
        return False

    @property
    def n_actions(self) -> int:
        """The number of action dimensions, d."""
        return self.ahead.shape[1]

    @property
    def n_rows(self) -> int:
        """Those of N, â and n: d + 2."""
        return self.n_actions + 2

    @property
    def rows(self) -> np.ndarray:
        """Directions in which A weighs the policy, (N, d + 2, d)."""
        N, d = self.ahead.shape
        rows = np.empty((N, d + 2, d))
        rows[:, :d] = np.eye(d)
        rows[self.known, :d] = self.projections
        rows[:, d], rows[:, d + 1] = self.ahead, self.normal
        return rows

    @property
    def row_weights(self) -> np.ndarray:
        """How much it weighs each of them, (N, d + 2); not all above zero."""
        each = np.broadcast_to(self.blunt[:, None], self.ahead.shape)
        return np.column_stack([each, self.along, self.towards])

    @property
    def targets(self) -> None:
        """None: only `pulls` are known."""
        return

    def products(self, weights: np.ndarray | None = None, out: np.ndarray | None = None) -> np.ndarray:
        """Compute the distinct entries of `ω A`; see `Observation.products`."""
        i, j = pairs(self.n_actions)
        products = distinct_products(self.normal, self.towards, out)
        products += distinct_products(self.ahead, self.along)
        products[i == j] += np.where(self.known, 0.0, self.blunt)
        if len(self.projections):
            products[:, self.known] += self.blunt[self.known] * self.projections[:, i, j].T
        if weights is not None:
            products *= weights
        return products

    def weigh(self, P: np.ndarray) -> np.ndarray:
        """Compute `A p`; see `Observation.weigh`."""
        AP = self.blunt[:, None, None] * P
        if len(self.projections):
            AP[self.known] = np.einsum("nij,nlj->nli", self.projections, AP[self.known])
        AP += _project(self.ahead, P, self.along)
        AP += _project(self.normal, P, self.towards)
        return AP


def unknown(projections: np.ndarray) -> np.ndarray:
    """Find the projections that are not known.

    Parameters
    ----------
    projections : ndarray of shape (N, d, d)
        NaN where not known.

    Returns
    -------
    ndarray of shape (N,), bool
        True for those that are NaN.
    """
    return np.isnan(projections).any(axis=(1, 2))


def informative(projections: np.ndarray) -> np.ndarray:
    """Find the projections that say something of the policy even where nothing moves.

    Parameters
    ----------
    projections : ndarray of shape (N, d, d)
        NaN where not known.

    Returns
    -------
    ndarray of shape (N,), bool
        True for those that are known and not zero.
    """
    return ~unknown(projections) & projections.any(axis=(1, 2))


def observe(
    risk: str, U: np.ndarray, projections: np.ndarray | None = None, r: np.ndarray | None = None
) -> Observation:
    """Take from recorded actions what a risk uses.

    Parameters
    ----------
    risk : {"inconsistency", "direct", "whole"}
        Which risk; "whole" is direct but where the projection is known.
    U : ndarray of shape (N, d)
        The actions.
    projections : ndarray of shape (N, d, d), optional
        The nullspace projections, all NaN where one is not known. The direct risk does not use them.
    r : ndarray of shape (N,), optional
        The lengths of the actions, zero where nothing moves, if they are computed already.

    Returns
    -------
    Observation
        Of N samples.
    """
    d = U.shape[1]
    if risk == "direct":
        # Solvers square these, so they are in double precision.
        identities = np.broadcast_to(np.eye(d), (len(U), d, d))
        return Projected(identities, U.astype(np.float64, copy=False), whole=True)
    if risk == "whole":
        if projections is None:
            return observe("direct", U)
        rows = np.where(unknown(projections)[:, None, None], np.eye(d), projections)
        return Projected(rows, np.einsum("nij,nj->ni", rows, U))
    along = _along_motion(U, r)
    if projections is None:
        return along
    hidden = unknown(projections)
    if hidden.all():
        return along
    # An orthogonal projection is its own Q: NᵀN = N.
    rows = np.where(hidden[:, None, None], 0.0, projections)
    targets = np.einsum("nij,nj->ni", rows, U)
    rows[hidden, 0], targets[hidden, 0] = along[hidden].rows[:, 0], along.lengths[hidden]
    return Projected(rows, targets)


def squared_errors(observation: Observation, P: np.ndarray) -> np.ndarray:
    """Compute the squared error of predictions behind the observation's projections.

    Parameters
    ----------
    observation : Observation
        Of N samples.
    P : ndarray of shape (N, d)
        Predicted actions.

    Returns
    -------
    ndarray of shape (N,)
        `‖Q (u - p)‖²`, in squared units of the action.
    """
    assert observation.targets is not None
    return np.sum((observation.targets - np.einsum("nkd,nd->nk", observation.rows, P)) ** 2, axis=1)


def _along_motion(U: np.ndarray, r: np.ndarray | None = None) -> AlongMotion:
    if r is None:
        r = lengths(U)
        r[r <= NO_MOTION * r.max(initial=0.0)] = 0.0
    return AlongMotion(U, r, np.divide(1.0, r, out=np.zeros_like(r), where=r > 0))


def _project(q: np.ndarray, P: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
    """Compute `ω q qᵀp` for q (N, d) and P (N, L, d)."""
    along = np.einsum("nd,nld->nl", q, P)
    if weights is not None:
        along *= weights[:, None]
    return along[:, :, None] * q[:, None]
